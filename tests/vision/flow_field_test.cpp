#include "vision/flow_field.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <memory>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "tests/vision/flow_scene.h"

namespace wasp::vision {
namespace {

using namespace wasp::vision::test;

constexpr DurationNs kFrame = 33 * kMillisecond;

BehaviourInput frame(const CameraGeometry& camera, const std::vector<std::uint8_t>& pixels, TimeNs at_ns,
                     const Euler& attitude = {}) {
  const auto& k = camera.intrinsics;
  BehaviourInput input;
  input.exposed_at_ns = at_ns;
  input.gray = {pixels.data(), k.width_px, k.height_px, k.width_px};
  input.attitude_valid = true;
  input.attitude.q_ned_body = BodyAt{Vec3::Zero(), attitude}.q_ned_body();
  return input;
}

FlowFieldParams params_of(const CameraGeometry& camera) {
  FlowFieldParams params;
  params.camera = camera;
  return params;
}

/// A camera that only turns: all of its flow must go.
template <class B>
void expect_turn_taken_out(const CameraGeometry& camera, const Euler& a, const Euler& b) {
  const Sky sky(3);
  const auto first = sky.picture(camera, a), second = sky.picture(camera, b);
  const auto params = params_of(camera);
  typename B::State state(params);
  EXPECT_EQ(B::step(params, frame(camera, first, kFrame, a), state).validity, Validity::kBlind);
  EXPECT_EQ(B::flow(state), nullptr);
  const CueBody cue = B::step(params, frame(camera, second, 2 * kFrame, b), state);
  ASSERT_EQ(cue.validity, Validity::kValid);
  ASSERT_NE(B::flow(state), nullptr);
  EXPECT_EQ(B::flow(state)->derotated, 1u);
  EXPECT_EQ(B::flow(state)->q_ned_body, (BodyAt{Vec3::Zero(), b}.q_ned_body()));
  EXPECT_GT(cue.detail[B::kValidCells], 50.f);
  EXPECT_GT(cue.detail[B::kMedianSeen_px], 2.f);
  EXPECT_LT(cue.detail[B::kMedianStill_px], 0.25f);
  EXPECT_NEAR(cue.detail[B::kInterval_s], 0.033f, 1e-6f);
}

TEST(FlowField, TheTurnOfAPitchedCameraIsTakenOut) {
  const CameraGeometry camera = pinhole(320, 240, 1.3f, 0.4);
  expect_turn_taken_out<FlowFieldFront>(camera, {0.1f, -0.05f, 1.f}, {0.13f, -0.05f, 1.f});
  expect_turn_taken_out<FlowFieldFront>(camera, {0.1f, -0.05f, 1.f}, {0.1f, -0.03f, 1.f});
  expect_turn_taken_out<FlowFieldFront>(camera, {0.1f, -0.05f, 1.f}, {0.09f, -0.04f, 1.02f});
}

TEST(FlowField, TheTurnOfAFisheyeThatLooksDownIsTakenOut) {
  const CameraGeometry camera = fisheye_down(320, 240);
  expect_turn_taken_out<FlowFieldDown>(camera, {0.1f, -0.05f, 1.f}, {0.13f, -0.02f, 1.04f});
}

TEST(FlowField, StepResponse) {
  const CameraGeometry camera = pinhole(320, 240, 1.3f, 0.0);
  const Sky sky(5);
  const auto params = params_of(camera);
  FlowFieldState state(params);
  for (int i = 0; i < 6; ++i) {
    const Euler attitude{0.f, 0.f, i < 3 ? 0.f : 0.02f * static_cast<float>(i - 2)};
    const auto pixels = sky.picture(camera, attitude);
    const CueBody cue = FlowFieldFront::step(params, frame(camera, pixels, (i + 1) * kFrame, attitude), state);
    if (i == 0) continue;
    ASSERT_EQ(cue.validity, Validity::kValid);
    const float expected_px = i < 3 ? 0.f : 0.02f * camera.intrinsics.fx_px;  // the very first field has all of it
    EXPECT_NEAR(state.message()->seen.at(6, 4).u_px, -expected_px, 0.2f) << i;
  }
}

TEST(FlowField, DepthIsThatOfTheFirstFrame) {
  const CameraGeometry camera = pinhole(320, 240, 1.3f, 0.0);
  const auto pixels = Sky(1).picture(camera, {});
  std::vector<std::uint16_t> depth(pixels.size(), 1000);
  const auto params = params_of(camera);
  FlowFieldState state(params);
  BehaviourInput input = frame(camera, pixels, kFrame);
  input.depth = {depth.data(), 320, 240, 320};
  FlowFieldFront::step(params, input, state);
  std::fill(depth.begin(), depth.end(), std::uint16_t{2000});
  std::fill(depth.begin(), depth.begin() + 320 * 120, std::uint16_t{0});
  input.exposed_at_ns += kFrame;
  EXPECT_GT(FlowFieldFront::step(params, input, state).detail[FlowFieldFront::kCellsWithDepth], 50.f);
  EXPECT_FLOAT_EQ(state.message()->depth_m[0], 1.f);
  input.exposed_at_ns += kFrame;
  input.depth = {};
  FlowFieldFront::step(params, input, state);
  EXPECT_FLOAT_EQ(state.message()->depth_m[0], 0.f);
  EXPECT_FLOAT_EQ(state.message()->depth_m[107], 2.f);
  input.exposed_at_ns += kFrame;
  EXPECT_EQ(FlowFieldFront::step(params, input, state).detail[FlowFieldFront::kCellsWithDepth], 0.f);
  EXPECT_FLOAT_EQ(state.message()->depth_m[107], 0.f);
}

TEST(FlowField, WithoutAttitudeTheFieldIsAsSeen) {
  const CameraGeometry camera = pinhole(320, 240, 1.3f, 0.0);
  const Sky sky(2);
  const auto a = sky.picture(camera, {}), b = sky.picture(camera, {0.f, 0.f, 0.02f});
  const auto params = params_of(camera);
  for (const int missing : {0, 1}) {
    FlowFieldState state(params);
    BehaviourInput first = frame(camera, a, kFrame), second = frame(camera, b, 2 * kFrame);
    (missing == 0 ? first : second).attitude.q_ned_body = {std::nanf(""), 0.f, 0.f, 0.f};
    FlowFieldFront::step(params, first, state);
    EXPECT_EQ(FlowFieldFront::step(params, second, state).validity, Validity::kValid);
    EXPECT_EQ(state.message()->derotated, 0u);
    EXPECT_TRUE(same(state.message()->seen, state.message()->still));
  }
}

TEST(FlowField, GapsAndTimeThatDoesNotIncreaseMakeNoField) {
  const CameraGeometry camera = pinhole(320, 240, 1.3f, 0.0);
  const auto pixels = Sky(2).picture(camera, {});
  const auto params = params_of(camera);
  FlowFieldState state(params);
  constexpr TimeNs kLeast = std::numeric_limits<TimeNs>::min(), kMost = std::numeric_limits<TimeNs>::max();
  struct Frame {
    TimeNs at_ns;
    bool field;
  };
  for (const auto& [at_ns, field] : {Frame{kLeast, false},
                                     {kMost, false},
                                     {kFrame, false},
                                     {2 * kFrame, true},
                                     {2 * kFrame, false},
                                     {kFrame, false},
                                     {2 * kFrame, true},
                                     {2 * kFrame + 250 * kMillisecond, false},
                                     {3 * kFrame + 250 * kMillisecond, true}}) {
    const CueBody cue = FlowFieldFront::step(params, frame(camera, pixels, at_ns), state);
    EXPECT_EQ(cue.validity == Validity::kValid, field) << at_ns;
    EXPECT_EQ(state.message() != nullptr, field) << at_ns;
  }
}

TEST(FlowField, BlindInputIsBlindAndForgottenByTheNextFrame) {
  const CameraGeometry camera = pinhole(320, 240, 1.3f, 0.0);
  const Sky sky(2);
  const auto a = sky.picture(camera, {}), b = sky.picture(camera, {0.f, 0.f, 0.02f});
  const auto params = params_of(camera);
  FlowFieldState state(params), fresh(params);
  FlowFieldFront::step(params, frame(camera, b, kFrame), state);
  FlowFieldFront::step(params, frame(camera, a, 2 * kFrame), state);
  BehaviourInput bad = frame(camera, b, 2 * kFrame + 1);
  bad.gray.width_px = 300;
  EXPECT_EQ(FlowFieldFront::step(params, bad, state).validity, Validity::kBlind);
  EXPECT_EQ(state.message(), nullptr);
  EXPECT_EQ(FlowFieldFront::step(params, {}, state).validity, Validity::kBlind);
  FlowFieldFront::step(params, frame(camera, a, 2 * kFrame), fresh);
  EXPECT_EQ(FlowFieldFront::step(params, frame(camera, b, 3 * kFrame), state).validity, Validity::kValid);
  FlowFieldFront::step(params, frame(camera, b, 3 * kFrame), fresh);
  EXPECT_TRUE(same(state.message()->seen, fresh.message()->seen));
  const std::vector<std::uint8_t> dark(a.size(), 20);
  EXPECT_EQ(FlowFieldFront::step(params, frame(camera, dark, 4 * kFrame), state).validity, Validity::kBlind);
  EXPECT_EQ(FlowFieldFront::step(params, frame(camera, dark, 5 * kFrame), state).validity, Validity::kBlind);
}

TEST(FlowField, AnImpossibleGridFailsAtStartUp) {
  FlowFieldParams params = params_of(pinhole(320, 240, 1.3f, 0.0));
  params.grid.columns = 99;
  EXPECT_THROW(FlowFieldState{params}, std::invalid_argument);
  params = params_of(pinhole(16, 16, 1.3f, 0.0));
  EXPECT_THROW(FlowFieldState{params}, std::invalid_argument);
}

TEST(FlowField, AllocatesNothingAndReplaysToTheBit) {
  const CameraGeometry camera = pinhole(320, 240, 1.3f, 0.2);
  const Sky sky(4);
  const auto params = params_of(camera);
  auto state = std::make_unique<FlowFieldState>(params), again = std::make_unique<FlowFieldState>(params);
  for (int i = 0; i < 5; ++i) {
    const Euler attitude{0.f, 0.01f * static_cast<float>(i), 0.f};
    const auto pixels = sky.picture(camera, attitude);
    const std::vector<std::uint16_t> depth(pixels.size(), 1500);
    BehaviourInput input = frame(camera, pixels, (i + 1) * kFrame, attitude);
    input.depth = {depth.data(), 320, 240, 320};
    const wasp::test::MallocCount count;
    CueBody a, b;
    {
      const rt::RealtimeSection section;
      a = FlowFieldFront::step(params, input, *state);
      b = FlowFieldFront::step(params, input, *again);
    }
    EXPECT_EQ(count.violations(), 0u);
    EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0);
    if (i > 0) {
      ASSERT_NE(state->message(), nullptr);
      EXPECT_TRUE(same(*state->message(), *again->message()));
    }
  }
}

}  // namespace
}  // namespace wasp::vision
