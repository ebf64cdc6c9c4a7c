#include "sim/sensor_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace wasp::sim {
namespace {

constexpr int kWidth = 640;

struct Statistics {
  double mean = 0, sigma = 0, invalid = 0;
};

/// Many rows at one true depth [m]; readings in metres.
Statistics flat_wall(SensorModel& model, float depth_m) {
  const std::vector<float> truth(kWidth, depth_m);
  std::vector<std::uint16_t> out(kWidth);
  double sum = 0, squares = 0, valid = 0, all = 0;
  for (int row = 0; row < 200; ++row) {
    model.depth_row(7, row, truth.data(), out.data());
    for (const std::uint16_t mm : out) {
      ++all;
      if (mm == 0) continue;
      const double z = mm * 1e-3;
      ++valid, sum += z, squares += z * z;
    }
  }
  const double mean = sum / valid;
  return {mean, std::sqrt(squares / valid - mean * mean), 1 - valid / all};
}

TEST(SensorModel, DepthNoiseGrowsWithTheSquareOfDepth) {
  SensorModel model({}, kWidth, 525, 1);
  for (const float z : {0.8f, 1.5f, 3.f, 5.f}) {
    const Statistics s = flat_wall(model, z);
    const double depth = static_cast<double>(z);
    EXPECT_NEAR(s.mean, depth, 1e-3 * depth * depth) << z;
    EXPECT_NEAR(s.sigma, 1.42e-3 * depth * depth, 0.35e-3 * depth * depth) << z;
  }
}

TEST(SensorModel, ReadingsAreQuantisedInDisparity) {
  const auto table = drivers::make_kinect_table(drivers::kBurrusLinear).mm;
  int values = 0;
  for (std::size_t raw = 1; raw < table.size(); ++raw) {
    values += table[raw] != 0;
    if (table[raw] == 0 || table[raw - 1] == 0) continue;
    const double step_mm = 3.0711e-6 * table[raw] * table[raw - 1];  // 1/z falls by 0.0030711 /m
    EXPECT_NEAR(table[raw] - table[raw - 1], step_mm, 1.1) << "raw " << raw;
  }
  EXPECT_GT(values, 600);
  EXPECT_LT(values, 800) << "as many levels as a Kinect has between 0.4 m and 7 m";
}

TEST(SensorModel, OutsideTheRangeReadsZero) {
  SensorModel model({}, kWidth, 525, 1);
  std::vector<std::uint16_t> out(kWidth);
  for (const float z : {0.f, 0.1f, 0.38f, 7.6f, 50.f}) {
    const std::vector<float> truth(kWidth, z);
    model.depth_row(0, 0, truth.data(), out.data());
    for (const std::uint16_t mm : out) ASSERT_EQ(mm, 0) << z;
  }
}

TEST(SensorModel, ANearObjectShadesWhatIsLeftOfItFromTheProjector) {
  SensorParams params;
  params.dropout = 0;
  SensorModel model(params, kWidth, 525, 1);
  std::vector<float> truth(kWidth, 3.f);
  for (int u = 300; u < 400; ++u) truth[static_cast<std::size_t>(u)] = 1.f;
  std::vector<std::uint16_t> out(kWidth);
  model.depth_row(0, 0, truth.data(), out.data());
  int holes = 0;
  for (int u = 0; u < kWidth; ++u) holes += out[static_cast<std::size_t>(u)] == 0;
  EXPECT_NEAR(holes, 525 * 0.075 * (1 - 1.0 / 3), 1.5);
  EXPECT_EQ(out[290], 0);
  EXPECT_NE(out[260], 0);
  EXPECT_NE(out[405], 0) << "no shadow on the right";
}

TEST(SensorModel, TheSkyShadesNothing) {
  SensorModel model({.dropout = 0.f}, kWidth, 525, 1);
  std::vector<float> truth(kWidth, 2.f);
  std::fill(truth.begin() + 400, truth.end(), 0.f);  // nothing hit to the right of a wall
  std::vector<std::uint16_t> out(kWidth);
  model.depth_row(0, 0, truth.data(), out.data());
  int seen = 0;
  for (int u = 0; u < 400; ++u) seen += out[static_cast<std::size_t>(u)] != 0 ? 1 : 0;
  EXPECT_EQ(seen, 400);
}

TEST(SensorModel, SameSeedAndFrameSameImageOtherwiseAnother) {
  SensorModel a({}, kWidth, 525, 1), b({}, kWidth, 525, 1), c({}, kWidth, 525, 2);
  const std::vector<float> truth(kWidth, 2.f), light(kWidth, 100.f);
  std::vector<std::uint16_t> x(kWidth), y(kWidth);
  a.depth_row(3, 5, truth.data(), x.data());
  b.depth_row(9, 9, truth.data(), y.data());
  EXPECT_NE(x, y);
  b.depth_row(3, 5, truth.data(), y.data());
  EXPECT_EQ(x, y) << "independent of what was rendered before";
  c.depth_row(3, 5, truth.data(), y.data());
  EXPECT_NE(x, y);
  std::vector<std::uint8_t> p(kWidth), q(kWidth);
  a.gray_row(3, 5, light.data(), p.data());
  b.gray_row(3, 5, light.data(), q.data());
  EXPECT_EQ(p, q);
  b.gray_row(4, 5, light.data(), q.data());
  EXPECT_NE(p, q);
}

TEST(SensorModel, GreyNoiseHasTheStatedDeviation) {
  const SensorParams params;
  const SensorModel model(params, kWidth, 525, 1);
  const std::vector<float> light(kWidth, 120.f);
  std::vector<std::uint8_t> out(kWidth);
  double sum = 0, squares = 0;
  for (int row = 0; row < 200; ++row) {
    model.gray_row(0, row, light.data(), out.data());
    for (const double value : out) sum += value, squares += value * value;
  }
  const double n = 200.0 * kWidth, mean = sum / n;
  const double expected =
      static_cast<double>(params.read_noise * params.read_noise + params.photon_noise * 120) + 1.0 / 12;
  EXPECT_NEAR(mean, 120, 0.1);
  EXPECT_NEAR(squares / n - mean * mean, expected, 0.1 * expected);
}

TEST(SensorModel, WithoutNoiseItIsExactToTheMillimetre) {
  SensorParams params;
  params.noise = false;
  SensorModel model(params, 4, 525, 1);
  const float truth[4] = {0.39f, 1.2347f, 6.9994f, 7.1f};
  std::uint16_t out[4];
  model.depth_row(0, 0, truth, out);
  EXPECT_EQ(out[0], 0);
  EXPECT_EQ(out[1], 1235);
  EXPECT_EQ(out[2], 6999);
  EXPECT_EQ(out[3], 0);
}

}  // namespace
}  // namespace wasp::sim
