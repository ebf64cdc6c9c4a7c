#include "vision/kernels/log_polar.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "tests/vision/every_target.h"

namespace wasp::vision {
namespace {

struct Picture {
  int width_px, height_px, stride_px;
  std::vector<std::uint8_t> pixels;
  [[nodiscard]] GrayView view() const { return {pixels.data(), width_px, height_px, stride_px}; }
};

template <class F>
Picture draw(int width_px, int height_px, int stride_px, F f) {
  Picture p{width_px, height_px, stride_px, {}};
  p.pixels.resize(static_cast<std::size_t>(stride_px * (height_px - 1) + width_px));  // ends with the last pixel
  for (int v = 0; v < height_px; ++v)
    for (int u = 0; u < width_px; ++u) p.pixels[static_cast<std::size_t>(v * stride_px + u)] = f(u, v);
  return p;
}

Picture noise(int width_px, int height_px, int stride_px, unsigned seed) {
  std::mt19937 random(seed);
  return draw(width_px, height_px, stride_px, [&](int, int) { return static_cast<std::uint8_t>(random()); });
}

/// Smooth and without symmetry, seen through a turn and a zoom about (320, 240).
Picture smooth(float angle_rad, float scale) {
  return draw(640, 480, 640, [=](int u, int v) {
    const float x = (static_cast<float>(u) - 320.f) / scale, y = (static_cast<float>(v) - 240.f) / scale;
    const float a = std::cos(-angle_rad) * x - std::sin(-angle_rad) * y;
    const float b = std::sin(-angle_rad) * x + std::cos(-angle_rad) * y;
    return static_cast<std::uint8_t>(128.f + 60.f * std::sin(a / 23.f) + 60.f * std::sin(b / 31.f + a / 57.f));
  });
}

double mean_difference(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b, int angles, int radii,
                       int rows, int columns) {
  double sum = 0;
  int n = 0;
  for (int r = 0; r < angles; ++r)
    for (int c = 60; c + columns < radii - 4; ++c, ++n)  // beyond the first columns, which see a few pixels only
      sum += std::abs(a[static_cast<std::size_t>(r * radii + c)] -
                      b[static_cast<std::size_t>((r + rows) % angles * radii + c + columns)]);
  return sum / n;
}

TEST(LogPolar, ExtremesMeetAndInversesInvert) {
  for (const float kappa : {0.f, 0.5f, 1.f}) {
    const auto g =
        log_polar_geometry({.kappa = kappa, .reach = LogPolarReach::kFarthestCorner}, 640, 480, 300.f, 200.f);
    EXPECT_NEAR(g.r_max_px, std::hypot(339.f, 279.f), 1e-3f);
    EXPECT_NEAR(g.rho_of(g.r_max_px), 255.f, 1e-2f);
    EXPECT_NEAR(g.radius_of(255.f), g.r_max_px, 1e-2f);
    EXPECT_NEAR(g.radius_of(0.f), 1.f - kappa, 1e-6f);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> x(0.f, 639.f), y(0.f, 479.f);
    for (int i = 0; i < 1000; ++i) {
      const LogPolarGeometry::ImagePoint p{x(random), y(random)};
      const auto m = g.to_map(p);
      EXPECT_GE(m.phi, 0.f);
      EXPECT_LT(m.phi, 256.f);
      const auto q = g.to_image(m);
      if (std::hypot(p.x_px - 300.f, p.y_px - 200.f) < 1.f) continue;
      EXPECT_NEAR(q.x_px, p.x_px, 0.01f);
      EXPECT_NEAR(q.y_px, p.y_px, 0.01f);
    }
  }
}

TEST(LogPolar, VectorsEqualTheScalarFormToTheBitOnEveryTarget) {
  std::mt19937 random(4);
  for (const auto& [w, h, stride] : {std::tuple{640, 480, 640}, {97, 61, 103}, {16, 16, 16}})
    for (const auto reach : {LogPolarReach::kFarthestCorner, LogPolarReach::kNearestBorder})
      for (const int radii : {8, 33, 256}) {
        const Picture p = noise(w, h, stride, static_cast<unsigned>(random()));
        const LogPolarMap map({.angles = 64, .radii = radii, .reach = reach}, w, h, stride,
                              static_cast<float>(random() % static_cast<unsigned>(w)),
                              static_cast<float>(random() % static_cast<unsigned>(h)));
        std::vector<std::uint8_t> fast(static_cast<std::size_t>(64 * radii), 1), plain(fast.size(), 2);
        ASSERT_TRUE(remap_scalar(map.forward_table(), p.view(), plain.data(), radii));
        test::on_every_target([&](const std::string&) {
          std::fill(fast.begin(), fast.end(), std::uint8_t{1});
          ASSERT_TRUE(map.transform(p.view(), fast.data()));
          EXPECT_EQ(fast, plain) << w << " " << radii;
        });
        const RemapTable::Near& near = map.forward_table().near;
        EXPECT_EQ(near.columns % 32, 0);
        EXPECT_GE(near.columns, radii == 256 ? 128 : 0);  // most columns are near the fovea
      }
}

TEST(LogPolar, EqualsExactBilinearSamplingToOneLevel) {
  const Picture p = smooth(0.3f, 1.f);
  const LogPolarMap map({}, 640, 480, 640, 320.f, 240.f);
  std::vector<std::uint8_t> out(256 * 256);
  ASSERT_TRUE(map.transform(p.view(), out.data()));
  for (int r = 0; r < 256; ++r)
    for (int c = 0; c < map.columns_inside(r); ++c) {
      const auto at = map.geometry().to_image({static_cast<float>(c), static_cast<float>(r)});
      const int u = std::min(static_cast<int>(at.x_px), 638), v = std::min(static_cast<int>(at.y_px), 478);
      const float fx = at.x_px - static_cast<float>(u), fy = at.y_px - static_cast<float>(v);
      const auto px = [&](int i, int j) { return static_cast<float>(p.pixels[static_cast<std::size_t>(j * 640 + i)]); };
      const float exact =
          (1 - fy) * ((1 - fx) * px(u, v) + fx * px(u + 1, v)) + fy * ((1 - fx) * px(u, v + 1) + fx * px(u + 1, v + 1));
      ASSERT_NEAR(out[static_cast<std::size_t>(r * 256 + c)], exact, 1.01f) << r << " " << c;
    }
}

TEST(LogPolar, TurningShiftsRowsAndZoomShiftsColumns) {
  const LogPolarMap map({.kappa = 0.f}, 640, 480, 640, 320.f, 240.f);
  std::vector<std::uint8_t> before(256 * 256), turned(before), grown(before);
  ASSERT_TRUE(map.transform(smooth(0.f, 1.f).view(), before.data()));
  ASSERT_TRUE(map.transform(smooth(10.f * map.geometry().rad_per_row(), 1.f).view(), turned.data()));
  ASSERT_TRUE(map.transform(smooth(0.f, map.geometry().scale_of(7.f)).view(), grown.data()));
  EXPECT_LT(mean_difference(before, turned, 256, 256, 10, 0), 1.0);
  EXPECT_LT(mean_difference(before, grown, 256, 256, 0, 7), 1.0);
  EXPECT_GT(mean_difference(before, turned, 256, 256, 0, 0), 3.0);
}

TEST(LogPolar, ThereAndBackIsTheImageNearTheFovea) {
  const Picture p = smooth(0.f, 1.f);
  LogPolarMap map({.angles = 512, .radii = 256}, 640, 480, 640, 320.f, 240.f);
  std::vector<std::uint8_t> polar(512 * 256), back(640 * 480, 7);
  ASSERT_TRUE(map.transform(p.view(), polar.data()));
  ASSERT_TRUE(map.inverse(polar.data(), back.data(), 640));
  double sum = 0;
  int n = 0;
  for (int v = 180; v < 300; ++v)
    for (int u = 260; u < 380; ++u, ++n)
      sum += std::abs(back[static_cast<std::size_t>(v * 640 + u)] - p.pixels[static_cast<std::size_t>(v * 640 + u)]);
  EXPECT_LT(sum / n, 1.5);
  EXPECT_EQ(back[0], 0);  // beyond the reach
}

TEST(LogPolar, FoveaIsKeptInside) {
  const auto g = log_polar_geometry({}, 640, 480, 5000.f, -3.f);
  EXPECT_EQ(g.fovea_x_px, 638.f);
  EXPECT_EQ(g.fovea_y_px, 1.f);
  EXPECT_EQ(log_polar_geometry({}, 640, 480, std::numeric_limits<float>::quiet_NaN(), 0.f).fovea_x_px, 319.5f);
}

TEST(LogPolar, BadInput) {
  EXPECT_THROW(LogPolarMap({.angles = 2}, 640, 480, 640, 0, 0), std::invalid_argument);
  EXPECT_THROW(LogPolarMap({.radii = 100000}, 640, 480, 640, 0, 0), std::invalid_argument);
  EXPECT_THROW(LogPolarMap({.kappa = 2.f}, 640, 480, 640, 0, 0), std::invalid_argument);
  EXPECT_THROW(LogPolarMap({}, 640, 480, 320, 0, 0), std::invalid_argument);
  EXPECT_THROW(LogPolarMap({}, 1, 480, 640, 0, 0), std::invalid_argument);
  const Picture p = noise(64, 48, 64, 1);
  const LogPolarMap map({}, 64, 48, 64, 32.f, 24.f);
  std::vector<std::uint8_t> out(256 * 256, 9);
  for (const GrayView& bad : {GrayView{}, GrayView{p.pixels.data(), 64, 48, 32}, GrayView{p.pixels.data(), 32, 48, 64},
                              GrayView{p.pixels.data(), 64, 47, 64}})
    EXPECT_FALSE(map.transform(bad, out.data()));
  EXPECT_FALSE(map.transform(p.view(), nullptr));
  EXPECT_FALSE(LogPolarMap().transform(p.view(), out.data()));
  EXPECT_EQ(out[0], 9);
}

TEST(LogPolar, DoesNotAllocate) {
  const Picture p = noise(640, 480, 640, 1);
  LogPolarMap map({}, 640, 480, 640, 320.f, 240.f);
  std::vector<std::uint8_t> out(256 * 256), back(640 * 480);
  map.transform(p.view(), out.data());  // the instruction set is chosen at the first call
  const wasp::test::MallocCount count;
  {
    const rt::RealtimeSection section;
    map.transform(p.view(), out.data());
    map.inverse(out.data(), back.data(), 640);
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
