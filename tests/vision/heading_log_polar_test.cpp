#include "vision/kernels/heading_log_polar.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"

namespace wasp::vision {
namespace {

constexpr int kWidth = 320, kHeight = 240;

/// Sum of plane waves with wavelengths of 8 to 60 px: a texture that can be sampled anywhere.
class Texture {
 public:
  explicit Texture(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> angle(0.0, 6.2831853), length(std::log(8.0), std::log(60.0));
    for (Wave& w : waves_) {
      const double k = 6.2831853 / std::exp(length(random)), a = angle(random);
      w = {k * std::cos(a), k * std::sin(a), angle(random)};
    }
  }
  /// Seen after the image turned by `turn` (x towards y), grew by `scale` about its centre and moved by (tu, tv).
  [[nodiscard]] std::vector<std::uint8_t> image(double turn, double scale, double tu = 0, double tv = 0) const {
    std::vector<std::uint8_t> pixels;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const double dx = (x - 0.5 * (kWidth - 1) - tu) / scale, dy = (y - 0.5 * (kHeight - 1) - tv) / scale;
        pixels.push_back(at(dx * std::cos(turn) + dy * std::sin(turn), -dx * std::sin(turn) + dy * std::cos(turn)));
      }
    return pixels;
  }

 private:
  struct Wave {
    double kx, ky, phase;
  };
  [[nodiscard]] std::uint8_t at(double x, double y) const {
    double sum = 0;
    for (const Wave& w : waves_) sum += std::sin(w.kx * x + w.ky * y + w.phase);
    return static_cast<std::uint8_t>(std::clamp(128.0 + 14.0 * sum, 0.0, 255.0));
  }
  std::array<Wave, 24> waves_;
};

GrayView view(const std::vector<std::uint8_t>& pixels) { return {pixels.data(), kWidth, kHeight, kWidth}; }

HeadingRate between(const std::vector<std::uint8_t>& first, const std::vector<std::uint8_t>& second) {
  HeadingLogPolar heading(kWidth, kHeight, kWidth);
  EXPECT_FALSE(heading.step(view(first)).valid);
  return heading.step(view(second));
}

TEST(HeadingLogPolar, TurnAndGrowthAboutAStillCentre) {
  std::vector<double> turn_error, ratio_error;
  for (unsigned seed = 1; seed <= 4; ++seed)
    for (const double turn : {-0.05, 0.0, 0.02})
      for (const double scale : {0.97, 1.0, 1.04}) {
        const Texture texture(seed);
        const HeadingRate rate = between(texture.image(0, 1), texture.image(turn, scale));
        if (!rate.valid) continue;
        turn_error.push_back(std::abs(static_cast<double>(rate.yaw_rad) + turn));
        ratio_error.push_back(std::abs(static_cast<double>(rate.height_ratio) * scale - 1.0));
      }
  ASSERT_GE(turn_error.size(), 32u) << "of 36";
  std::sort(turn_error.begin(), turn_error.end());
  std::sort(ratio_error.begin(), ratio_error.end());
  EXPECT_LT(turn_error[turn_error.size() / 2], 0.003) << "an eighth of a row";
  EXPECT_LT(ratio_error[ratio_error.size() / 2], 0.006);
  EXPECT_LT(turn_error.back(), 0.025) << "a row";
  EXPECT_LT(ratio_error.back(), 0.04);
}

TEST(HeadingLogPolar, AFloorThatMovesUnderTheCameraSpoilsIt) {
  // The limit of the method, which the similarity fit does not have: errors grow with the shift.
  double still = 0, moving = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const Texture texture(seed);
    const auto first = texture.image(0, 1);
    still += std::abs(static_cast<double>(between(first, texture.image(0.02, 1)).yaw_rad) + 0.02);
    moving += std::abs(static_cast<double>(between(first, texture.image(0.02, 1, 5, -3)).yaw_rad) + 0.02);
  }
  EXPECT_GT(moving, 3 * still);
}

TEST(HeadingLogPolar, NoTextureOrABadFrameIsInvalid) {
  const std::vector<std::uint8_t> flat(kWidth * kHeight, 90);
  EXPECT_FALSE(between(flat, flat).valid);
  const auto image = Texture(3).image(0, 1);
  HeadingLogPolar heading(kWidth, kHeight, kWidth);
  heading.step(view(image));
  EXPECT_FALSE(heading.step({}).valid);
  EXPECT_FALSE(heading.step({image.data(), kWidth, kHeight, kWidth + 4}).valid);
  EXPECT_FALSE(heading.step(view(image)).valid) << "the frame before was bad";
  EXPECT_TRUE(heading.step(view(image)).valid);
  heading.reset();
  EXPECT_FALSE(heading.step(view(image)).valid);
  EXPECT_THROW(HeadingLogPolar(kWidth, kHeight, kWidth, {.regions = 0}), std::invalid_argument);
  EXPECT_THROW(HeadingLogPolar(kWidth, kHeight, kWidth, {.regions = 2, .min_regions = 3}), std::invalid_argument);
}

TEST(HeadingLogPolar, UnrelatedFramesAreNotTrusted) {
  int trusted = 0;
  for (unsigned seed = 1; seed <= 10; ++seed)
    trusted += between(Texture(seed).image(0, 1), Texture(seed + 100).image(0, 1)).valid ? 1 : 0;
  EXPECT_LE(trusted, 1);
}

TEST(HeadingLogPolar, DoesNotAllocate) {
  const auto first = Texture(1).image(0, 1), second = Texture(1).image(0.01, 1.01);
  HeadingLogPolar heading(kWidth, kHeight, kWidth);
  const wasp::test::MallocCount count;
  {
    const rt::RealtimeSection section;
    heading.step(view(first));
    EXPECT_TRUE(heading.step(view(second)).valid);
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
