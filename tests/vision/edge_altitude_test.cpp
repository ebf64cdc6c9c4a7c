#include "vision/edge_altitude.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>
#include <vector>

#include "drivers/recording.h"
#include "rt/contract.h"
#include "tests/support/malloc_guard.h"

namespace wasp::vision {
namespace {

/// A chequered floor of 0.1 m squares seen from straight above.
std::vector<std::uint8_t> chequers(float height_m) {
  std::vector<std::uint8_t> pixels(640 * 480);
  for (int v = 0; v < 480; ++v)
    for (int u = 0; u < 640; ++u) {
      const float x_m = (static_cast<float>(u) - 319.5f) / 525.f * height_m + 50.03f;
      const float y_m = (static_cast<float>(v) - 239.5f) / 525.f * height_m + 50.03f;
      const bool white = (static_cast<int>(x_m * 10.f) + static_cast<int>(y_m * 10.f)) % 2 == 0;
      pixels[static_cast<std::size_t>(v * 640 + u)] = white ? 200 : 60;
    }
  return pixels;
}

EdgeAltitude::Params downward() {
  EdgeAltitude::Params params;
  params.camera.R_body_cam = R_body_cam_from_pitch_down(Radians{1.5707963});
  params.height.edges_per_m = 20.f;  // metres of edge per square metre of 0.1 m chequers
  params.smoothing_s = 0.1f;
  return params;
}

BehaviourInput input_of(const std::vector<std::uint8_t>& pixels, TimeNs at_ns) {
  BehaviourInput input;
  input.gray = {pixels.data(), 640, 480, 640};
  input.exposed_at_ns = at_ns;
  input.attitude_valid = true;
  return input;
}

TEST(EdgeAltitude, StepResponseRisesToTheNewHeight) {
  EdgeAltitude::State state;
  const auto low = chequers(1.f), high = chequers(2.f);
  CueBody before, early, late;
  for (int i = 0; i < 30; ++i) before = EdgeAltitude::step(downward(), input_of(low, i * 33 * kMillisecond), state);
  for (int i = 30; i < 60; ++i) {
    late = EdgeAltitude::step(downward(), input_of(high, i * 33 * kMillisecond), state);
    if (i == 31) early = late;
  }
  ASSERT_EQ(late.validity, Validity::kValid);
  EXPECT_NEAR(before.height_m, 1.f, 0.35f);  // blur and threshold set the scale; lambda is calibrated in use
  EXPECT_NEAR(late.height_m / before.height_m, 2.f, 0.3f);
  EXPECT_GT(early.height_m, before.height_m);
  EXPECT_LT(early.height_m, late.height_m);
  EXPECT_NEAR(late.height_m, late.detail[EdgeAltitude::kRawHeight_m], 1e-3f);
}

TEST(EdgeAltitude, BlindOnBlankMissingOrMisfittingImages) {
  EdgeAltitude::State state;
  const std::vector<std::uint8_t> blank(640 * 480, 100);
  EXPECT_EQ(EdgeAltitude::step(downward(), input_of(blank, 0), state).validity, Validity::kBlind);
  EXPECT_EQ(EdgeAltitude::step(downward(), {}, state).validity, Validity::kBlind);
  BehaviourInput small = input_of(blank, 0);
  small.gray.width_px = 320;
  EXPECT_EQ(EdgeAltitude::step(downward(), small, state).validity, Validity::kBlind);
}

TEST(EdgeAltitude, TimesThatJumpDoNotHurt) {
  EdgeAltitude::State state;
  const auto image = chequers(1.f);
  for (const TimeNs t : {TimeNs{0}, kNever, TimeNs{INT64_MAX}, TimeNs{-5}, TimeNs{kSecond}}) {
    const CueBody cue = EdgeAltitude::step(downward(), input_of(image, t), state);
    ASSERT_EQ(cue.validity, Validity::kValid);
    EXPECT_FLOAT_EQ(cue.height_m, cue.detail[EdgeAltitude::kRawHeight_m]);
  }
}

TEST(EdgeAltitude, AllocatesNothingAndReplaysToTheBit) {
  static_assert(std::is_trivially_copyable_v<EdgeAltitude::State>);
  const auto image = chequers(1.4f);
  const EdgeAltitude::Params params = downward();
  EdgeAltitude::State state;
  EdgeAltitude::step(params, input_of(image, 1), state);
  EdgeAltitude::State copy = state;
  const wasp::test::MallocCount count;
  CueBody a, b;
  {
    const rt::RealtimeSection section;
    a = EdgeAltitude::step(params, input_of(image, 2), state);
    b = EdgeAltitude::step(params, input_of(image, 2), copy);
  }
  EXPECT_EQ(count.violations(), 0u);
  EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0);
}

/// Up one metre between 3 and 6 s, smoothly.
float course_m(double t_s) {
  const double s = std::clamp((t_s - 3.0) / 3.0, 0.0, 1.0);
  return static_cast<float>(1.0 + s * s * (3 - 2 * s));
}

TEST(EdgeAltitude, FindsLambdaFromAClimbThatInertiaMeasured) {
  EdgeAltitude::Params params = downward();
  params.estimate_lambda = 1;
  params.height.edges_per_m = 45.f;  // a wrong guess: half the height
  EdgeAltitude::State state;
  CueBody cue;
  const double dt = 0.05;
  const auto speed = [](double t) { return (course_m(t + 1e-2) - course_m(t - 1e-2)) / 2e-2f; };
  float first_m = 0;
  for (int i = 0; i < 200; ++i) {
    const double t = i * dt;
    const auto image = chequers(course_m(t));
    BehaviourInput input = input_of(image, static_cast<TimeNs>(t * 1e9));
    const float up_mps2 = (speed(t) - speed(t - dt)) / static_cast<float>(dt) + 0.03f;  // biased
    const Quat q = quat_from_euler({0.f, 0.f, 1.f});
    input.attitude.q_ned_body = {q.w(), q.x(), q.y(), q.z()};
    input.accel_valid = true;
    input.accel_body_mps2 = {0.f, 0.f, -(9.80665f + up_mps2)};
    cue = EdgeAltitude::step(params, input, state);
    ASSERT_EQ(cue.validity, Validity::kValid);
    if (i == 0) {
      first_m = cue.height_m;
      EXPECT_EQ(cue.detail[EdgeAltitude::kEdgesPerM], 45.f);
      EXPECT_EQ(cue.detail[EdgeAltitude::kEdgesPerMSigma], 0.f);
    }
  }
  EXPECT_LT(first_m, 0.65f);
  ASSERT_GT(state.density.density.accepted, 0);
  EXPECT_NEAR(cue.height_m, 2.f, 0.3f);
  EXPECT_GT(cue.detail[EdgeAltitude::kEdgesPerMSigma], 0.f);
  EXPECT_LT(cue.detail[EdgeAltitude::kEdgesPerMSigma], 0.15f * cue.detail[EdgeAltitude::kEdgesPerM]);
  EXPECT_NEAR(cue.height_m, cue.detail[EdgeAltitude::kRawHeight_m], 0.02f);  // the filter went along
}

TEST(EdgeAltitude, WithoutAccelerationTheGivenLambdaHolds) {
  EdgeAltitude::Params params = downward();
  params.estimate_lambda = 1;
  EdgeAltitude::State state;
  CueBody cue;
  const auto image = chequers(1.f);
  for (int i = 0; i < 20; ++i) cue = EdgeAltitude::step(params, input_of(image, i * 50 * kMillisecond), state);
  EXPECT_EQ(state.density.count, 0);
  EXPECT_EQ(cue.detail[EdgeAltitude::kEdgesPerM], 20.f);
}

TEST(EdgeAltitude, FollowsARealDescent) {
  const std::filesystem::path folder = WASP_SOURCE_DIR "/../shared/data/hover_mocap/descend";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no recording at " << folder;
  const auto recording = drivers::Recording::open(folder);
  EdgeAltitude::Params params;
  params.camera = recording.geometry();
  params.height.max_height_m = 100.f;  // lambda is not known here: only the course counts
  EdgeAltitude::State state;
  std::vector<std::uint8_t> pixels(recording.gray_size().pixels());
  float first = 0, last = 0;
  for (std::size_t i = 0; i < recording.entries().size(); ++i) {
    recording.load_gray(i, pixels);
    BehaviourInput input;
    input.gray = {pixels.data(), recording.gray_size().width_px, recording.gray_size().height_px,
                  recording.gray_size().width_px};
    input.exposed_at_ns = recording.entries()[i].offset_ns;
    const CueBody cue = EdgeAltitude::step(params, input, state);
    ASSERT_EQ(cue.validity, Validity::kValid);
    (i == 0 ? first : last) = cue.detail[EdgeAltitude::kRawHeight_m];
  }
  EXPECT_LT(last, 0.75f * first);  // truth: 0.78 m to 0.38 m
}

}  // namespace
}  // namespace wasp::vision
