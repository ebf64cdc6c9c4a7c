// What each corruption does to a picture, counted pixel by pixel.
#include "scheduling/frame_faults.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

namespace wasp::scheduling {
namespace {

constexpr int kWidth = 64, kHeight = 48, kStride = 72;

template <class T>
struct Picture {
  explicit Picture(T value) : memory(static_cast<std::size_t>(kStride) * kHeight, value) {}
  Pixels<T> pixels() { return {memory.data(), kWidth, kHeight, kStride}; }
  T at(int u, int v) const { return memory[static_cast<std::size_t>(v * kStride + u)]; }
  T& at(int u, int v) { return memory[static_cast<std::size_t>(v * kStride + u)]; }
  /// Pixels with this value; what lies between the rows does not count.
  int count(T value) const {
    int n = 0;
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) n += at(u, v) == value;
    return n;
  }
  bool padding_is(T value) const {
    for (int v = 0; v < kHeight; ++v)
      for (int u = kWidth; u < kStride; ++u)
        if (at(u, v) != value) return false;
    return true;
  }
  std::pair<double, double> mean_and_deviation() const {
    double sum = 0, squares = 0;
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) sum += at(u, v), squares += static_cast<double>(at(u, v)) * at(u, v);
    const double mean = sum / (kWidth * kHeight);
    return {mean, std::sqrt(squares / (kWidth * kHeight) - mean * mean)};
  }
  std::vector<T> memory;
};
using Gray = Picture<std::uint8_t>;
using Depth = Picture<std::uint16_t>;

std::vector<std::byte> frame(PixelFormat format, std::uint32_t width, std::uint32_t height, std::uint32_t stride) {
  FrameHeader h;
  h.format = format;
  h.width_px = width;
  h.height_px = height;
  h.stride_bytes = stride;
  std::vector<std::byte> bytes(kFramePixelOffset + 1000);
  std::memcpy(bytes.data(), &h, sizeof h);
  return bytes;
}

TEST(FrameFaults, OnlyAHeaderThatFitsItsMemoryGivesPixels) {
  auto good = frame(PixelFormat::kMono8, 20, 10, 100);
  EXPECT_TRUE(gray_pixels(good.data(), good.size()).valid());
  EXPECT_FALSE(depth_pixels(good.data(), good.size()).valid());
  EXPECT_FALSE(gray_pixels(good.data(), good.size() - 1).valid());
  EXPECT_FALSE(gray_pixels(good.data(), 10).valid());
  for (auto bad : {frame(PixelFormat::kMono8, 20, 11, 100), frame(PixelFormat::kMono8, 101, 10, 100),
                   frame(PixelFormat::kMono8, 0, 10, 100), frame(PixelFormat::kMono8, 20, ~0u, ~0u),
                   frame(PixelFormat::kNone, 20, 10, 100)})
    EXPECT_FALSE(gray_pixels(bad.data(), bad.size()).valid());
  auto odd = frame(PixelFormat::kDepth16Mm, 20, 10, 41);
  EXPECT_FALSE(depth_pixels(odd.data(), odd.size()).valid());
}

TEST(FrameFaults, LevelsFillTheImageAndNothingElse) {
  Gray image(7);
  fill_gray(image.pixels(), 255);
  EXPECT_EQ(image.count(255), kWidth * kHeight);
  EXPECT_TRUE(image.padding_is(7));
}

TEST(FrameFaults, BlurIsTheMeanOfASquare) {
  Gray image(0);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) image.at(u, v) = static_cast<std::uint8_t>((u * 7 + v * 13) % 251);
  const Gray before = image;
  std::vector<std::uint8_t> scratch(kWidth * kHeight);
  std::vector<std::uint32_t> columns(kWidth);
  constexpr int kRadius = 3;
  blur_gray(image.pixels(), kRadius, scratch, columns);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      double sum = 0;
      int n = 0;
      for (int y = std::max(0, v - kRadius); y <= std::min(kHeight - 1, v + kRadius); ++y)
        for (int x = std::max(0, u - kRadius); x <= std::min(kWidth - 1, u + kRadius); ++x) sum += before.at(x, y), ++n;
      ASSERT_NEAR(image.at(u, v), sum / n, 2.0) << u << " " << v;  // rounded down twice
    }
  EXPECT_TRUE(image.padding_is(0));
}

TEST(FrameFaults, BlurOfARadiusBeyondTheImageStaysInBounds) {
  Gray image(100);
  std::vector<std::uint8_t> scratch(kWidth * kHeight);
  std::vector<std::uint32_t> columns(kWidth);
  blur_gray(image.pixels(), 500, scratch, columns);
  EXPECT_EQ(image.count(100), kWidth * kHeight);
}

TEST(FrameFaults, NoiseHasItsDeviationAndNoBias) {
  Gray image(128);
  FaultRandom random;
  add_noise(image.pixels(), 20, random);
  const auto [mean, deviation] = image.mean_and_deviation();
  EXPECT_NEAR(mean, 128, 2);
  EXPECT_NEAR(deviation, 20, 2);
  Depth depth(1000);
  depth.at(3, 3) = 0;
  add_noise(depth.pixels(), 150, random);
  EXPECT_EQ(depth.at(3, 3), 0);
  EXPECT_NEAR(depth.mean_and_deviation().second, 150, 25);
}

TEST(FrameFaults, BandTearAndGainDoWhatTheirSharesSay) {
  Gray image(90);
  kill_band(image.pixels(), 0.25f);
  EXPECT_EQ(image.count(0), kWidth * 12);
  EXPECT_EQ(image.at(0, 17), 90);
  EXPECT_EQ(image.at(0, 18), 0);
  EXPECT_EQ(image.at(0, 29), 0);
  EXPECT_EQ(image.at(0, 30), 90);
  Gray torn(10), before(20);
  tear(torn.pixels(), before.pixels(), 0.5f);
  EXPECT_EQ(torn.at(5, 23), 10);
  EXPECT_EQ(torn.at(5, 24), 20);
  GrayPixels narrower = before.pixels();
  narrower.width_px = 10;
  Gray whole(10);
  tear(whole.pixels(), narrower, 0.f);
  EXPECT_EQ(whole.count(10), kWidth * kHeight);
  Gray bright(60);
  bright.at(0, 0) = 200;
  multiply(bright.pixels(), 2);
  EXPECT_EQ(bright.at(1, 0), 120);
  EXPECT_EQ(bright.at(0, 0), 255);
}

TEST(FrameFaults, HolesCoverTheirShareInBlocks) {
  FaultRandom random;
  Depth none(900), all(900), some(900);
  make_holes(none.pixels(), 0, random);
  make_holes(all.pixels(), 1, random);
  int holes = 0;
  for (int i = 0; i < 200; ++i) {
    some = Depth(900);
    make_holes(some.pixels(), 0.3f, random);
    holes += some.count(0);
    EXPECT_EQ(some.count(0) % 64, 0);
  }
  EXPECT_EQ(none.count(0), 0);
  EXPECT_EQ(all.count(0), kWidth * kHeight);
  EXPECT_NEAR(holes / 200.0 / (kWidth * kHeight), 0.3, 0.03);
  EXPECT_TRUE(all.padding_is(900));
}

TEST(FrameFaults, MeasurementsAreBiasedQuantisedAndReplacedAndHolesStay) {
  Depth image(1130);
  image.at(0, 0) = 0;
  add_bias(image.pixels(), -200);
  EXPECT_EQ(image.at(1, 0), 930);
  quantise(image.pixels(), 250);
  EXPECT_EQ(image.at(1, 0), 1000);
  add_bias(image.pixels(), -5000);
  EXPECT_EQ(image.at(1, 0), 1);  // never a hole
  fill_depth(image.pixels(), 42, false);
  EXPECT_EQ(image.at(1, 0), 42);
  EXPECT_EQ(image.at(0, 0), 0);
  fill_depth(image.pixels(), 70000, true);
  EXPECT_EQ(image.count(65535), kWidth * kHeight);
}

}  // namespace
}  // namespace wasp::scheduling
