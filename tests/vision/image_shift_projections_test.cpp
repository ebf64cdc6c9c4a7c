#include "vision/kernels/image_shift_projections.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "tests/vision/shift_picture.h"

namespace wasp::vision {
namespace {

using test::error_of;
using test::Picture;
using test::view;

constexpr ShiftProjectionsParams kQuick{.planning = FftPlanning::kEstimate};

TEST(ShiftProjections, MeasureSmallShiftsOfRealCrops) {
  std::mt19937 random(31);
  std::uniform_real_distribution<double> motion(-4, 4);
  for (const auto& [columns, rows] : {std::pair{128, 128}, {256, 256}, {160, 120}}) {
    ShiftProjections projections(columns, rows, kQuick);
    int good = 0, silent = 0;
    constexpr int kPairs = 12;
    for (unsigned i = 0; i < kPairs; ++i) {
      Picture picture(900 + i);
      const double x = motion(random), y = motion(random);
      const auto a = picture.window(columns, rows, 0, 0, 40), b = picture.window(columns, rows, x, y, 40);
      const ImageShift s = projections.estimate(view(a, columns), view(b, columns));
      good += error_of(s, x, y) < 0.5 ? 1 : 0;
      silent += s.valid && error_of(s, x, y) > 1 ? 1 : 0;
    }
    EXPECT_GE(good, kPairs * 3 / 4) << columns;
    EXPECT_EQ(silent, 0) << columns;
  }
}

TEST(ShiftProjections, BadInputIsInvalid) {
  ShiftProjections projections(64, 64, kQuick);
  const std::vector<std::uint8_t> flat(64 * 64, 200);
  Picture picture(3);
  const auto good = picture.window(64, 64, 0, 0, 40);
  EXPECT_FALSE(projections.estimate(view(flat, 64), view(flat, 64)).valid);
  EXPECT_FALSE(projections.estimate({}, view(good, 64)).valid);
  EXPECT_FALSE(projections.estimate(view(good, 64), {good.data(), 64, 63, 64}).valid);
  EXPECT_FALSE(projections.estimate(view(good, 64), {good.data(), 64, 64, 60}).valid);
  EXPECT_THROW(ShiftProjections(31, 64, kQuick), std::invalid_argument);
  EXPECT_THROW(ShiftProjections(64, 513, kQuick), std::invalid_argument);
}

TEST(ShiftProjections, UnrelatedNoiseIsReported) {
  ShiftProjections projections(128, 128, kQuick);
  std::mt19937 random(5);
  int accepted = 0;
  for (int i = 0; i < 50; ++i) {
    std::vector<std::uint8_t> a(128 * 128), b(128 * 128);
    for (auto* image : {&a, &b})
      for (auto& p : *image) p = static_cast<std::uint8_t>(random());
    accepted += projections.estimate(view(a, 128), view(b, 128)).valid ? 1 : 0;
  }
  EXPECT_EQ(accepted, 0);
}

TEST(ShiftProjections, AllocateNothing) {
  ShiftProjections projections(256, 256, kQuick);
  Picture picture(12);
  const auto a = picture.window(256, 256, 0, 0, 40), b = picture.window(256, 256, 3, -2, 40);
  const wasp::test::MallocCount count;
  {
    const rt::RealtimeSection section;
    (void)projections.estimate(view(a, 256), view(b, 256));
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
