#include "sim/camera_rays.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/optics_scenes.h"
#include "types/units.h"

namespace wasp::sim {
namespace {

Lens fisheye(std::array<float, 4> k = {}) { return {LensKind::kFisheye, pinhole(320, 240, 80), k}; }

float radians(double degrees) { return static_cast<float>(to_radians(Degrees{degrees}).value); }

TEST(CameraRays, AnEquidistantFisheyesAngleIsTheImageRadius) {
  const CameraRays rays(fisheye(), radians(180));
  for (const auto& [u, v] : {std::pair{160, 120}, {200, 100}, {60, 119}, {159, 0}, {230, 60}}) {
    const Vec3 d = rays.direction(u, v);
    const double x = u - 159.5, y = v - 119.5, radius = std::hypot(x, y);
    EXPECT_NEAR(d.norm(), 1, 1e-5);
    EXPECT_NEAR(std::acos(static_cast<double>(d.z())), radius / 80, 1e-3) << u << ", " << v;
    EXPECT_NEAR(std::atan2(static_cast<double>(d.y()), static_cast<double>(d.x())), std::atan2(y, x), 1e-4);
  }
}

TEST(CameraRays, KannalaAndBrandtsPolynomialTakesTheAngleBackToThePixel) {
  const std::array<float, 4> k{-0.02f, 0.004f, -0.001f, 0.0001f};
  const CameraRays rays(fisheye(k), radians(170));
  int seen = 0;
  for (int v = 0; v < 240; v += 17)
    for (int u = 0; u < 320; u += 13) {
      if (!rays.seen(u, v)) continue;
      ++seen;
      const Vec3 d = rays.direction(u, v);
      const double theta = std::acos(static_cast<double>(d.z())), t2 = theta * theta;
      const double r = theta * (1 + t2 * (-0.02 + t2 * (0.004 + t2 * (-0.001 + t2 * 0.0001))));
      EXPECT_NEAR(80 * r, std::hypot(u - 159.5, v - 119.5), 0.02) << u << ", " << v;
    }
  EXPECT_GT(seen, 100);
}

TEST(CameraRays, NothingIsSeenBeyondTheImageCircle) {
  for (const double degrees : {160.0, 170.0, 180.0}) {
    const CameraRays rays(fisheye(), radians(degrees));
    const double circle_px = 80 * static_cast<double>(radians(degrees)) / 2;
    for (int v = 0; v < 240; ++v)
      for (int u = 0; u < 320; ++u) {
        const double radius = std::hypot(u - 159.5, v - 119.5);
        if (std::abs(radius - circle_px) < 0.01) continue;
        ASSERT_EQ(rays.seen(u, v), radius < circle_px) << degrees << " degrees: " << u << ", " << v;
      }
  }
}

TEST(CameraRays, APinholesDirectionsHaveUnitLengthAlongTheAxis) {
  const CameraRays rays({LensKind::kPinhole, pinhole(320, 240, 260), {}}, radians(180));
  const Vec3 d = rays.direction(10, 200);
  EXPECT_FLOAT_EQ(d.z(), 1);
  EXPECT_NEAR(d.x(), (10 - 159.5) / 260, 1e-5);
  EXPECT_NEAR(d.y(), (200 - 119.5) / 260, 1e-5);
  EXPECT_FLOAT_EQ(rays.axis(10, 200), 1);
  EXPECT_NEAR(rays.packet(50, 2).du.x(), 1.0 / 260, 1e-6);
  EXPECT_NEAR(rays.packet(50, 2).dv.y(), 1.0 / 260, 1e-6);
}

TEST(CameraRays, RefusesSizesAndFocalLengthsItCannotUse) {
  EXPECT_THROW(CameraRays({LensKind::kPinhole, pinhole(322, 240, 260), {}}, 3), std::runtime_error);
  EXPECT_THROW(CameraRays({LensKind::kFisheye, pinhole(320, 0, 260), {}}, 3), std::runtime_error);
  EXPECT_THROW(CameraRays({LensKind::kPinhole, pinhole(320, 240, 0), {}}, 3), std::runtime_error);
}

TEST(FisheyeImage, ATargetStandsWhereTheModelPutsIt) {
  World world = glowing_world();
  constexpr float kAngle = 1.2f;  // 69 degrees to the right, farther out than a pinhole of this size sees
  add_board(world, {2 * std::cos(kAngle), 2 * std::sin(kAngle), 0}, 0.2f, 0.2f, 200);
  Renderer renderer(std::make_shared<const WorldScene>(std::move(world)), fisheye(), radians(180));
  CastFrame frame = renderer.frame();
  renderer.cast(northward(), frame);
  double sum = 0, u_sum = 0, v_sum = 0;
  for (int v = 0; v < 240; ++v)
    for (int u = 0; u < 320; ++u) {
      const auto light = static_cast<double>(frame.luminance[static_cast<std::size_t>(v * 320 + u)]);
      sum += light, u_sum += light * u, v_sum += light * v;
    }
  ASSERT_GT(sum, 0);
  EXPECT_NEAR(u_sum / sum, 159.5 + 80 * 1.2, 0.5);
  EXPECT_NEAR(v_sum / sum, 119.5, 0.1);
}

TEST(FisheyeImage, DepthIsAlongTheAxisAndZeroBehindTheLensAndBeyondItsField) {
  World world = glowing_world();
  add_board(world, {1.5f, 0, 0}, 900, 900, 100);
  add_board(world, {-1.5f, 0, 0}, 900, 900, 60);  // behind the camera
  Renderer renderer(std::make_shared<const WorldScene>(std::move(world)), fisheye(), radians(200));
  std::vector<float> luminance(320 * 4), depth(luminance.size());
  for (const int row : {0, 60, 120}) {
    renderer.render_band(northward(), row, luminance.data(), depth.data());
    for (int u = 0; u < 320; ++u) {
      const double theta = std::hypot(u - 159.5, row - 119.5) / 80;
      const auto i = static_cast<std::size_t>(u);
      if (theta < 1.5) {
        EXPECT_NEAR(depth[i], 1.5, 2e-3) << u << ", " << row;
      } else if (theta > 1.58) {
        EXPECT_LE(depth[i], 0.f) << u << ", " << row;
      }
      if (theta > 1.76) {
        EXPECT_EQ(luminance[i], 0.f) << "black beyond 200 degrees";
      } else if (theta > 1.6 && theta < 1.73) {
        EXPECT_FLOAT_EQ(luminance[i], 60) << "it sees behind itself";
      }
    }
  }
}

}  // namespace
}  // namespace wasp::sim
