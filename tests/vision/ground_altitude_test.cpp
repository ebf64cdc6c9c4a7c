#include "vision/ground_altitude.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>

#include "drivers/recording.h"
#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "tests/vision/synthetic_depth.h"

namespace wasp::vision {
namespace {

using namespace wasp::vision::test;

constexpr float kPitchDown_rad = 0.6f;

GroundAltitude::Params params_pitched() {
  GroundAltitude::Params params;
  params.camera.R_body_cam = R_body_cam_from_pitch_down(Radians{static_cast<double>(kPitchDown_rad)});
  return params;
}

/// A level floor `height_m` under a camera on a body with this attitude.
DepthImage floor_image(float height_m, const Quat& q_ned_body, unsigned seed) {
  Scene scene;
  scene.floor.normal_cam =
      params_pitched().camera.R_body_cam.transpose() * (q_ned_body.conjugate() * Vec3(0.f, 0.f, -1.f));
  scene.floor.height_m = height_m;
  return render(scene, seed);
}

BehaviourInput input_of(const DepthImage& image, const Quat& q, bool attitude = true) {
  BehaviourInput input;
  input.depth = image.view();
  input.attitude_valid = attitude;
  input.attitude.q_ned_body = {q.w(), q.x(), q.y(), q.z()};
  return input;
}

TEST(GroundAltitude, HeightIsVerticalWhateverTheAttitude) {
  auto state = std::make_unique<GroundAltitude::State>();
  for (const Euler& e : {Euler{}, Euler{0.2f, -0.15f, 1.f}, Euler{-0.25f, 0.1f, -2.f}}) {
    const Quat q = quat_from_euler(e);
    const DepthImage image = floor_image(1.3f, q, 4);
    const CueBody cue = GroundAltitude::step(params_pitched(), input_of(image, q), *state);
    ASSERT_EQ(cue.validity, Validity::kValid);
    EXPECT_EQ(cue.has_height, 1);
    EXPECT_NEAR(cue.height_m, 1.3f, 0.01f);
    EXPECT_GT(cue.height_sigma_m, 0.f);
    EXPECT_LT(cue.detail[GroundAltitude::kTilt_rad], 0.02f);
    EXPECT_NEAR(cue.detail[GroundAltitude::kPerpendicular_m], 1.3f, 0.01f);
  }
}

TEST(GroundAltitude, StepResponse) {
  auto state = std::make_unique<GroundAltitude::State>();
  const Quat level = Quat::Identity();
  for (unsigned frame = 0; frame < 20; ++frame) {
    const float height_m = frame < 10 ? 0.5f : 1.f;
    const DepthImage image = floor_image(height_m, level, frame);
    const CueBody cue = GroundAltitude::step(params_pitched(), input_of(image, level), *state);
    ASSERT_EQ(cue.validity, Validity::kValid);
    EXPECT_NEAR(cue.height_m, height_m, 0.01f) << "frame " << frame;  // no lag: the very next frame has it
  }
}

TEST(GroundAltitude, AttitudeTellsAWallFromTheFloor) {
  Scene scene;  // all the camera sees is a wall, square to the optical axis
  scene.floor = {Vec3(0.f, 0.f, -1.f), 2.f};
  const DepthImage image = render(scene, 1);
  auto state = std::make_unique<GroundAltitude::State>();
  EXPECT_EQ(GroundAltitude::step(params_pitched(), input_of(image, Quat::Identity()), *state).validity,
            Validity::kBlind);
}

TEST(GroundAltitude, SpeaksPerpendicularHeightWithoutAttitude) {
  const Quat q = quat_from_euler({0.1f, 0.1f, 0.f});
  const DepthImage image = floor_image(1.3f, q, 4);
  auto state = std::make_unique<GroundAltitude::State>();
  const CueBody cue = GroundAltitude::step(params_pitched(), input_of(image, q, false), *state);
  ASSERT_EQ(cue.validity, Validity::kValid);
  EXPECT_NEAR(cue.height_m, 1.3f, 0.01f);
}

TEST(GroundAltitude, BlindInputIsBlindAndNotAnError) {
  auto state = std::make_unique<GroundAltitude::State>();
  const std::vector<std::uint16_t> dark(640 * 480, 0);
  BehaviourInput input;
  EXPECT_EQ(GroundAltitude::step({}, input, *state).validity, Validity::kBlind);
  input.depth = {dark.data(), 640, 480, 640};
  EXPECT_EQ(GroundAltitude::step({}, input, *state).validity, Validity::kBlind);
  const DepthImage image = floor_image(1.f, Quat::Identity(), 1);
  input = input_of(image, Quat::Identity());
  input.attitude.q_ned_body = {std::nanf(""), 0.f, 0.f, 0.f};  // counts as no attitude
  const CueBody cue = GroundAltitude::step(params_pitched(), input, *state);
  EXPECT_NEAR(cue.height_m, 1.f, 0.01f);
}

TEST(GroundAltitude, AllocatesNothingAndReplaysToTheBit) {
  const GroundAltitude::Params params = params_pitched();
  const Quat level = Quat::Identity();
  auto state = std::make_unique<GroundAltitude::State>(), copy = std::make_unique<GroundAltitude::State>();
  static_assert(std::is_trivially_copyable_v<GroundAltitude::State>);
  for (unsigned frame = 0; frame < 5; ++frame) {
    const DepthImage image = floor_image(1.f, level, frame);
    *copy = *state;
    const wasp::test::MallocCount count;
    CueBody a, b;
    {
      const rt::RealtimeSection section;
      a = GroundAltitude::step(params, input_of(image, level), *state);
      b = GroundAltitude::step(params, input_of(image, level), *copy);
    }
    EXPECT_EQ(count.violations(), 0u);
    EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0);
  }
}

TEST(GroundAltitude, EveryFrameOfARealKitchen) {
  const std::filesystem::path folder = WASP_SOURCE_DIR "/../shared/data/kinect_7scenes_redkitchen";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no recording at " << folder;
  const auto recording = drivers::Recording::open(folder);
  GroundAltitude::Params params;
  params.camera = recording.geometry();
  auto state = std::make_unique<GroundAltitude::State>();
  std::vector<std::uint16_t> pixels(recording.depth_size().pixels());
  for (std::size_t i = 0; i < recording.entries().size(); ++i) {
    recording.load_depth(i, pixels);
    BehaviourInput input;
    input.depth = {pixels.data(), 640, 480, 640};
    const CueBody cue = GroundAltitude::step(params, input, *state);
    ASSERT_EQ(cue.validity, Validity::kValid) << recording.entries()[i].depth_file;
    EXPECT_NEAR(cue.height_m, 1.30f, 0.05f);
  }
}

}  // namespace
}  // namespace wasp::vision
