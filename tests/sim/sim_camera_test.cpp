#include "sim/sim_camera.h"

#include <gtest/gtest.h>

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

TEST(SimCamera, InterpolatesPoses) {
  const BodyPose a{10, {0, 0, -1}, Quat::Identity()}, b{20, {1, 0, -2}, quat_from_euler({0.2f, 0, 0})};
  const BodyPose middle = interpolate(a, b, 15);
  EXPECT_TRUE(middle.position_ned_m.isApprox(Vec3(0.5f, 0, -1.5f)));
  EXPECT_NEAR(euler_from_quat(middle.q_ned_body).roll_rad, 0.1f, 1e-6f);
  EXPECT_EQ(middle.at_ns, 15);
}

}  // namespace
}  // namespace wasp::sim
