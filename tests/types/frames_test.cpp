// The conventions, each pinned by a case a person can picture.
#include "types/frames.h"

#include <gtest/gtest.h>

#include <random>

#include "types/camera.h"
#include "types/image_view.h"

namespace wasp {
namespace {

constexpr float kTiny = 1e-5f;

TEST(Frames, PitchUpRaisesTheNose) {  // NED: up is -z
  const Vec3 nose_ned = quat_from_euler({0, 0.3f, 0}) * Vec3::UnitX();
  EXPECT_LT(nose_ned.z(), -0.2f);
}

TEST(Frames, RollRightLowersTheRightRotors) {
  const Vec3 right_ned = quat_from_euler({0.3f, 0, 0}) * Vec3::UnitY();
  EXPECT_GT(right_ned.z(), 0.2f);
}

TEST(Frames, YawTurnsNorthToEast) {
  const Vec3 nose_ned = quat_from_euler({0, 0, 1.5707963f}) * Vec3::UnitX();
  EXPECT_NEAR(nose_ned.y(), 1.f, kTiny);
}

TEST(Frames, EulerRoundTrip) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> angle(-1.5f, 1.5f);
  for (int i = 0; i < 1000; ++i) {
    const Euler e{angle(random) * 2, angle(random), angle(random) * 2};
    const Euler back = euler_from_quat(quat_from_euler(e));
    EXPECT_NEAR(back.roll_rad, e.roll_rad, 2e-3f);
    EXPECT_NEAR(back.pitch_rad, e.pitch_rad, 2e-3f);
    EXPECT_NEAR(back.yaw_rad, e.yaw_rad, 2e-3f);
  }
}

TEST(Frames, ForwardCameraSeesAlongTheNose) {
  const Mat3 R_body_cam = R_body_cam_from_pitch_down(Radians{0.0});
  EXPECT_TRUE((R_body_cam * Vec3::UnitZ()).isApprox(Vec3::UnitX(), kTiny));  // optical axis forward
  EXPECT_TRUE((R_body_cam * Vec3::UnitX()).isApprox(Vec3::UnitY(), kTiny));  // image right is body right
  EXPECT_TRUE((R_body_cam * Vec3::UnitY()).isApprox(Vec3::UnitZ(), kTiny));  // image down is body down
}

TEST(Frames, DownwardCameraHasItsTopToTheFront) {
  const Mat3 R_body_cam = R_body_cam_from_pitch_down(to_radians(Degrees{90}));
  EXPECT_TRUE((R_body_cam * Vec3::UnitZ()).isApprox(Vec3::UnitZ(), kTiny));   // looks down
  EXPECT_TRUE((R_body_cam * Vec3::UnitY()).isApprox(-Vec3::UnitX(), kTiny));  // image down is backwards
}

TEST(Frames, CameraRotationIsProper) {
  for (double deg = -90; deg <= 90; deg += 7.5) {
    const Mat3 R = R_body_cam_from_pitch_down(to_radians(Degrees{deg}));
    EXPECT_NEAR(R.determinant(), 1.f, kTiny);
    EXPECT_TRUE((R * R.transpose()).isApprox(Mat3::Identity(), kTiny));
  }
}

TEST(Units, DegreesAndRadiansAreDistinctTypes) {
  static_assert(!std::is_convertible_v<Degrees, Radians>);
  static_assert(!std::is_convertible_v<double, Metres>);
  EXPECT_NEAR(to_radians(Degrees{180}).value, 3.14159265, 1e-8);
  EXPECT_NEAR(to_degrees(to_radians(Degrees{12.5})).value, 12.5, 1e-12);
}

TEST(ImageView, RefusesWhatCannotBeAnImage) {
  std::uint8_t pixel = 0;
  EXPECT_TRUE((GrayView{&pixel, 1, 1, 1}.valid()));
  EXPECT_FALSE((GrayView{nullptr, 1, 1, 1}.valid()));
  EXPECT_FALSE((GrayView{&pixel, 0, 1, 1}.valid()));
  EXPECT_FALSE((GrayView{&pixel, 4, 1, 3}.valid()));
}

}  // namespace
}  // namespace wasp
