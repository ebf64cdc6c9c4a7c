#include "vision/kernels/depth_median.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "tests/vision/every_target.h"
#include "vision/kernels/depth_median_network.h"
#include "vision/kernels/depth_median_reference.h"

#if __has_include(<opencv2/imgproc.hpp>)
#define WASP_TEST_HAS_OPENCV 1
#include <opencv2/imgproc.hpp>
#endif

namespace wasp::vision {
namespace {

using Bits = std::array<std::uint32_t, 25>;  // wire: 32 inputs of zeros and ones at once

template <std::size_t kCount>
void run(const std::array<Comparator, kCount>& list, std::size_t step, std::uint32_t* wire) {
  for (const Comparator c : list) {
    const std::uint32_t low = wire[c.low * step] & wire[c.high * step];
    wire[c.high * step] |= wire[c.low * step];
    wire[c.low * step] = low;
  }
}

TEST(DepthMedianNetwork, SortsEveryInputOfFiveBits) {
  std::uint32_t wire[5];
  for (int i = 0; i < 5; ++i) {
    wire[i] = 0;
    for (std::uint32_t input = 0; input < 32; ++input) wire[i] |= ((input >> i) & 1u) << input;
  }
  run(kSortFive, 1, wire);
  for (int input = 0; input < 32; ++input)
    for (int i = 0; i < 4; ++i) EXPECT_LE((wire[i] >> input) & 1u, (wire[i + 1] >> input) & 1u);
}

/// All 6^5 ways five sorted columns of zeros and ones can look, which by the zero-one principle are all there is.
TEST(DepthMedianNetwork, FindsTheMedianOfEverySortedColumnsInput) {
  for (int code = 0; code < 7776; ++code) {
    Bits wire{};
    int ones = 0, rest = code;
    for (std::size_t column = 0; column < 5; ++column, rest /= 6)
      for (int i = 0; i < rest % 6; ++i, ++ones) wire[static_cast<std::size_t>(4 - i) * 5 + column] = 1;
    run(kOrderNeighbours, 1, wire.data());
    run(kMedianOfSortedColumns, 1, wire.data());
    ASSERT_EQ(wire[kMedianWire], ones >= 13 ? 1u : 0u) << code;
  }
}

/// Two rising runs of n zeros and ones side by side: `ones` of them set at the end of each.
template <std::size_t kWires>
std::array<std::uint32_t, kWires> two_runs(std::size_t ones_a, std::size_t ones_b) {
  std::array<std::uint32_t, kWires> wire{};
  constexpr std::size_t n = kWires / 2;
  for (std::size_t i = 0; i < n; ++i) {
    wire[i] = i + ones_a >= n ? 1 : 0;
    wire[n + i] = i + ones_b >= n ? 1 : 0;
  }
  return wire;
}

TEST(DepthMedianNetwork, MergesEveryPairOfColumns) {
  for (std::size_t a = 0; a <= 5; ++a)
    for (std::size_t b = 0; b <= 5; ++b) {
      auto wire = two_runs<10>(a, b);
      run(kMergeFives, 1, wire.data());
      for (std::size_t k = 0; k < 10; ++k) EXPECT_EQ(wire[kMergedFives[k]], k + a + b >= 10 ? 1u : 0u);
    }
}

TEST(DepthMedianNetwork, FindsTheMiddleOfEveryTwoPairs) {
  for (std::size_t a = 0; a <= 10; ++a)
    for (std::size_t b = 0; b <= 10; ++b) {
      auto wire = two_runs<20>(a, b);
      run(kMiddleOfTens, 1, wire.data());
      for (std::size_t k = 0; k < 6; ++k) EXPECT_EQ(wire[kMiddle[k]], 7 + k + a + b >= 20 ? 1u : 0u);
    }
}

/// Ends exactly where its pixels end, so that a sanitizer sees a read beyond.
struct Depth {
  int width_px, height_px, stride_px;
  std::vector<std::uint16_t> mm;
  [[nodiscard]] DepthView view() const { return {mm.data(), width_px, height_px, stride_px}; }
};

Depth random_depth(int width_px, int height_px, int extra, unsigned levels, std::mt19937& random) {
  Depth d{width_px, height_px, width_px + extra, {}};
  d.mm.resize(static_cast<std::size_t>(d.stride_px * (height_px - 1) + width_px));
  for (auto& x : d.mm) {
    x = static_cast<std::uint16_t>(levels == 0 ? random() : 800 + random() % levels);
    if (random() % 4 == 0) x = random() % 3 == 0 ? 65535 : 0;
  }
  return d;
}

TEST(DepthMedian, DenseEqualsTheReferenceOnEveryTarget) {
  std::mt19937 random(5);
  for (const int width_px : {1, 2, 3, 7, 8, 15, 16, 31, 32, 33, 47, 64, 65, 100, 640, kMaxMedianColumns})
    for (const int height_px : {1, 2, 4, 5, 9})
      for (const unsigned levels : {0u, 3u, 500u}) {
        const Depth d = random_depth(width_px, height_px, height_px % 3, levels, random);
        const int stride = width_px + 3;
        std::vector<std::uint16_t> got(static_cast<std::size_t>(stride * height_px), 7), want = got;
        median_5x5_reference(d.view(), want.data(), stride);
        test::on_every_target([&](const std::string&) {
          std::fill(got.begin(), got.end(), std::uint16_t{7});
          ASSERT_TRUE(median_5x5(d.view(), got.data(), stride));
          ASSERT_EQ(got, want) << width_px << "x" << height_px << " levels " << levels;
        });
      }
}

#ifdef WASP_TEST_HAS_OPENCV
TEST(DepthMedian, DenseEqualsOpenCv) {
  std::mt19937 random(6);
  const Depth d = random_depth(640, 480, 0, 3000, random);
  std::vector<std::uint16_t> got(d.mm.size());
  ASSERT_TRUE(median_5x5(d.view(), got.data(), 640));
  cv::Mat theirs;
  cv::medianBlur(cv::Mat(480, 640, CV_16U, const_cast<std::uint16_t*>(d.mm.data())), theirs, 5);
  EXPECT_TRUE(std::equal(got.begin(), got.end(), theirs.begin<std::uint16_t>()));
}
#endif

std::vector<DepthPixel> random_pixels(const Depth& d, std::size_t n, std::mt19937& random) {
  std::vector<DepthPixel> pixels(n);
  const auto near = [&](int size) {
    return static_cast<std::int16_t>(static_cast<int>(random() % static_cast<unsigned>(size + 4)) - 2);
  };
  for (DepthPixel& p : pixels) p = {near(d.width_px), near(d.height_px)};
  return pixels;
}

TEST(DepthMedian, SampledEqualsTheReferenceAlsoOutsideAndAtTheBorderOnEveryTarget) {
  std::mt19937 random(7);
  for (const auto& [w, h] : {std::pair{640, 480}, {1, 1}, {5, 5}, {4, 9}, {8, 5}, {9, 7}, {33, 6}})
    for (const std::size_t n : {std::size_t{0}, std::size_t{1}, std::size_t{31}, std::size_t{32}, std::size_t{1000}})
      for (const int min_valid : {1, 5, 25}) {
        const Depth d = random_depth(w, h, 2, 900, random);
        const auto pixels = random_pixels(d, n, random);
        std::vector<std::uint16_t> got(n, 7), want = got;
        median_5x5_at_reference(d.view(), pixels, min_valid, want);
        test::on_every_target([&](const std::string&) {
          std::fill(got.begin(), got.end(), std::uint16_t{7});
          ASSERT_TRUE(median_5x5_at(d.view(), pixels, min_valid, got));
          ASSERT_EQ(got, want) << w << "x" << h << " n " << n << " min_valid " << min_valid;
        });
      }
}

TEST(DepthMedian, HolesDoNotPullASample) {
  Depth d{9, 9, 9, std::vector<std::uint16_t>(81, 0)};
  for (int u = 0; u < 9; ++u) d.mm[static_cast<std::size_t>(4 * 9 + u)] = static_cast<std::uint16_t>(2000 + u);
  const std::vector<DepthPixel> middle{{4, 4}};
  std::vector<std::uint16_t> out(1);
  ASSERT_TRUE(median_5x5_at(d.view(), middle, 5, out));
  EXPECT_EQ(out[0], 2004);
  ASSERT_TRUE(median_5x5_at(d.view(), middle, 6, out));
  EXPECT_EQ(out[0], 0);
}

TEST(DepthMedian, RefusesBadArguments) {
  std::vector<std::uint16_t> mm(64, 5), out(64, 9);
  EXPECT_FALSE(median_5x5({}, out.data(), 8));
  EXPECT_FALSE(median_5x5({mm.data(), 8, 8, 7}, out.data(), 8));
  EXPECT_FALSE(median_5x5({mm.data(), 8, 8, 8}, nullptr, 8));
  EXPECT_FALSE(median_5x5({mm.data(), 8, 8, 8}, out.data(), 7));
  EXPECT_FALSE(median_5x5({mm.data(), kMaxMedianColumns + 1, 1, kMaxMedianColumns + 1}, out.data(), 4096));
  EXPECT_TRUE(std::all_of(out.begin(), out.end(), [](int x) { return x == 9; }));
  const std::vector<DepthPixel> pixels(64);
  EXPECT_FALSE(median_5x5_at({}, pixels, 1, out));
  EXPECT_TRUE(std::all_of(out.begin(), out.end(), [](int x) { return x == 0; }));
  EXPECT_FALSE(median_5x5_at({mm.data(), 8, 8, 8}, pixels, 1, std::span(out).first(3)));
}

TEST(DepthMedian, AllocatesNothing) {
  std::mt19937 random(8);
  const Depth d = random_depth(640, 480, 0, 900, random);
  const auto pixels = random_pixels(d, 1000, random);
  std::vector<std::uint16_t> dense(d.mm.size()), sampled(1000);
  const wasp::test::MallocCount count;
  {
    const rt::RealtimeSection section;
    median_5x5(d.view(), dense.data(), 640);
    median_5x5_at(d.view(), pixels, 1, sampled);
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
