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

struct Smear {
  double at_px = 0, deviation_px = 0;
  int casts = 0;
};

/// Mean over eight places of the edge between two pixels: one cast alone knows it to a pixel only.
Smear smear_of(BodyPose pose) {
  Smear mean;
  for (int eighth = 0; eighth < 8; ++eighth) {
    const float shift_px = (static_cast<float>(eighth) + 0.5f) / 8 - 0.5f;
    pose.position_ned_m.y() = shift_px * kWall_m / kFocal_px;
    const Blurred image = expose(pose);
    const EdgeProfile edge = edge_profile(image.frame, kWidth, 32);
    mean.at_px += edge.at_px / 8, mean.deviation_px += edge.deviation_px / 8;
    mean.casts = image.casts;
  }
  return mean;
}

TEST(Exposure, AMovingEdgeSmearsOverSpeedTimesFocalLengthTimesExposureByDepth) {
  for (const float speed_mps : {1.f, 2.f, 4.f, 6.f}) {
    BodyPose pose;
    pose.velocity_ned_mps = {0, speed_mps, 0};
    const Smear smear = smear_of(pose);
    const auto length_px = static_cast<double>(speed_mps * kFocal_px / kWall_m * kExposure_s);
    EXPECT_NEAR(smear.deviation_px, deviation_of(length_px, smear.casts), 0.15) << speed_mps << " m/s";
    EXPECT_NEAR(smear.at_px, 79.5, 0.1) << "the exposure's middle is the pose";
    EXPECT_GE(smear.casts, 3);
  }
}

TEST(Exposure, ATurnSmearsTheSameAtEveryDistance) {
  BodyPose pose;
  pose.rate_body_radps = {0, 0, 1.5f};
  const Smear smear = smear_of(pose);
  const double length_px = 1.5 * static_cast<double>(kFocal_px * kExposure_s);
  EXPECT_NEAR(smear.deviation_px, deviation_of(length_px, smear.casts), 0.15);
}

TEST(Exposure, FasterMotionTakesMoreCastsUpToFive) {
  int before = 0;
  for (const float speed_mps : {0.05f, 1.f, 2.f, 6.f}) {
    BodyPose pose;
    pose.velocity_ned_mps = {0, speed_mps, 0};
    const int casts = expose(pose).casts;
    EXPECT_GE(casts, before);
    before = casts;
  }
  EXPECT_EQ(before, Exposure::kMostCasts);
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
