#include "vision/odometry.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "tests/vision/flow_scene.h"

namespace wasp::vision {
namespace {

using namespace wasp::vision::test;

constexpr DurationNs kFrame = 33 * kMillisecond;
constexpr float kFrame_s = 0.033f;

FlowScene in_corridor(double pitch_down_rad = 0.3) {
  FlowScene scene{pinhole(320, 240, 1.4f, pitch_down_rad), corridor()};
  scene.camera.position_body_m = Vec3(0.1f, 0.02f, 0.05f);
  return scene;
}

Odometry::Params params_of(const FlowScene& scene) {
  Odometry::Params params;
  params.camera = scene.camera;
  return params;
}

/// A flight at constant velocity in level axes of `yaw_rad`, at frame `i`.
BodyAt along(int i, const Vec3& velocity_level_mps, float yaw_rad, const Euler& wobble = {}) {
  const Mat3 R = quat_from_euler({0.f, 0.f, yaw_rad}).toRotationMatrix();
  const float k = static_cast<float>(i);
  return {Vec3(0.f, 0.1f, -1.1f) + R * velocity_level_mps * kFrame_s * k,
          {wobble.roll_rad * k, wobble.pitch_rad * k, yaw_rad + wobble.yaw_rad * k}};
}

TEST(Odometry, VelocityIsLevelAndAlongTheHeading) {
  const FlowScene scene = in_corridor();
  for (const float yaw_rad : {0.f, 0.3f, -0.3f}) {
    const Vec3 velocity(1.2f, -0.3f, 0.1f);
    BodyAt a = along(0, velocity, yaw_rad), b = along(1, velocity, yaw_rad);
    a.attitude.roll_rad = b.attitude.roll_rad = 0.15f;
    a.attitude.pitch_rad = b.attitude.pitch_rad = -0.2f;
    const FlowMessage message = scene.message(a, b, kFrame);
    Odometry::State state;
    const CueBody cue = Odometry::step(params_of(scene), input_of(message), state);
    ASSERT_EQ(cue.validity, Validity::kValid);
    EXPECT_EQ(cue.has_velocity, 1);
    EXPECT_NEAR(cue.velocity_forward_mps, 1.2f, 0.01f);
    EXPECT_NEAR(cue.velocity_right_mps, -0.3f, 0.01f);
    EXPECT_NEAR(cue.detail[Odometry::kClimb_mps], -0.1f, 0.01f);
    EXPECT_GT(cue.velocity_sigma_mps, 0.f);
    EXPECT_LT(cue.velocity_sigma_mps, 0.05f);
  }
}

TEST(Odometry, ATurningBodyThatStaysHasNoVelocityThoughItsCameraMoves) {
  const FlowScene scene = in_corridor();
  const Euler turn{0.02f, 0.03f, -0.04f};  // the camera's lever makes 10 cm/s of it
  const FlowMessage message =
      scene.message(along(0, Vec3::Zero(), 0.f, turn), along(1, Vec3::Zero(), 0.f, turn), kFrame);
  Odometry::State state;
  const CueBody cue = Odometry::step(params_of(scene), input_of(message), state);
  ASSERT_EQ(cue.validity, Validity::kValid);
  EXPECT_NEAR(cue.velocity_forward_mps, 0.f, 0.005f);
  EXPECT_NEAR(cue.velocity_right_mps, 0.f, 0.005f);
  EXPECT_NEAR(cue.detail[Odometry::kClimb_mps], 0.f, 0.005f);
}

TEST(Odometry, StepResponseUnderNoiseAndOutliers) {
  FlowScene scene = in_corridor();
  scene.noise_px = 0.1f, scene.outliers = 0.25f;
  const auto params = params_of(scene);
  Odometry::State state;
  Vec3 sum = Vec3::Zero();
  float squares = 0;
  for (int i = 0; i < 60; ++i) {
    const Vec3 velocity(i < 30 ? 0.f : 1.f, 0.f, 0.f);
    const FlowMessage message =
        scene.message(along(0, velocity, 0.f), along(1, velocity, 0.f), (i + 1) * kFrame, static_cast<unsigned>(i));
    const CueBody cue = Odometry::step(params, input_of(message), state);
    ASSERT_EQ(cue.validity, Validity::kValid) << i;
    EXPECT_NEAR(cue.velocity_forward_mps, velocity.x(), 5.f * cue.velocity_sigma_mps) << i;  // no lag
    EXPECT_LT(cue.detail[Odometry::kInliers], 0.9f * cue.detail[Odometry::kCells]);
    const Vec3 error(cue.velocity_forward_mps - velocity.x(), cue.velocity_right_mps, 0.f);
    sum += error, squares += error.squaredNorm() / (2.f * cue.velocity_sigma_mps * cue.velocity_sigma_mps);
  }
  EXPECT_LT((sum / 60.f).norm(), 0.01f);
  EXPECT_GT(squares / 60.f, 0.1f);  // the sigma means what it says
  EXPECT_LT(squares / 60.f, 3.f);
}

TEST(Odometry, ATurnThatTheAttitudeMissedIsSolvedFor) {
  FlowScene scene = in_corridor();
  const Vec3 velocity(0.8f, 0.f, 0.f);
  FlowMessage message = scene.message(along(0, velocity, 0.f), along(1, velocity, 0.f), kFrame);
  const Mat3 missed = Eigen::AngleAxisf(0.001f, Vec3(0.3f, 1.f, 0.2f).normalized()).toRotationMatrix();
  derotate(scene.camera.lens(), message.seen, missed, message.still);
  auto params = params_of(scene);
  const auto error = [&](float turn_sigma_rad) {
    params.turn_sigma_rad = turn_sigma_rad;
    Odometry::State state;
    const CueBody cue = Odometry::step(params, input_of(message), state);
    EXPECT_EQ(cue.validity, Validity::kValid);
    return std::hypot(cue.velocity_forward_mps - 0.8f, cue.velocity_right_mps);
  };
  EXPECT_LT(error(0.001f), 0.5f * error(0.f));
}

TEST(Odometry, OdometersCountDistanceAndImageMotion) {
  FlowScene scene = in_corridor();
  const auto params = params_of(scene);
  Odometry::State state;
  const Vec3 velocity(1.f, 0.f, 0.f);
  CueBody cue;
  for (int i = 0; i < 100; ++i) {
    const FlowMessage message = scene.message(along(i, velocity, 0.f), along(i + 1, velocity, 0.f), (i + 1) * kFrame);
    cue = Odometry::step(params, input_of(message), state);
    const CueBody repeated = Odometry::step(params, input_of(message), state);  // counts once
    EXPECT_EQ(cue.detail[Odometry::kDistance_m], repeated.detail[Odometry::kDistance_m]);
  }
  EXPECT_NEAR(cue.detail[Odometry::kDistance_m], 3.3f, 0.05f);
  const float wide_rad = cue.detail[Odometry::kImageMotion_rad];
  scene.planes = corridor(0.6f);  // the same way between nearer walls is longer to a bee
  state = {};
  for (int i = 0; i < 100; ++i) {
    const FlowMessage message = scene.message(along(i, velocity, 0.f), along(i + 1, velocity, 0.f), (i + 1) * kFrame);
    cue = Odometry::step(params, input_of(message), state);
  }
  EXPECT_NEAR(cue.detail[Odometry::kDistance_m], 3.3f, 0.05f);
  EXPECT_GT(cue.detail[Odometry::kImageMotion_rad], 1.1f * wide_rad);
}

TEST(Odometry, BlindInputIsBlindAndNotAnError) {
  const FlowScene scene = in_corridor();
  const auto params = params_of(scene);
  const FlowMessage good = scene.message(along(0, Vec3::UnitX(), 0.f), along(1, Vec3::UnitX(), 0.f), kFrame);
  const auto blind = [&](auto spoil) {
    FlowMessage message = good;
    spoil(message);
    Odometry::State state;
    return Odometry::step(params, input_of(message), state).validity == Validity::kBlind;
  };
  const float nan = std::nanf("");
  Odometry::State state;
  EXPECT_EQ(Odometry::step(params, {}, state).validity, Validity::kBlind);
  EXPECT_EQ(Odometry::step({}, {}, state).validity, Validity::kBlind);
  EXPECT_FALSE(blind([](FlowMessage&) {}));
  EXPECT_TRUE(blind([](FlowMessage& m) { m.derotated = 0; }));
  EXPECT_TRUE(blind([](FlowMessage& m) { m.depth_m = {}; }));
  EXPECT_TRUE(blind([&](FlowMessage& m) { m.depth_m.fill(nan); }));
  EXPECT_TRUE(blind([&](FlowMessage& m) { m.q_ned_body[0] = nan; }));
  EXPECT_TRUE(blind([&](FlowMessage& m) { m.R_second_first[4] = nan; }));
  EXPECT_TRUE(blind([](FlowMessage& m) { m.still.columns = 1000; }));
  EXPECT_TRUE(blind([](FlowMessage& m) { m.still.rows = m.seen.rows = -1; }));
  EXPECT_TRUE(blind([](FlowMessage& m) { m.first_exposed_at_ns = m.exposed_at_ns + 1; }));
  EXPECT_TRUE(blind([](FlowMessage& m) {
    m.first_exposed_at_ns = std::numeric_limits<TimeNs>::min();
    m.exposed_at_ns = std::numeric_limits<TimeNs>::max();
  }));
  EXPECT_TRUE(blind([&](FlowMessage& m) {
    for (FlowCell& cell : m.still.cells) cell.u_px = nan;
  }));
  FlowScene noise = scene;
  noise.outliers = 1.f;  // no motion explains it
  const FlowMessage mess = noise.message(along(0, Vec3::UnitX(), 0.f), along(1, Vec3::UnitX(), 0.f), kFrame);
  EXPECT_EQ(Odometry::step(params, input_of(mess), state).validity, Validity::kBlind);
}

TEST(Odometry, AllocatesNothingAndReplaysToTheBit) {
  static_assert(std::is_trivially_copyable_v<Odometry::State>);
  FlowScene scene = in_corridor();
  scene.noise_px = 0.1f;
  const auto params = params_of(scene);
  Odometry::State state;
  for (int i = 0; i < 5; ++i) {
    const FlowMessage message = scene.message(along(i, Vec3::UnitX(), 0.f), along(i + 1, Vec3::UnitX(), 0.f),
                                              (i + 1) * kFrame, static_cast<unsigned>(i));
    Odometry::State copy = state;
    const wasp::test::MallocCount count;
    CueBody a, b;
    {
      const rt::RealtimeSection section;
      a = Odometry::step(params, input_of(message), state);
      b = Odometry::step(params, input_of(message), copy);
    }
    EXPECT_EQ(count.violations(), 0u);
    EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0);
  }
}

}  // namespace
}  // namespace wasp::vision
