#include "drivers/kinect_depth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"

namespace wasp::drivers {
namespace {

/// The sensor's geometry (Khoshelham and Elberink 2012): baseline 75 mm, f 580 px, raw disparity in eighths of a pixel
/// counted down from an offset of about 1,090. Each model is a calibration of one such sensor.
float from_geometry_m(int raw) { return 0.075f * 580.f * 8.f / (1090.f - static_cast<float>(raw)); }

TEST(KinectDepth, ModelsAgreeWithTheSensorsGeometry) {
  for (int raw = 500; raw <= 1000; raw += 10) {
    const float want = from_geometry_m(raw);
    EXPECT_NEAR(kinect_depth_m(kMagnenatTangent, raw), want, 0.03f * want) << raw;
    EXPECT_NEAR(kinect_depth_m(kBurrusLinear, raw), want, 0.06f * want) << raw;
    if (raw < 650) continue;
    EXPECT_NEAR(kinect_depth_m(kThesisGaussians, raw), want, 0.11f * want) << raw;
  }
}

/// The thesis' fit reads a third short up close: where the geometry says 0.60 m, it says 0.41 m.
TEST(KinectDepth, TwoGaussiansReadShortUpClose) {
  EXPECT_LT(kinect_depth_m(kThesisGaussians, 510), 0.7f * from_geometry_m(510));
}

TEST(KinectDepth, TwoGaussiansAreInCentimetresAsPrinted) {
  const double want_cm = 3.169e4 * std::exp(-std::pow((800 - 1338.0) / 140.4, 2)) +
                         6.334e18 * std::exp(-std::pow((800 - 2.035e4) / 3154.0, 2));
  EXPECT_NEAR(kinect_depth_m(kThesisGaussians, 800), want_cm / 100, 1e-5);
  EXPECT_GT(kinect_depth_m(kThesisGaussians, 800), 1.0f);
  EXPECT_LT(kinect_depth_m(kThesisGaussians, 800), 1.5f);
}

TEST(KinectDepth, ValidValuesAreOneRisingRunInsideTheRange) {
  for (const KinectDepthModel& model : {kThesisGaussians, kMagnenatTangent, kBurrusLinear}) {
    const KinectTable table = make_kinect_table(model);
    int runs = 0, last = 0;
    for (const int mm : table.mm) {
      if (mm != 0) {
        EXPECT_GE(mm, 400);
        EXPECT_LE(mm, 7000);
        EXPECT_GE(mm, last);  // steps are under a millimetre up close
        runs += last == 0 ? 1 : 0;
      }
      last = mm;
    }
    EXPECT_EQ(runs, 1);
    EXPECT_EQ(table.mm[kKinectNoReading], 0);
    EXPECT_EQ(table.mm[0], 0);
  }
}

TEST(KinectDepth, ConvertsAnImageAlsoInPlaceAndIgnoresWhatIsNotElevenBits) {
  std::mt19937 random(1);
  const KinectTable table = make_kinect_table(kMagnenatTangent);
  std::vector<std::uint16_t> raw(20 * 7);
  for (auto& x : raw) x = static_cast<std::uint16_t>(random());
  raw[3] = 700;
  raw[4] = 2047;
  raw[5] = 65535;
  std::vector<std::uint16_t> out(23 * 7, 9);
  ASSERT_TRUE(kinect_depth(table, {raw.data(), 20, 7, 20}, out.data(), 23));
  for (std::size_t v = 0; v < 7; ++v)
    for (std::size_t u = 0; u < 20; ++u) {
      const int r = raw[v * 20 + u];
      EXPECT_EQ(out[v * 23 + u], r < 2048 ? table.mm[static_cast<std::size_t>(r)] : 0);
    }
  EXPECT_EQ(out[20], 9);  // beyond the row
  EXPECT_NEAR(out[3], 1000 * kinect_depth_m(kMagnenatTangent, 700), 0.51);
  const std::uint16_t first = table.mm[std::min<std::size_t>(raw[0], 2047)];
  ASSERT_TRUE(kinect_depth(table, {raw.data(), 20, 7, 20}, raw.data(), 20));
  EXPECT_EQ(raw[0], first);
}

TEST(KinectDepth, TheRawValueOfADepthIsTheNearestThereIs) {
  for (const KinectDepthModel& model : {kThesisGaussians, kMagnenatTangent, kBurrusLinear}) {
    const KinectTable table = make_kinect_table(model);
    for (int mm = 405; mm < 6900; ++mm) {
      const int raw = kinect_raw(table, mm);
      ASSERT_LT(raw, kKinectNoReading) << mm;
      const auto error = [&](int r) { return std::abs(table.mm[static_cast<std::size_t>(r)] - mm); };
      EXPECT_LE(error(raw), error(raw - 1)) << mm;
      if (table.mm[static_cast<std::size_t>(raw) + 1] != 0) {
        EXPECT_LE(error(raw), error(raw + 1)) << mm;
      }
    }
    for (const int none : {0, -5, 300, 7200, 65535}) EXPECT_EQ(kinect_raw(table, none), kKinectNoReading) << none;
    EXPECT_EQ(kinect_raw(KinectTable{}, 1000), kKinectNoReading);
  }
}

TEST(KinectDepth, NamesFindThePublishedModels) {
  KinectDepthModel model;
  for (const KinectDepthModel& want : {kThesisGaussians, kMagnenatTangent, kBurrusLinear}) {
    ASSERT_TRUE(published_model(name_of(want.kind), model));
    EXPECT_EQ(model.coefficients, want.coefficients);
  }
  EXPECT_FALSE(published_model("parabola", model));
}

TEST(KinectDepth, RefusesBadInput) {
  const KinectTable table = make_kinect_table(kMagnenatTangent);
  std::vector<std::uint16_t> raw(64, 700), out(64, 9);
  EXPECT_FALSE(kinect_depth(table, {}, out.data(), 8));
  EXPECT_FALSE(kinect_depth(table, {raw.data(), 8, 8, 4}, out.data(), 8));
  EXPECT_FALSE(kinect_depth(table, {raw.data(), 8, 8, 8}, nullptr, 8));
  EXPECT_FALSE(kinect_depth(table, {raw.data(), 8, 8, 8}, out.data(), 7));
  EXPECT_EQ(out[0], 9);
  for (const int bad : {-1, 2047, 2048, 1 << 20}) EXPECT_EQ(kinect_depth_m(kThesisGaussians, bad), 0.f);
  for (const KinectRange& bad : {KinectRange{7.f, 0.4f}, KinectRange{std::nanf(""), 7.f}, KinectRange{-1.f, 7.f},
                                 KinectRange{0.4f, std::numeric_limits<float>::infinity()}})
    EXPECT_EQ(make_kinect_table({KinectModel::kTangent, kMagnenatTangent.coefficients, bad}).mm[700], 0);
}

TEST(KinectDepth, AllocatesNothing) {
  const KinectTable table = make_kinect_table(kMagnenatTangent);
  std::vector<std::uint16_t> raw(640 * 480, 700);
  const test::MallocCount count;
  {
    const rt::RealtimeSection section;
    kinect_depth(table, {raw.data(), 640, 480, 640}, raw.data(), 640);
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::drivers
