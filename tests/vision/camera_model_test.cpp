#include "vision/kernels/camera_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace wasp::vision {
namespace {

Intrinsics wide_lens() {
  Intrinsics k;
  k.k1 = -0.25f, k.k2 = 0.08f, k.p1 = 0.0007f, k.p2 = -0.0004f, k.k3 = -0.01f;
  return k;
}

TEST(CameraModel, ProjectsThePrincipalRayToThePrincipalPoint) {
  const Pixel p = project(wide_lens(), {0.f, 0.f});
  EXPECT_FLOAT_EQ(p.u_px, 319.5f);
  EXPECT_FLOAT_EQ(p.v_px, 239.5f);
}

TEST(CameraModel, DistortionMatchesTheEquationWorkedByHand) {
  Intrinsics k;
  k.k1 = 0.1f, k.p1 = 0.01f;
  // r2 = 0.13; radial 1.013; x: 0.2 * 1.013 + 2 * 0.01 * 0.06; y: 0.3 * 1.013 + 0.01 * (0.13 + 0.18)
  const Ray r = distort(k, {0.2f, 0.3f});
  EXPECT_NEAR(r.x, 0.2038f, 1e-6f);
  EXPECT_NEAR(r.y, 0.3070f, 1e-6f);
}

TEST(CameraModel, UnprojectInvertsProjectOverTheImage) {
  const Intrinsics k = wide_lens();
  for (int v = 0; v < 480; v += 20)
    for (int u = 0; u < 640; u += 20) {
      Ray ray;
      ASSERT_TRUE(unproject(k, {static_cast<float>(u), static_cast<float>(v)}, ray)) << u << ' ' << v;
      const Pixel back = project(k, ray);
      EXPECT_NEAR(back.u_px, static_cast<float>(u), 2e-3f);
      EXPECT_NEAR(back.v_px, static_cast<float>(v), 2e-3f);
    }
}

TEST(CameraModel, SaysSoWhereTheLensHasNoInverse) {
  Intrinsics k;
  k.k1 = -1.f;  // x (1 - r2) folds back at r = 0.577, where it reaches 0.385
  Ray ray;
  EXPECT_FALSE(undistort(k, {0.5f, 0.f}, ray));
  EXPECT_TRUE(undistort(k, {0.3f, 0.f}, ray));
}

TEST(CameraModel, RefusesIntrinsicsThatMakeNoSense) {
  Intrinsics k;
  EXPECT_TRUE(usable(k));
  k.fx_px = 0.f;
  EXPECT_FALSE(usable(k));
  k.fx_px = std::nanf("");
  EXPECT_FALSE(usable(k));
  k = {};
  k.width_px = 0;
  EXPECT_FALSE(usable(k));
}

TEST(CameraModel, HorizonOfALevelCameraIsThePrincipalRowAndMovesWithPitch) {
  CameraGeometry geometry;
  const HorizonRow level = horizon_row(geometry.intrinsics, up_in_camera(geometry, {1.f, 0.f, 0.f, 0.f}));
  ASSERT_TRUE(level.valid);
  EXPECT_NEAR(level.v_px, 239.5f, 1e-3f);
  const Quat nose_up = quat_from_euler({.pitch_rad = 0.1f});  // horizon sinks in the image
  const HorizonRow up =
      horizon_row(geometry.intrinsics, up_in_camera(geometry, {nose_up.w(), nose_up.x(), nose_up.y(), nose_up.z()}));
  EXPECT_NEAR(up.v_px, 239.5f + 525.f * std::tan(0.1f), 1e-2f);
  geometry.R_body_cam = R_body_cam_from_pitch_down(Radians{1.5708});
  EXPECT_FALSE(horizon_row(geometry.intrinsics, up_in_camera(geometry, {1.f, 0.f, 0.f, 0.f})).valid);
}

TEST(CameraModel, AWorthlessQuaternionCountsAsLevel) {
  const CameraGeometry geometry;
  for (const std::array<float, 4> q : {std::array{0.f, 0.f, 0.f, 0.f}, std::array{std::nanf(""), 0.f, 0.f, 0.f}}) {
    EXPECT_FALSE(attitude_usable(q));
    EXPECT_NEAR(up_in_camera(geometry, q).y(), -1.f, 1e-6f);
  }
}

}  // namespace
}  // namespace wasp::vision
