#include "sim/exposure.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/optics_scenes.h"

namespace wasp::sim {
namespace {

constexpr int kWidth = 160, kHeight = 64;
constexpr float kFocal_px = 260, kExposure_s = 0.02f, kWall_m = 2;

struct Blurred {
  CastFrame frame;
  int casts = 0;
};

/// The split wall seen by a camera in the body's origin that looks ahead.
Blurred expose(const BodyPose& pose) {
  CameraGeometry geometry;
  geometry.intrinsics = pinhole(kWidth, kHeight, kFocal_px);
  Renderer renderer(split_wall(kWall_m), geometry.lens(), 3);
  Exposure exposure(geometry, kExposure_s, true, renderer);
  Blurred out{renderer.frame()};
  renderer.cast(camera_pose_of(pose, geometry), out.frame);
  renderer.antialias(camera_pose_of(pose, geometry), out.frame);
  out.casts = exposure.apply(renderer, pose, out.frame);
  return out;
}

/// The deviation of a slope spread evenly over `length_px` in this many casts.
double deviation_of(double length_px, int casts) { return length_px * std::sqrt((1 - 1.0 / (casts * casts)) / 12); }

TEST(Exposure, AMovingEdgeSmearsOverSpeedTimesFocalLengthTimesExposureByDepth) {
  for (const float speed_mps : {1.f, 2.f, 4.f}) {
    BodyPose pose;
    pose.velocity_ned_mps = {0, speed_mps, 0};
    const Blurred image = expose(pose);
    const auto smear_px = static_cast<double>(speed_mps * kFocal_px / kWall_m * kExposure_s);
    const EdgeProfile edge = edge_profile(image.frame, kWidth, 32);
    // Each cast knows the edge to a quarter of a pixel.
    EXPECT_NEAR(edge.deviation_px, deviation_of(smear_px, image.casts), 0.15) << speed_mps << " m/s";
    EXPECT_NEAR(edge.at_px, 79.5, 0.15) << "the exposure's middle is the pose";
    EXPECT_GE(image.casts, 3);
  }
}

TEST(Exposure, ATurnSmearsTheSameAtEveryDistance) {
  BodyPose pose;
  pose.rate_body_radps = {0, 0, 1.5f};
  const Blurred image = expose(pose);
  const double smear_px = 1.5 * static_cast<double>(kFocal_px * kExposure_s);
  EXPECT_NEAR(edge_profile(image.frame, kWidth, 32).deviation_px, deviation_of(smear_px, image.casts), 0.15);
}

TEST(Exposure, AtRestOneCastIsEnoughAndDepthIsThatOfTheMiddle) {
  const Blurred still = expose({});
  EXPECT_EQ(still.casts, 1);
  EXPECT_NEAR(edge_profile(still.frame, kWidth, 32).deviation_px, 0, 1e-6);
  BodyPose ahead;
  ahead.velocity_ned_mps = {5, 3, 0};
  const Blurred moving = expose(ahead);
  EXPECT_GT(moving.casts, 1);
  EXPECT_EQ(moving.frame.range, still.frame.range);
}

TEST(Exposure, APoseMovesWithItsVelocityAndRate) {
  BodyPose pose{1000, {1, 2, 3}, quat_from_euler({0, 0, 0.5f}), {2, 0, -1}, {0, 0, 1}};
  const BodyPose later = moved(pose, 0.125f);
  EXPECT_TRUE(later.position_ned_m.isApprox(Vec3(1.25f, 2, 2.875f), 1e-5f));
  EXPECT_NEAR(euler_from_quat(later.q_ned_body).yaw_rad, 0.625f, 1e-5f);
  EXPECT_EQ(later.at_ns, 1000 + 125 * kMillisecond);
  const BodyPose back = moved(later, -0.125f);
  EXPECT_TRUE(back.position_ned_m.isApprox(pose.position_ned_m, 1e-5f));
  EXPECT_LT(back.q_ned_body.angularDistance(pose.q_ned_body), 1e-3f);
}

}  // namespace
}  // namespace wasp::sim
