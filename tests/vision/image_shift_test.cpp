// Shift of natural-looking pictures made from seeds (1/f spectrum), cut as real crops: neither window's border is in
// the other. Bars are the issue's; the printed shear average must fail where the default does not.
#include "vision/kernels/image_shift.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "tests/vision/shift_picture.h"
#include "vision/kernels/image_shift_reference.h"

namespace wasp::vision {
namespace {

constexpr ImageShiftParams kQuick = test::kQuickShift;

using test::error_of;
using test::Picture;
using test::view;

struct Case {
  int side;
  double most_px, rmse_px;
};
class RealCrops : public testing::TestWithParam<Case> {};

TEST_P(RealCrops, AreMeasuredWithinTheBarAt30Decibel) {
  const Case c = GetParam();
  ImageShiftPlan plan(c.side, c.side, kQuick);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> length(2.0, c.most_px), angle(0.0, 2 * std::numbers::pi);
  double square = 0;
  constexpr int kPairs = 12;
  for (int i = 0; i < kPairs; ++i) {
    Picture picture(100u + static_cast<unsigned>(i));
    const double r = length(random), a = angle(random), x = r * std::cos(a), y = r * std::sin(a);
    const auto first = picture.window(c.side, c.side, 0, 0, 30), second = picture.window(c.side, c.side, x, y, 30);
    const ImageShift shift = plan.estimate(view(first, c.side), view(second, c.side));
    EXPECT_TRUE(shift.valid) << i;
    EXPECT_GT(shift.coefficient, 0.7f);
    square += std::pow(error_of(shift, x, y), 2) / kPairs;
  }
  EXPECT_LE(std::sqrt(square), c.rmse_px);
}

INSTANTIATE_TEST_SUITE_P(Sides, RealCrops,
                         testing::Values(Case{64, 5.0, 0.1}, Case{128, 15.0, 0.05}, Case{256, 15.0, 0.05}));

TEST(ImageShift, WindowsNeedNotBeSquare) {
  for (const auto& [columns, rows] : {std::pair{160, 120}, {96, 64}, {320, 240}, {33, 47}}) {
    Picture picture(7);
    ImageShiftPlan plan(columns, rows, kQuick);
    const auto a = picture.window(columns, rows, 0, 0, 40), b = picture.window(columns, rows, 3.25, -2.5, 40);
    EXPECT_LT(error_of(plan.estimate(view(a, columns), view(b, columns)), 3.25, -2.5), 0.15) << columns << "x" << rows;
  }
}

TEST(ImageShift, SwappingTheImagesTurnsTheShiftRound) {
  Picture picture(3);
  ImageShiftPlan plan(128, 128, kQuick);
  const auto a = picture.window(128, 128, 0, 0, 30), b = picture.window(128, 128, 6.4, -9.7, 30);
  const auto there = plan.estimate(view(a, 128), view(b, 128)), back = plan.estimate(view(b, 128), view(a, 128));
  EXPECT_NEAR(there.x_px, -back.x_px, 0.03);
  EXPECT_NEAR(there.y_px, -back.y_px, 0.03);
}

TEST(ImageShift, IgnoresBrightnessAndContrast) {
  Picture picture(4);
  ImageShiftPlan plan(128, 128, kQuick);
  const auto a = picture.window(128, 128, 0, 0, 40);
  auto b = picture.window(128, 128, 4.5, 2.25, 40);
  for (auto& p : b) p = static_cast<std::uint8_t>(40 + p / 2);
  EXPECT_LT(error_of(plan.estimate(view(a, 128), view(b, 128)), 4.5, 2.25), 0.05);
}

TEST(ImageShift, FlatSaturatedAndBadInputIsInvalid) {
  ImageShiftPlan plan(64, 64, kQuick);
  const std::vector<std::uint8_t> flat(64 * 64, 255);
  EXPECT_FALSE(plan.estimate(view(flat, 64), view(flat, 64)).valid);
  Picture picture(9);
  const auto good = picture.window(64, 64, 0, 0, 40);
  EXPECT_FALSE(plan.estimate(view(good, 64), view(flat, 64)).valid);
  EXPECT_FALSE(plan.estimate({}, view(good, 64)).valid);
  EXPECT_FALSE(plan.estimate(view(good, 64), {good.data(), 64, 63, 64}).valid);
  EXPECT_FALSE(plan.estimate(view(good, 64), {good.data(), 64, 64, 60}).valid);
  EXPECT_THROW(ImageShiftPlan(31, 64, kQuick), std::invalid_argument);
  EXPECT_THROW(ImageShiftPlan(64, 513, kQuick), std::invalid_argument);
}

TEST(ImageShift, AllocatesNothing) {
  Picture picture(12);
  ImageShiftPlan plan(256, 256, kQuick);
  ShiftReference reference(256, 256);
  const auto a = picture.window(256, 256, 0, 0, 40), b = picture.window(256, 256, 9, -4, 40);
  const wasp::test::MallocCount count;
  {
    const rt::RealtimeSection section;
    (void)plan.estimate(view(a, 256), view(b, 256));
    for (const ShiftMethod method : kShiftMethods) (void)reference.estimate(method, view(a, 256), view(b, 256));
  }
  EXPECT_EQ(count.violations(), 0u);
}

/// The same picture moved round a torus: the only case (3.17) is right for.
std::vector<std::uint8_t> rolled(const std::vector<std::uint8_t>& in, int side, int x, int y) {
  std::vector<std::uint8_t> out(in.size());
  for (int v = 0; v < side; ++v)
    for (int u = 0; u < side; ++u)
      out[static_cast<std::size_t>(((v + y + side) % side) * side + (u + x + side) % side)] =
          in[static_cast<std::size_t>(v * side + u)];
  return out;
}

TEST(ShiftReference, EveryMethodMeasuresACircularShift) {
  Picture picture(21);
  const auto a = picture.window(64, 64, 0, 0, 60), b = rolled(a, 64, 5, -3);
  ShiftReference reference(64, 64, false);
  for (const ShiftMethod method : kShiftMethods)
    EXPECT_LT(error_of(reference.estimate(method, view(a, 64), view(b, 64)), 5, -3), 0.6) << static_cast<int>(method);
}

TEST(ShiftReference, ShearAverageFailsOnRealCropsAndTheDefaultDoesNot) {
  ShiftReference reference(128, 128);
  ImageShiftPlan plan(128, 128, kQuick);
  int shear_wrong = 0, default_wrong = 0;
  constexpr int kPairs = 12;
  for (int i = 0; i < kPairs; ++i) {
    Picture picture(300u + static_cast<unsigned>(i));
    const auto a = picture.window(128, 128, 0, 0, 40), b = picture.window(128, 128, 10, 4, 40);
    const auto shear = reference.estimate(ShiftMethod::kShearAverage, view(a, 128), view(b, 128));
    shear_wrong += error_of(shear, 10, 4) > 1.0 ? 1 : 0;
    default_wrong += error_of(plan.estimate(view(a, 128), view(b, 128)), 10, 4) > 0.1 ? 1 : 0;
  }
  EXPECT_GE(shear_wrong, kPairs * 3 / 4);
  EXPECT_EQ(default_wrong, 0);
}

}  // namespace
}  // namespace wasp::vision
