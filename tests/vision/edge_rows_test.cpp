#include "vision/kernels/edge_rows_reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"

#if __has_include(<opencv2/imgproc.hpp>)
#define WASP_TEST_HAS_OPENCV 1
#include <opencv2/imgproc.hpp>
#endif

namespace wasp::vision {
namespace {

struct Picture {
  int width_px, height_px, stride_px;
  std::vector<std::uint8_t> pixels;
  [[nodiscard]] GrayView view() const { return {pixels.data(), width_px, height_px, stride_px}; }
  [[nodiscard]] int at(int u, int v) const { return pixels[static_cast<std::size_t>(v * stride_px + u)]; }
};

Picture noise(int width_px, int height_px, unsigned seed) {
  std::mt19937 random(seed);
  Picture p{width_px, height_px, width_px + 5, {}};
  p.pixels.resize(static_cast<std::size_t>(p.stride_px * height_px));
  for (auto& x : p.pixels) x = static_cast<std::uint8_t>(random());
  return p;
}

struct Gradient {
  int u, v;
};

Gradient plain_sobel(const Picture& p, int u, int v) {
  return {p.at(u + 1, v - 1) + 2 * p.at(u + 1, v) + p.at(u + 1, v + 1) - p.at(u - 1, v - 1) - 2 * p.at(u - 1, v) -
              p.at(u - 1, v + 1),
          p.at(u - 1, v + 1) + 2 * p.at(u, v + 1) + p.at(u + 1, v + 1) - p.at(u - 1, v - 1) - 2 * p.at(u, v - 1) -
              p.at(u + 1, v - 1)};
}

/// (7.32)-(7.34) written down as they stand.
void expect_matches_plain_form(const EdgeRowsParams& params, const Picture& p) {
  double squares = 0;
  for (int v = 1; v < p.height_px - 1; ++v)
    for (int u = 1; u < p.width_px - 1; ++u) {
      const Gradient g = plain_sobel(p, u, v);
      squares += g.v * g.v + (params.kind == EdgeKind::kAnyDirection ? g.u * g.u : 0);
    }
  const double rms = std::sqrt(squares / ((p.width_px - 2.0) * (p.height_px - 2.0)));
  auto rows = std::make_unique<EdgeRows>();
  count_edge_rows(params, p.view(), {}, *rows);
  ASSERT_TRUE(rows->valid);
  EXPECT_NEAR(rows->gradient_rms, rms, 1e-3 * rms + 1e-6);
  const double least = std::max(rms, static_cast<double>(params.min_threshold));
  for (int v = 1; v < p.height_px - 1; ++v) {
    int count = 0;
    for (int u = 1; u < p.width_px - 1; ++u) {
      const Gradient g = plain_sobel(p, u, v);
      const bool edge = params.kind == EdgeKind::kBrighterBelow ? g.v >= least
                        : params.kind == EdgeKind::kHorizontal
                            ? std::abs(g.v) >= least
                            : g.u * g.u + g.v * g.v >= rows->threshold * rows->threshold;
      count += edge ? 1 : 0;
    }
    EXPECT_EQ(rows->count[static_cast<std::size_t>(v)], count) << "row " << v;
  }
  EXPECT_EQ(rows->count[0], 0);
}

TEST(EdgeRows, EqualsThePlainFormForEveryKindAndOddSizes) {
  for (const EdgeKind kind : {EdgeKind::kBrighterBelow, EdgeKind::kHorizontal, EdgeKind::kAnyDirection})
    for (const auto& [w, h] : {std::pair{640, 480}, {61, 33}, {3, 3}, {17, 4}}) {
      SCOPED_TRACE(testing::Message() << static_cast<int>(kind) << " " << w << "x" << h);
      expect_matches_plain_form({.kind = kind}, noise(w, h, 5));
    }
}

#ifdef WASP_TEST_HAS_OPENCV
TEST(EdgeRows, EqualsOpenCvsSobel) {
  const Picture p = noise(320, 240, 9);
  const cv::Mat image(240, 320, CV_8U, const_cast<std::uint8_t*>(p.pixels.data()),
                      static_cast<std::size_t>(p.stride_px));
  cv::Mat g;
  cv::Sobel(image, g, CV_16S, 0, 1);
  auto rows = std::make_unique<EdgeRows>();
  count_edge_rows({}, p.view(), {}, *rows);
  for (int v = 1; v < 239; ++v) {
    int count = 0;
    for (int u = 1; u < 319; ++u) count += std::abs(g.at<std::int16_t>(v, u)) >= rows->threshold ? 1 : 0;
    EXPECT_EQ(rows->count[static_cast<std::size_t>(v)], count);
  }
}
#endif

TEST(EdgeRows, SignMattersOnlyWhereItShould) {
  Picture p{64, 64, 64, std::vector<std::uint8_t>(64 * 64, 200)};
  std::fill(p.pixels.begin() + 32 * 64, p.pixels.end(), std::uint8_t{50});  // darker below row 31
  auto rows = std::make_unique<EdgeRows>();
  count_edge_rows({.kind = EdgeKind::kHorizontal}, p.view(), {}, *rows);
  EXPECT_EQ(rows->total, 2 * 62);
  EXPECT_EQ(rows->count[31], 62);
  EXPECT_EQ(rows->count[32], 62);
  count_edge_rows({.kind = EdgeKind::kBrighterBelow}, p.view(), {}, *rows);
  EXPECT_EQ(rows->total, 0);
}

TEST(EdgeRows, MasksFarEdgesAndKeepsThoseOfUnknownDepth) {
  Picture p{64, 64, 64, std::vector<std::uint8_t>(64 * 64, 200)};
  std::fill(p.pixels.begin() + 32 * 64, p.pixels.end(), std::uint8_t{50});
  std::vector<std::uint16_t> depth(64 * 64, 1000);
  for (std::size_t v = 0; v < 64; ++v)
    for (std::size_t u = 0; u < 64; ++u)
      if (u >= 40) depth[v * 64 + u] = u >= 50 ? 0 : 4000;
  auto rows = std::make_unique<EdgeRows>();
  count_edge_rows({.mask_beyond_m = 3.f}, p.view(), {depth.data(), 64, 64, 64}, *rows);
  EXPECT_EQ(rows->count[31], 62 - 10);
}

TEST(EdgeRows, MasksEdgesOfUnknownDepthWhereAsked) {
  Picture p{64, 64, 64, std::vector<std::uint8_t>(64 * 64, 200)};
  std::fill(p.pixels.begin() + 32 * 64, p.pixels.end(), std::uint8_t{50});
  std::vector<std::uint16_t> depth(64 * 64, 2999);
  for (std::size_t v = 0; v < 64; ++v)
    for (std::size_t u = 0; u < 64; ++u)
      if (u >= 40) depth[v * 64 + u] = u >= 60 ? 65535 : u >= 50 ? 0 : 3000;
  auto rows = std::make_unique<EdgeRows>();
  count_edge_rows({.mask_beyond_m = 3.f, .mask_unknown = true}, p.view(), {depth.data(), 64, 64, 64}, *rows);
  EXPECT_EQ(rows->count[31], 39);
  count_edge_rows({.mask_beyond_m = 3.f}, p.view(), {depth.data(), 64, 64, 64}, *rows);
  EXPECT_EQ(rows->count[31], 39 + 13);
}

TEST(EdgeRows, AFixedThresholdStandsInForTheRms) {
  const Picture p = noise(64, 64, 3);
  auto rows = std::make_unique<EdgeRows>();
  count_edge_rows({.fixed_threshold = 600}, p.view(), {}, *rows);
  EXPECT_EQ(rows->threshold, 600);
  int count = 0;
  for (int u = 1; u < 63; ++u) count += std::abs(plain_sobel(p, u, 20).v) >= 600 ? 1 : 0;
  EXPECT_EQ(rows->count[20], count);
  EXPECT_GT(count, 0);
}

void expect_same(const EdgeRowsParams& params, const GrayView& image, const DepthView& depth) {
  auto simd = std::make_unique<EdgeRows>(), plain = std::make_unique<EdgeRows>();
  count_edge_rows(params, image, depth, *simd);
  count_edge_rows_reference(params, image, depth, *plain);
  EXPECT_EQ(simd->valid, plain->valid);
  EXPECT_EQ(simd->threshold, plain->threshold);
  EXPECT_EQ(simd->gradient_rms, plain->gradient_rms);
  EXPECT_EQ(simd->total, plain->total);
  EXPECT_EQ(simd->count, plain->count);
}

/// Pixels of few levels make gradients that meet the threshold exactly; the last byte of the image ends its buffer.
Picture tight_picture(int width_px, int height_px, unsigned levels, std::mt19937& random) {
  Picture p{width_px, height_px, width_px, {}};
  p.pixels.resize(static_cast<std::size_t>(width_px * height_px));
  p.pixels.shrink_to_fit();
  for (auto& x : p.pixels) x = static_cast<std::uint8_t>(levels < 2 ? 255 : random() % levels * (255 / (levels - 1)));
  return p;
}

TEST(EdgeRows, SimdEqualsTheReferenceToTheLastBit) {
  std::mt19937 random(11);
  constexpr int kWidths[] = {3, 4, 17, 18, 33, 34, 65, 66, 67, 68, 97, 130, 131, 640, 641, 1277, kMaxEdgeColumns};
  for (const int width_px : kWidths)
    for (const unsigned levels : {1u, 2u, 3u, 52u, 256u}) {
      const int height_px = 3 + static_cast<int>(random() % 9);
      const Picture p = tight_picture(width_px, height_px, levels, random);
      std::vector<std::uint16_t> mm(p.pixels.size());
      for (auto& x : mm) x = static_cast<std::uint16_t>(random() % 4 == 0 ? (random() & 1) * 65535 : random() % 5000);
      for (const EdgeKind kind : {EdgeKind::kBrighterBelow, EdgeKind::kHorizontal, EdgeKind::kAnyDirection})
        for (const float mask_m : {0.f, 0.0011f, 2.5f, 64.999f})
          for (const bool unknown : {false, true}) {
            SCOPED_TRACE(testing::Message() << width_px << "x" << height_px << " levels " << levels << " kind "
                                            << static_cast<int>(kind) << " mask " << mask_m << unknown);
            expect_same({.kind = kind, .mask_beyond_m = mask_m, .mask_unknown = unknown}, p.view(),
                        {mm.data(), width_px, height_px, width_px});
          }
    }
}

TEST(EdgeRows, WidestGradientsDoNotOverflow) {
  for (const int period : {1, 2, 3, 4}) {
    Picture p{kMaxEdgeColumns, 40, kMaxEdgeColumns, {}};
    for (int v = 0; v < 40; ++v) p.pixels.insert(p.pixels.end(), kMaxEdgeColumns, (v / period) % 2 != 0 ? 255 : 0);
    for (const EdgeKind kind : {EdgeKind::kBrighterBelow, EdgeKind::kHorizontal, EdgeKind::kAnyDirection})
      expect_same({.kind = kind}, p.view(), {});
  }
}

TEST(EdgeRows, AllocatesNothing) {
  const Picture p = noise(640, 480, 3);
  auto rows = std::make_unique<EdgeRows>();
  const test::MallocCount count;
  {
    rt::RealtimeSection section;
    count_edge_rows({}, p.view(), {}, *rows);
  }
  EXPECT_EQ(count.violations(), 0u);
}

TEST(EdgeRows, BlankAndBadImages) {
  auto rows = std::make_unique<EdgeRows>();
  const Picture blank{64, 64, 64, std::vector<std::uint8_t>(64 * 64, 90)};
  count_edge_rows({}, blank.view(), {}, *rows);
  EXPECT_TRUE(rows->valid);
  EXPECT_EQ(rows->total, 0);
  for (const GrayView& bad :
       {GrayView{}, GrayView{blank.pixels.data(), 64, 64, 32}, GrayView{blank.pixels.data(), 2, 2, 64},
        GrayView{blank.pixels.data(), kMaxEdgeColumns + 1, 4, kMaxEdgeColumns + 1}}) {
    count_edge_rows({}, bad, {}, *rows);
    EXPECT_FALSE(rows->valid);
  }
}

}  // namespace
}  // namespace wasp::vision
