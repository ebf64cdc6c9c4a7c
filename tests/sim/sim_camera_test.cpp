#include "sim/sim_camera.h"

#include <gtest/gtest.h>

#include "sim/scene.h"

namespace wasp::sim {
namespace {

TEST(SimCamera, TheCameraSitsWhereTheGeometrySays) {
  SimCamera camera{SimConfig{}};
  const CameraPose pose = camera.camera_pose({0, {1, 2, -3}, quat_from_euler({0, 0, 1.5707963f})});
  EXPECT_TRUE(pose.position_ned_m.isApprox(Vec3(1, 2.05f, -3), 1e-5f)) << "5 cm ahead, heading east";
  const Vec3 axis = pose.R_ned_cam * Vec3::UnitZ();
  EXPECT_NEAR(axis.z(), 0.5f, 1e-5f) << "30 degrees down";
  EXPECT_GT(axis.y(), 0.8f);
}

TEST(SimCamera, FramesAreDeterministicAndStandingDepthIsThere) {
  SimCamera camera{SimConfig{}};
  const BodyPose standing{0, {0, 0, -0.2f}, Quat::Identity()};
  std::vector<std::uint8_t> gray(640 * 480), gray_again(640 * 480);
  std::vector<std::uint16_t> depth(640 * 480), depth_again(640 * 480);
  camera.render(standing, 4, gray.data(), depth.data());
  camera.render(standing, 5, gray_again.data(), depth_again.data());
  EXPECT_NE(gray, gray_again);
  camera.render(standing, 4, gray_again.data(), depth_again.data());
  EXPECT_EQ(gray, gray_again);
  EXPECT_EQ(depth, depth_again);
  // Standing, the centre ray meets the floor at 0.2 / sin 30 degrees = 0.4 m; the upper half of the image is in range.
  int valid = 0;
  for (int v = 0; v < 200; ++v)
    for (int u = 0; u < 640; ++u) valid += depth[static_cast<std::size_t>(v * 640 + u)] != 0;
  EXPECT_GT(valid, 0.9 * 200 * 640);
}

TEST(SimCamera, SaysOnceThatAFrameIsAlmostDoneWhenOnlyTheLastRowsAreMissing) {
  SimCamera camera{SimConfig{}};
  std::vector<std::uint8_t> gray(640 * 480, 0);
  std::vector<std::uint16_t> depth(640 * 480, 0);
  int calls = 0;
  std::size_t first_missing = 0;
  camera.render({0, {0, 0, -0.2f}, Quat::Identity()}, 4, gray.data(), depth.data(), [&] {
    ++calls;
    first_missing = gray.size();
    while (first_missing > 0 && gray[first_missing - 1] == 0) --first_missing;
  });
  EXPECT_EQ(calls, 1);
  EXPECT_LE(first_missing, static_cast<std::size_t>(640 * (480 - SimCamera::kLastRows)));
  EXPECT_GT(first_missing, static_cast<std::size_t>(640 * 400));
}

CameraSetup everything_on() {
  CameraSetup setup = SimConfig{}.down.setup;
  setup.optics.antialias = true;
  setup.optics.aperture_m = 0.01f;
  setup.optics.exposure_s = 0.02f;
  return setup;
}

TEST(SimCamera, TwoCamerasOfOneWorldGiveTheSameFramesInAnyOrder) {
  const auto scene = std::make_shared<const WorldScene>(placed_at_start(make_scene("corridor", 3)));
  const CameraSetup setup = everything_on();
  SimCamera a(scene, setup, {}, 7), b(scene, setup, {}, 7), other(scene, setup, {}, 8);
  BodyPose pose{0, {2, 0, -1}, quat_from_euler({0.1f, 0, 0.3f}), {1, 2, 0}, {0, 0.5f, 1}};
  std::vector<std::uint8_t> first(320 * 240), second(first.size());
  a.render(pose, 4, first.data(), nullptr);
  b.render(moved(pose, 0.5f), 9, second.data(), nullptr);
  EXPECT_NE(first, second);
  b.render(pose, 4, second.data(), nullptr);
  EXPECT_EQ(first, second) << "a pure function of seed, frame and pose";
  other.render(pose, 4, second.data(), nullptr);
  EXPECT_NE(first, second) << "another sensor's noise";
  pose.velocity_ned_mps.setZero(), pose.rate_body_radps.setZero();
  b.render(pose, 4, second.data(), nullptr);
  EXPECT_NE(first, second) << "blurred by its motion";
}

TEST(SimCamera, TheFisheyeBelowIsBlackBeyondItsFieldAndSeesTheFloorWithin) {
  SimConfig config;
  config.sensor.noise = false;
  SimCamera camera(make_world_scene(config), config.down.setup, config.sensor, down_seed(config.seed));
  std::vector<std::uint8_t> gray(320 * 240);
  camera.render({0, {0, 0, -1.05f}, Quat::Identity()}, 0, gray.data(), nullptr);
  EXPECT_EQ(gray[0], 0);
  EXPECT_EQ(gray[120 * 320 + 10], 0);
  EXPECT_GT(gray[120 * 320 + 160], 20);
  EXPECT_NEAR(camera.ideal().range[120 * 320 + 160], 1, 0.01) << "5 cm below the body";
}

TEST(SimCamera, DepthOfTheFrontCameraIsTheSameWithAndWithoutBlur) {
  SimConfig config;
  const auto scene = make_world_scene(config);
  CameraSetup plain = config.front(), blurred = plain;
  plain.optics.antialias = false;
  blurred.optics.aperture_m = 0.01f, blurred.optics.exposure_s = 0.02f;
  SimCamera sharp(scene, plain, config.sensor, 1), soft(scene, blurred, config.sensor, 1);
  const BodyPose pose{0, {0, 0, -1}, Quat::Identity(), {1, 2, 0}, {0, 0.5f, 1}};
  std::vector<std::uint8_t> gray(640 * 480), gray_soft(gray.size());
  std::vector<std::uint16_t> depth(gray.size()), depth_soft(gray.size());
  sharp.render(pose, 4, gray.data(), depth.data());
  soft.render(pose, 4, gray_soft.data(), depth_soft.data());
  EXPECT_NE(gray, gray_soft);
  EXPECT_EQ(depth, depth_soft);
}

TEST(SimCamera, InterpolatesPoses) {
  const BodyPose a{10, {0, 0, -1}, Quat::Identity()}, b{20, {1, 0, -2}, quat_from_euler({0.2f, 0, 0})};
  const BodyPose middle = interpolate(a, b, 15);
  EXPECT_TRUE(middle.position_ned_m.isApprox(Vec3(0.5f, 0, -1.5f)));
  EXPECT_NEAR(euler_from_quat(middle.q_ned_body).roll_rad, 0.1f, 1e-6f);
  EXPECT_EQ(middle.at_ns, 15);
}

}  // namespace
}  // namespace wasp::sim
