#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "tests/vision/flow_scene.h"
#include "vision/time_to_contact.h"

namespace wasp::vision {
namespace {

using namespace wasp::vision::test;
using T = TimeToContactFront;

constexpr DurationNs kFrame = kSecond / 30;
constexpr float kFrame_s = 1.f / 30.f;

FlowScene before_wall(double pitch_down_rad = 0.2) {
  FlowScene scene{pinhole(320, 240, 1.4f, pitch_down_rad), {ground(), wall_ahead(5.f)}};
  scene.noise_px = 0.1f;
  return scene;
}

T::Params params_of(const FlowScene& scene) {
  T::Params params;
  params.camera = scene.camera;
  return params;
}

/// Frame `i` of a flight north (and a little east) with a wobbling attitude.
BodyAt at(int i, float speed_mps, float slant_rad = 0.f, float height_m = 1.f) {
  const float t = static_cast<float>(i) * kFrame_s;
  return {Vec3(speed_mps * t * std::cos(slant_rad), speed_mps * t * std::sin(slant_rad), -height_m),
          {0.04f * std::sin(5.f * t), -0.05f + 0.03f * std::sin(4.f * t), slant_rad + 0.05f * std::sin(3.f * t)}};
}

TEST(TimeToContactBehaviour, ContactIsThatOfTheWallAheadWhateverThePitch) {
  for (const double pitch_down_rad : {0.0, 0.2, 0.5}) {
    const FlowScene scene = before_wall(pitch_down_rad);
    T::State state(params_of(scene));
    for (int i = 0; i < 120; ++i) {  // up to 1 m before the wall
      const FlowMessage message = scene.message(at(i, 1.f), at(i + 1, 1.f), (i + 1) * kFrame, static_cast<unsigned>(i));
      const CueBody cue = T::step(params_of(scene), input_of(message), state);
      ASSERT_EQ(cue.validity, Validity::kValid) << i;
      const float left = (5.f - static_cast<float>(i + 1) * kFrame_s) / kFrame_s;
      if (left > 60.f) continue;
      EXPECT_NEAR(cue.detail[T::kContact_frames], left, 0.15f * left) << pitch_down_rad;
    }
  }
}

TEST(TimeToContactBehaviour, StepResponseAvoidIsRaisedInTimeBeforeAWall) {
  for (const float speed_mps : {0.7f, 1.f, 1.5f})
    for (const float slant_rad : {-0.3f, 0.f, 0.2f}) {
      const FlowScene scene = before_wall();
      T::State state(params_of(scene));
      float raised_at_frames = 0;
      for (int i = 0; raised_at_frames == 0.f; ++i) {
        const BodyAt next = at(i + 1, speed_mps, slant_rad);
        const float left = (5.f - next.position_ned_m.x()) / (speed_mps * std::cos(slant_rad) * kFrame_s);
        ASSERT_GT(left, 15.f) << speed_mps << " " << slant_rad;
        const FlowMessage message =
            scene.message(at(i, speed_mps, slant_rad), next, (i + 1) * kFrame, static_cast<unsigned>(i));
        if (T::step(params_of(scene), input_of(message), state).avoid != 0) raised_at_frames = left;
      }
      EXPECT_LT(raised_at_frames, 50.f);
    }
}

TEST(TimeToContactBehaviour, NeverInACorridor) {
  FlowScene scene{pinhole(320, 240, 1.4f, 0.2), corridor()};
  scene.noise_px = 0.15f, scene.outliers = 0.05f;
  for (unsigned flight = 0; flight < 10; ++flight) {
    T::State state(params_of(scene));
    const float speed_mps = 0.7f + 0.09f * static_cast<float>(flight);
    const int frames = static_cast<int>(25.f / (speed_mps * kFrame_s));
    for (int i = 0; i < frames; ++i) {
      const FlowMessage message = scene.message(at(i, speed_mps), at(i + 1, speed_mps), (i + 1) * kFrame,
                                                flight * 10000u + static_cast<unsigned>(i));
      ASSERT_EQ(T::step(params_of(scene), input_of(message), state).avoid, 0) << flight << " " << i;
    }
  }
}

TEST(TimeToContactBehaviour, NeitherHoverNorRetreatRaisesIt) {
  const FlowScene scene = before_wall();
  for (const float speed_mps : {0.f, -1.f}) {
    T::State state(params_of(scene));
    for (int i = 0; i < 100; ++i) {
      BodyAt a = at(i, speed_mps), b = at(i + 1, speed_mps);
      a.position_ned_m.x() += 4.2f, b.position_ned_m.x() += 4.2f;
      const FlowMessage message = scene.message(a, b, (i + 1) * kFrame, static_cast<unsigned>(i));
      const CueBody cue = T::step(params_of(scene), input_of(message), state);
      ASSERT_EQ(cue.avoid, 0) << i;
    }
  }
}

TEST(TimeToContactBehaviour, AvoidIsHeldAndThenReleased) {
  const FlowScene scene = before_wall();
  const auto params = params_of(scene);
  T::State state(params);
  int i = 0;
  bool raised = false;
  for (; !raised; ++i) {
    const FlowMessage message = scene.message(at(i, 1.f), at(i + 1, 1.f), (i + 1) * kFrame, static_cast<unsigned>(i));
    raised = T::step(params, input_of(message), state).avoid != 0;
    ASSERT_LT(i, 140);
  }
  FlowMessage blind = scene.message(at(i, 1.f), at(i, 1.f), i * kFrame + 1);
  blind.derotated = 0;
  const CueBody cue = T::step(params, input_of(blind), state);
  EXPECT_EQ(cue.validity, Validity::kBlind);
  EXPECT_EQ(cue.avoid, 1);
  int held = 0;  // the vehicle stands still from now on
  for (int k = 0; k < 60; ++k) {
    const FlowMessage message = scene.message(at(i, 1.f), at(i, 1.f), (i + 1 + k) * kFrame, static_cast<unsigned>(k));
    held += T::step(params, input_of(message), state).avoid;
  }
  EXPECT_NEAR(held, 30, 2);
}

TEST(TimeToContactBehaviour, BlindInputIsBlindAndNotAnError) {
  const FlowScene scene = before_wall();
  const auto params = params_of(scene);
  const FlowMessage good = scene.message(at(90, 1.f), at(91, 1.f), kFrame);
  const auto blind = [&](auto spoil) {
    FlowMessage message = good;
    spoil(message);
    T::State state(params);
    const CueBody cue = T::step(params, input_of(message), state);
    return cue.validity == Validity::kBlind && cue.avoid == 0;
  };
  const float nan = std::nanf("");
  T::State state(params);
  EXPECT_EQ(T::step(params, {}, state).validity, Validity::kBlind);
  EXPECT_FALSE(blind([](FlowMessage&) {}));
  EXPECT_TRUE(blind([](FlowMessage& m) { m.derotated = 0; }));
  EXPECT_TRUE(blind([&](FlowMessage& m) { m.q_ned_body.fill(nan); }));
  EXPECT_TRUE(blind([](FlowMessage& m) { m.still.rows = 77; }));
  EXPECT_TRUE(blind([](FlowMessage& m) { m.still = {}; }));
  EXPECT_TRUE(blind([](FlowMessage& m) { std::swap(m.exposed_at_ns, m.first_exposed_at_ns); }));
  EXPECT_TRUE(blind([](FlowMessage& m) { m.exposed_at_ns = std::numeric_limits<TimeNs>::max(); }));
  EXPECT_TRUE(blind([&](FlowMessage& m) {
    for (FlowCell& cell : m.still.cells) cell.x_px = nan;
  }));
}

TEST(TimeToContactBehaviour, TimeThatRunsBackwardsStartsANewFlight) {
  const FlowScene scene = before_wall();
  const auto params = params_of(scene);
  T::State state(params), fresh(params);
  int i = 0;
  for (bool raised = false; !raised; ++i) {
    const FlowMessage message = scene.message(at(i, 1.f), at(i + 1, 1.f), (i + 100) * kFrame, static_cast<unsigned>(i));
    raised = T::step(params, input_of(message), state).avoid != 0;
    ASSERT_LT(i, 140);
  }
  const FlowMessage earlier = scene.message(at(0, 1.f), at(1, 1.f), kFrame);
  const CueBody a = T::step(params, input_of(earlier), state), b = T::step(params, input_of(earlier), fresh);
  EXPECT_EQ(a.avoid, 0);
  EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0);
}

TEST(TimeToContactBehaviour, AllocatesNothingAndReplaysToTheBit) {
  static_assert(std::is_trivially_copyable_v<T::State>);
  const FlowScene scene = before_wall();
  const auto params = params_of(scene);
  T::State state(params);
  for (int i = 90; i < 130; ++i) {
    const FlowMessage message = scene.message(at(i, 1.f), at(i + 1, 1.f), (i + 1) * kFrame, static_cast<unsigned>(i));
    T::State copy = state;
    const wasp::test::MallocCount count;
    CueBody a, b;
    {
      const rt::RealtimeSection section;
      a = T::step(params, input_of(message), state);
      b = T::step(params, input_of(message), copy);
    }
    EXPECT_EQ(count.violations(), 0u);
    EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0);
  }
}

}  // namespace
}  // namespace wasp::vision
