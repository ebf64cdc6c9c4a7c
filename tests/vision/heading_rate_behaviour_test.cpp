#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <memory>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "tests/vision/flow_scene.h"
#include "vision/heading_log_polar.h"
#include "vision/heading_rate.h"

namespace wasp::vision {
namespace {

using namespace wasp::vision::test;
using H = HeadingRateDown;

constexpr DurationNs kFrame = 33 * kMillisecond;
constexpr float kFrame_s = 0.033f;

FlowScene over_ground() { return {fisheye_down(), {ground()}}; }

H::Params params_of(const FlowScene& scene) {
  H::Params params;
  params.camera = scene.camera;
  return params;
}

TEST(HeadingRateBehaviour, YawAndHeightThroughAFisheyeWhateverElseMoves) {
  const FlowScene scene = over_ground();
  for (const float yaw_rad : {-0.06f, 0.f, 0.04f}) {
    const BodyAt a{Vec3(0.f, 0.f, -1.f), {0.12f, -0.1f, 1.f}};
    const BodyAt b{Vec3(0.03f, -0.04f, -1.05f), {0.09f, -0.07f, 1.f + yaw_rad}};
    const FlowMessage message = scene.message(a, b, kFrame);
    H::State state;
    const CueBody cue = H::step(params_of(scene), input_of(message), state);
    ASSERT_EQ(cue.validity, Validity::kValid);
    EXPECT_NEAR(cue.detail[H::kYawRate_radps], yaw_rad / kFrame_s, 0.002f / kFrame_s);
    EXPECT_NEAR(cue.detail[H::kHeightRatio], 1.05f, 0.002f);
    EXPECT_NEAR(cue.detail[H::kHeading_rad], yaw_rad, 0.002f);
    EXPECT_EQ(cue.detail[H::kInliers], cue.detail[H::kCells]);
    EXPECT_EQ(cue.has_heading_rate, 0);
    EXPECT_EQ(cue.has_height, 0);
  }
}

TEST(HeadingRateBehaviour, StepResponseWithNoiseAndThingsThatMove) {
  FlowScene scene = over_ground();
  scene.noise_px = 0.15f, scene.outliers = 0.2f;
  const auto params = params_of(scene);
  H::State state;
  float yaw_rad = 0.f;
  for (int i = 0; i < 40; ++i) {
    const float rate_radps = i < 20 ? 0.f : 0.8f;
    const float next_rad = yaw_rad + rate_radps * kFrame_s;
    const FlowMessage message =
        scene.message({Vec3(0.f, 0.f, -1.2f), {0.f, 0.f, yaw_rad}}, {Vec3(0.02f, 0.f, -1.2f), {0.f, 0.f, next_rad}},
                      (i + 1) * kFrame, static_cast<unsigned>(i));
    yaw_rad = next_rad;
    const CueBody cue = H::step(params, input_of(message), state);
    ASSERT_EQ(cue.validity, Validity::kValid) << i;
    EXPECT_NEAR(cue.detail[H::kYawRate_radps], rate_radps, 0.1f) << i;  // no lag
    EXPECT_NEAR(cue.detail[H::kYawRate_radps], rate_radps, 6.f * cue.detail[H::kYawRateSigma_radps]) << i;
    EXPECT_LT(cue.detail[H::kInliers], cue.detail[H::kCells]);
  }
  EXPECT_NEAR(static_cast<float>(state.heading_rad), yaw_rad, 0.01f);
}

TEST(HeadingRateBehaviour, ScaleCalibratesAndGainWishes) {
  const FlowScene scene = over_ground();
  const FlowMessage message =
      scene.message({Vec3(0, 0, -1), {0.f, 0.f, 0.f}}, {Vec3(0, 0, -1), {0.f, 0.f, 0.033f}}, kFrame);
  auto params = params_of(scene);
  params.scale = 1.02f, params.gain = 0.5f;
  H::State state;
  const CueBody cue = H::step(params, input_of(message), state);
  EXPECT_NEAR(cue.detail[H::kYawRate_radps], 1.02f, 0.01f);
  EXPECT_EQ(cue.has_heading_rate, 1);
  EXPECT_FLOAT_EQ(cue.heading_rate_radps, -0.5f * cue.detail[H::kYawRate_radps]);
}

TEST(HeadingRateBehaviour, WithoutAttitudeALevelVehicleIsMeasuredAllTheSame) {
  FlowScene scene = over_ground();
  scene.attitude = false;
  const FlowMessage message =
      scene.message({Vec3(0, 0, -1), {0.f, 0.f, 2.f}}, {Vec3(0, 0, -1), {0.f, 0.f, 2.033f}}, kFrame);
  H::State state;
  const CueBody cue = H::step(params_of(scene), input_of(message), state);
  EXPECT_EQ(cue.validity, Validity::kValid);
  EXPECT_NEAR(cue.detail[H::kYawRate_radps], 1.f, 0.01f);
}

TEST(HeadingRateBehaviour, BlindInputIsBlindAndNotAnError) {
  const FlowScene scene = over_ground();
  const auto params = params_of(scene);
  const FlowMessage good = scene.message({Vec3(0, 0, -1), {}}, {Vec3(0, 0, -1), {0.f, 0.f, 0.03f}}, kFrame);
  const auto blind = [&](auto spoil) {
    FlowMessage message = good;
    spoil(message);
    H::State state;
    return H::step(params, input_of(message), state).validity == Validity::kBlind;
  };
  const float nan = std::nanf("");
  H::State state;
  EXPECT_EQ(H::step(params, {}, state).validity, Validity::kBlind);
  EXPECT_FALSE(blind([](FlowMessage&) {}));
  EXPECT_TRUE(blind([&](FlowMessage& m) { m.q_ned_body.fill(nan); }));
  EXPECT_TRUE(blind([&](FlowMessage& m) { m.R_second_first.fill(nan); }));
  EXPECT_TRUE(blind([](FlowMessage& m) { m.seen.columns = 1 << 20; }));
  EXPECT_TRUE(blind([](FlowMessage& m) { m.seen = {}; }));
  EXPECT_TRUE(blind([](FlowMessage& m) { std::swap(m.exposed_at_ns, m.first_exposed_at_ns); }));
  EXPECT_TRUE(blind([](FlowMessage& m) { m.first_exposed_at_ns = std::numeric_limits<TimeNs>::min(); }));
  EXPECT_TRUE(blind([&](FlowMessage& m) {
    for (FlowCell& cell : m.seen.cells) cell.v_px = nan;
  }));
  H::step(params, input_of(good), state);
  H::step(params, input_of(good), state);  // the same message again turns nothing further
  EXPECT_NEAR(static_cast<float>(state.heading_rad), 0.03f, 0.002f);
}

TEST(HeadingRateBehaviour, AllocatesNothingAndReplaysToTheBit) {
  static_assert(std::is_trivially_copyable_v<H::State>);
  FlowScene scene = over_ground();
  scene.noise_px = 0.1f;
  const auto params = params_of(scene);
  H::State state;
  for (int i = 0; i < 5; ++i) {
    const FlowMessage message = scene.message({Vec3(0, 0, -1), {}}, {Vec3(0, 0, -1), {0.f, 0.f, 0.03f}},
                                              (i + 1) * kFrame, static_cast<unsigned>(i));
    H::State copy = state;
    const wasp::test::MallocCount count;
    CueBody a, b;
    {
      const rt::RealtimeSection section;
      a = H::step(params, input_of(message), state);
      b = H::step(params, input_of(message), copy);
    }
    EXPECT_EQ(count.violations(), 0u);
    EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0);
  }
}

// The thesis' way.

using L = HeadingLogPolarDown;

L::Params log_polar_params() {
  L::Params params;
  params.camera = fisheye_down();
  return params;
}

BehaviourInput frame(const std::vector<std::uint8_t>& pixels, TimeNs at_ns, int stride_px = 640) {
  BehaviourInput input;
  input.exposed_at_ns = at_ns;
  input.gray = {pixels.data(), 640, 480, stride_px};
  return input;
}

TEST(HeadingLogPolarBehaviour, StepResponseOnATurntable) {
  const Sky sky(7);
  const auto params = log_polar_params();
  L::State state(params);
  float yaw_rad = 0;
  for (int i = 0; i < 8; ++i) {
    const float turn_rad = i < 4 ? 0.f : 0.05f;
    yaw_rad += turn_rad;
    const auto pixels = sky.picture(params.camera, {0.f, 0.f, yaw_rad});
    const CueBody cue = L::step(params, frame(pixels, (i + 1) * kFrame), state);
    ASSERT_EQ(cue.validity, i == 0 ? Validity::kBlind : Validity::kValid) << i;
    if (i == 0) continue;
    EXPECT_NEAR(cue.detail[L::kYawRate_radps], turn_rad / kFrame_s, 0.006f / kFrame_s) << i;
    EXPECT_NEAR(cue.detail[L::kHeightRatio], 1.f, 0.01f) << i;
    EXPECT_EQ(cue.has_heading_rate, 0);
  }
  EXPECT_NEAR(static_cast<float>(state.heading_rad), yaw_rad, 0.01f);
}

TEST(HeadingLogPolarBehaviour, BlindInputGapsAndTimeBackwards) {
  const auto params = log_polar_params();
  const auto pixels = Sky(7).picture(params.camera, {});
  L::State state(params);
  const auto valid = [&](const BehaviourInput& input) {
    return L::step(params, input, state).validity == Validity::kValid;
  };
  EXPECT_FALSE(valid({}));
  EXPECT_FALSE(valid(frame(pixels, std::numeric_limits<TimeNs>::min())));
  EXPECT_FALSE(valid(frame(pixels, kFrame)));
  EXPECT_TRUE(valid(frame(pixels, 2 * kFrame)));
  EXPECT_FALSE(valid(frame(pixels, 2 * kFrame)));
  EXPECT_FALSE(valid(frame(pixels, kFrame)));
  EXPECT_TRUE(valid(frame(pixels, 2 * kFrame)));
  EXPECT_FALSE(valid(frame(pixels, 20 * kFrame)));
  BehaviourInput small = frame(pixels, 21 * kFrame);
  small.gray.height_px = 400;
  EXPECT_FALSE(valid(small));
  EXPECT_FALSE(valid(frame(pixels, 22 * kFrame)));
  std::vector<std::uint8_t> padded(700 * 480);
  for (std::size_t v = 0; v < 480; ++v) std::memcpy(&padded[v * 700], &pixels[v * 640], 640);
  EXPECT_TRUE(valid(frame(padded, 23 * kFrame, 700)));
}

TEST(HeadingLogPolarBehaviour, AllocatesNothingAndReplaysToTheBit) {
  const auto params = log_polar_params();
  const Sky sky(7);
  auto state = std::make_unique<L::State>(params), again = std::make_unique<L::State>(params);
  for (int i = 0; i < 3; ++i) {
    const auto pixels = sky.picture(params.camera, {0.f, 0.f, 0.03f * static_cast<float>(i)});
    const wasp::test::MallocCount count;
    CueBody a, b;
    {
      const rt::RealtimeSection section;
      a = L::step(params, frame(pixels, (i + 1) * kFrame), *state);
      b = L::step(params, frame(pixels, (i + 1) * kFrame), *again);
    }
    EXPECT_EQ(count.violations(), 0u);
    EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0);
  }
}

}  // namespace
}  // namespace wasp::vision
