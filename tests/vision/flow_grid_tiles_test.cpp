// The tile loops of flow_grid and its pyramid against their plain forms, on every instruction set this machine has.
#include "vision/kernels/flow_grid_tiles.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "vision/kernels/flow_grid_centre.h"
#include "vision/kernels/flow_pyramid.h"

namespace wasp::vision {
namespace {

constexpr int kWidth = 96, kHeight = 80, kStride = 100;

struct Noise {
  std::mt19937 random;
  std::vector<std::uint8_t> pixels;
  explicit Noise(unsigned seed) : random(seed), pixels(static_cast<std::size_t>(kStride * kHeight - kStride + kWidth)) {
    const bool extreme = seed % 5 == 0;
    for (auto& x : pixels) x = static_cast<std::uint8_t>(extreme ? (random() & 1) * 255 : random() & 0xFF);
  }
  [[nodiscard]] GrayView view() const { return {pixels.data(), kWidth, kHeight, kStride}; }
  int below(int bound) { return static_cast<int>(random() % static_cast<unsigned>(bound)); }
};

/// Runs the body once for every instruction set that was compiled in and that the machine has.
void on_all_targets(const std::function<void()>& body) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    SCOPED_TRACE(hwy::TargetName(target));
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(target);
    body();
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().DeInit();
}

void expect_plain_cut(const GrayView& image, const BlockSite& site, const TileBlock& block) {
  TileBlock plain;
  for (int tile = 0; tile < block.tiles; ++tile) {
    const auto t = static_cast<std::size_t>(tile);
    const int u = static_cast<int>(block.corner_u[t]), v = static_cast<int>(block.corner_v[t]);
    cut_tile_plain(image.row(v) + u, image.stride_px, tile, plain);
    EXPECT_FLOAT_EQ(block.hxx[t], plain.hxx[t]);
    EXPECT_NEAR(block.hxy[t], plain.hxy[t], 1e-6f * (plain.hxx[t] + plain.hyy[t]));
    EXPECT_FLOAT_EQ(block.hyy[t], plain.hyy[t]);
    EXPECT_NEAR(block.x_px[t], plain.x_px[t] + block.corner_u[t] - site.centre_u, 1e-4f);
    EXPECT_NEAR(block.y_px[t], plain.y_px[t] + block.corner_v[t] - site.centre_v, 1e-4f);
  }
  EXPECT_FLOAT_EQ(block.gray_sum, plain.gray_sum);
  EXPECT_FLOAT_EQ(block.gray_squares, plain.gray_squares);
}

void expect_plain_errors(const GrayView& first, const GrayView& second, const TileBlock& block,
                         const CellMotion& shift) {
  BlockErrors errors;
  BlockSums sums;
  compare_block(block, second, shift, errors, sums);
  TileBlock plain;
  for (int tile = 0; tile < block.tiles; ++tile) {
    const auto t = static_cast<std::size_t>(tile);
    const float u = block.corner_u[t] + shift.u_px, v = block.corner_v[t] + shift.v_px;
    const bool inside =
        u >= 0 && v >= 0 && u < static_cast<float>(kWidth - kTilePx) && v < static_cast<float>(kHeight - kTilePx);
    ASSERT_EQ(errors.inside[t], inside ? 1.f : 0.f);
    if (!inside) continue;
    const int u0 = static_cast<int>(u), v0 = static_cast<int>(v);
    cut_tile_plain(first.row(static_cast<int>(block.corner_v[t])) + static_cast<int>(block.corner_u[t]),
                   first.stride_px, tile, plain);
    const TileErrors expected =
        compare_tile_plain(plain, tile, second.row(v0) + u0, second.stride_px,
                           static_cast<int>((u - static_cast<float>(u0)) * 128.f + 0.5f),
                           std::min(static_cast<int>((v - static_cast<float>(v0)) * 32768.f), 32767));
    const float scale = 1e-6f * std::sqrt(expected.squares * (plain.hxx[t] + plain.hyy[t])) + 0.01f;
    EXPECT_NEAR(errors.bx[t], expected.bx, scale);
    EXPECT_NEAR(errors.by[t], expected.by, scale);
    EXPECT_NEAR(errors.squares[t], expected.squares, 1e-6f * expected.squares);
  }
}

TEST(FlowGridTiles, EqualTheirPlainForm) {
  on_all_targets([] {
    for (unsigned seed = 0; seed < 40; ++seed) {
      Noise first(seed), second(seed + 100);
      const int across = 3 + static_cast<int>(seed % 2), size = across * kTilePx;
      const int u = 1 + first.below(kWidth - size - 1), v = 1 + first.below(kHeight - size - 1);
      const BlockSite site{.u_px = u, .v_px = v, .centre_u = 20.5f, .centre_v = 31.f, .across = across};
      TileBlock block;
      cut_block(first.view(), site, block);
      ASSERT_EQ(block.tiles, across == 4 ? 12 : 9);
      expect_plain_cut(first.view(), site, block);
      const CellMotion shift{static_cast<float>(first.below(40000)) / 1000.f - 20.f,
                             static_cast<float>(first.below(40000)) / 1000.f - 20.f};
      expect_plain_errors(first.view(), second.view(), block, shift);
    }
  });
}

/// Corner blocks and shifts to the very border: the last bytes of the image and no more are read (sanitizers).
TEST(FlowGridTiles, StayInsideTheImage) {
  on_all_targets([] {
    const Noise first(7), second(8);
    for (const int u : {1, kWidth - 33})
      for (const int v : {1, kHeight - 33}) {
        TileBlock block;
        cut_block(first.view(), {.u_px = u, .v_px = v, .centre_u = 30, .centre_v = 30}, block);
        for (const float du : {0.f, -0.99f, 0.99f, 200.f, -200.f, NAN, 1e30f})
          for (const float dv : {0.f, -0.99f, 0.99f, 200.f, -200.f, NAN, -1e30f})
            expect_plain_errors(first.view(), second.view(), block, {du, dv});
      }
  });
}

TEST(FlowGridCentre, EqualsItsPlainFormAndStaysInside) {
  on_all_targets([] {
    for (unsigned seed = 0; seed < 40; ++seed) {
      Noise first(seed), second(seed + 100);
      CentrePatch patch{nullptr, nullptr, kStride, kStride, first.below(129), first.below(32768)};
      patch.still = first.view().row(first.below(kHeight - kCentreHeightPx)) + first.below(kWidth - kCentreWidthPx);
      patch.moved = second.view().row(second.below(kHeight - kCentreHeightPx)) + second.below(kWidth - kCentreWidthPx);
      EXPECT_EQ(centre_sum(patch), centre_sum_plain(patch));
      EXPECT_FLOAT_EQ(centre_cost(first.view(), first.view(), 10, 20, 0, 0), 0.f);
      EXPECT_FLOAT_EQ(centre_cost(first.view(), first.view(), 0, 0, -0.1f, 0), kCentreMostGray);
      EXPECT_FLOAT_EQ(centre_cost(first.view(), first.view(), 0, 0, NAN, 0), kCentreMostGray);
      EXPECT_LE(centre_cost(first.view(), second.view(), 0, 0, kWidth - kCentreWidthPx - 0.01f,
                            kHeight - kCentreHeightPx - 0.01f),
                kCentreMostGray);
    }
  });
}

TEST(FlowPyramid, HalvesAsThePlainFilterDoes) {
  const auto average = [](int a, int b) { return (a + b + 1) / 2; };
  const auto blend = [&](int a, int b, int c, int d) {
    return average(average(average(a, d), average(b, c)), average(b, c));
  };
  for (const auto& [width, height] : {std::pair{75, 61}, {300, 70}, {256, 64}, {131, 60}}) {
    SCOPED_TRACE(testing::Message() << width << "x" << height);
    std::mt19937 random(3);
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width * height));
    for (auto& x : pixels) x = static_cast<std::uint8_t>(random());
    const GrayView image{pixels.data(), width, height, width};
    on_all_targets([&, w = width, h = height] {
      FlowPyramid pyramid(w, h, 2);
      ASSERT_EQ(pyramid.levels(), 2);
      ASSERT_TRUE(pyramid.build(image));
      const auto column = [&](int u, int v) {
        const auto at = [&](int row) { return image.row(std::clamp(row, 0, h - 1))[std::clamp(u, 0, w - 1)]; };
        return blend(at(2 * v - 1), at(2 * v), at(2 * v + 1), at(2 * v + 2));
      };
      for (int v = 0; v < h / 2; ++v)
        for (int u = 0; u < w / 2; ++u)
          ASSERT_EQ(pyramid.level(1).row(v)[u],
                    blend(column(2 * u - 1, v), column(2 * u, v), column(2 * u + 1, v), column(2 * u + 2, v)))
              << u << " " << v;
    });
  }
}

}  // namespace
}  // namespace wasp::vision
