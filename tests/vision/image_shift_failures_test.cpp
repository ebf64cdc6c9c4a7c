// What image_shift says of pairs it cannot or can hardly measure: a shift it calls valid must be right within a pixel.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "tests/vision/shift_picture.h"
#include "vision/kernels/image_shift.h"

namespace wasp::vision {
namespace {

using test::error_of;
using test::Picture;
using test::view;

constexpr ImageShiftParams kQuick = test::kQuickShift;
using Pixels = std::vector<std::uint8_t>;

TEST(ImageShiftFailures, TurningAndGrowingPicturesAreMeasuredAtTheirMiddleOrReported) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> motion(-6, 6);
  int silent = 0, measured = 0, plain_worse = 0, pairs = 0;
  for (const int side : {64, 128})
    for (unsigned seed = 0; seed < 4; ++seed) {
      ImageShiftPlan plan(side, side, kQuick);
      for (int k = -5; k <= 5; ++k) {
        Picture picture(700 + seed);
        const double x = motion(random), y = motion(random);
        const double turn_rad = k * std::numbers::pi / 180, zoom = seed % 2 == 0 ? 1 : 1 + 0.02 * k;
        const auto a = picture.window(side, side, 0, 0, 40), b = picture.window(side, side, x, y, 40, turn_rad, zoom);
        const ImageShift s = plan.estimate(view(a, side), view(b, side));
        const double error = error_of(s, x, y);
        ++pairs;
        silent += s.valid && error > 1 ? 1 : 0;
        measured += s.valid && error < 0.5 ? 1 : 0;
        plain_worse += s.valid && s.warped ? 1 : 0;
      }
    }
  EXPECT_EQ(silent, 0);
  EXPECT_GT(measured, pairs / 2);
  EXPECT_GT(plain_worse, pairs / 10) << "the affine fit was hardly ever needed";
}

/// Pairs with no true answer within reach, by name of what they are.
using Maker = std::function<Pixels(int side, std::mt19937& random)>;
struct Hopeless {
  const char* name;
  Maker first, second;
};
Pixels noise(int side, std::mt19937& random) {
  Pixels p(static_cast<std::size_t>(side * side));
  for (auto& v : p) v = static_cast<std::uint8_t>(random());
  return p;
}
Pixels flat_noise(int side, std::mt19937& random) {
  Pixels p(static_cast<std::size_t>(side * side));
  for (auto& v : p) v = static_cast<std::uint8_t>(128 + random() % 3);
  return p;
}
Pixels saturated(int side, std::mt19937& random) {
  Pixels p(static_cast<std::size_t>(side * side), 255);
  for (int i = 0; i < 3; ++i) p[random() % p.size()] = 250;
  return p;
}
Pixels picture(int side, std::mt19937& random) {
  return Picture(static_cast<unsigned>(random())).window(side, side, 0, 0, 40);
}
Pixels checks_moved(int side, int shift) {
  Pixels p;
  for (int v = 0; v < side; ++v)
    for (int u = 0; u < side; ++u) p.push_back(((u - shift + 64) / 8 + v / 8) % 2 == 0 ? 20 : 220);
  return p;
}
Pixels checks(int side, std::mt19937& random) { return checks_moved(side, static_cast<int>(random() % 8)); }
Pixels stripes(int side, std::mt19937&) {
  Pixels p;
  for (int v = 0; v < side; ++v)
    for (int u = 0; u < side; ++u) p.push_back(static_cast<std::uint8_t>(v % 16 < 8 ? 20 : 220));
  return p;
}
Pixels ramp(int side, std::mt19937&) {
  Pixels p;
  for (int v = 0; v < side; ++v)
    for (int u = 0; u < side; ++u) p.push_back(static_cast<std::uint8_t>(255 * (u + v) / (2 * side)));
  return p;
}

class HopelessPairs : public testing::TestWithParam<Hopeless> {};

TEST_P(HopelessPairs, AreNeverCalledValid) {
  for (const int side : {64, 128, 256}) {
    ImageShiftPlan plan(side, side, kQuick);
    std::mt19937 random(5);
    for (int i = 0; i < 6; ++i) {
      const auto a = GetParam().first(side, random), b = GetParam().second(side, random);
      const ImageShift s = plan.estimate(view(a, side), view(b, side));
      EXPECT_FALSE(s.valid) << side << " " << i << ": " << s.x_px << " " << s.y_px << ", quality " << s.quality;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, HopelessPairs,
                         testing::Values(Hopeless{"noise", &noise, &noise},
                                         Hopeless{"nearly_flat", &flat_noise, &flat_noise},
                                         Hopeless{"saturated", &saturated, &saturated},
                                         Hopeless{"unrelated", &picture, &picture},
                                         Hopeless{"picture_and_noise", &picture, &noise},
                                         Hopeless{"stripes", &stripes, &stripes}, Hopeless{"ramps", &ramp, &ramp}),
                         [](const auto& hopeless) { return std::string(hopeless.param.name); });

/// A repeating texture has many right answers: 8 px checks come again every (8, 8) and (16, 0).
TEST(ImageShiftFailures, ChecksAreMeasuredUpToAPeriodOrReported) {
  for (const int side : {64, 128, 256}) {
    ImageShiftPlan plan(side, side, kQuick);
    for (int shift = -7; shift <= 7; ++shift) {
      const auto a = checks_moved(side, 0), b = checks_moved(side, shift);
      const ImageShift s = plan.estimate(view(a, side), view(b, side));
      if (!s.valid) continue;
      const double x = static_cast<double>(s.x_px) - shift, y = static_cast<double>(s.y_px);
      EXPECT_LT(std::abs(std::remainder(x + y, 16)), 0.5) << side << " " << shift << ": " << s.x_px << " " << s.y_px;
      EXPECT_LT(std::abs(std::remainder(x - y, 16)), 0.5) << side << " " << shift << ": " << s.x_px << " " << s.y_px;
    }
  }
}

TEST(ImageShiftFailures, WhateverTheInputTheResultIsFiniteAndBounded) {
  std::mt19937 random(99);
  const Maker makers[] = {&noise, &flat_noise, &saturated, &picture, &checks, &stripes, &ramp};
  for (const int side : {32, 33, 61, 64, 100, 129}) {
    ImageShiftPlan plan(side, side, kQuick);
    for (int i = 0; i < 40; ++i) {
      const auto a = makers[random() % std::size(makers)](side, random),
                 b = makers[random() % std::size(makers)](side, random);
      const ImageShift s = plan.estimate(view(a, side), view(b, side));
      const float reach = static_cast<float>(side);
      ASSERT_TRUE(std::abs(s.x_px) <= reach && std::abs(s.y_px) <= reach) << side << " " << i;
      ASSERT_TRUE(s.quality >= 0 && s.quality <= 1 && s.rival >= 0 && s.rival <= 1);
      ASSERT_LE(s.candidates, ImageShiftPlan::kCandidates);
      ASSERT_LE(s.fits, shift::kMostFits);
      const ImageShift again = plan.estimate(view(a, side), view(b, side));
      ASSERT_EQ(again.x_px, s.x_px) << "an estimate depends on what came before";
      ASSERT_EQ(again.valid, s.valid);
    }
  }
}

}  // namespace
}  // namespace wasp::vision
