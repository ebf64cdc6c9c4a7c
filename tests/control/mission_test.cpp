#include "control/mission.h"

#include <gtest/gtest.h>

#include <vector>

namespace wasp::control {
namespace {

MissionParams two_legs() {
  MissionParams p;
  p.leg_count = 2;
  p.legs = {HoverLeg{0.5f, 4.f}, HoverLeg{1.0f, 4.f}};
  return p;
}

/// A vehicle that obeys at once: armed when asked, at the target height.
struct Obedient {
  MissionParams params = two_legs();
  MissionState state;
  MissionInput input;
  std::vector<MissionPhase> phases;

  MissionWish step() {
    const MissionWish wish = mission_step(params, input, state);
    input.now_ns += 50 * kMillisecond;
    if (wish.armed) input.armed = input.follows = true;
    if (wish.disarm) input.armed = false;
    if (wish.rotors) input.height_m = std::max(0.2f, wish.target_m);
    if (phases.empty() || phases.back() != state.phase) phases.push_back(state.phase);
    return wish;
  }
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) step();
  }
};

Obedient standing() {
  Obedient v;
  v.input.ground_seen = true;
  v.input.height_m = 0.2f;
  return v;
}

TEST(Mission, FliesEveryLegLandsAndDisarms) {
  Obedient v = standing();
  v.run(400);
  const auto leg = [](int i) { return static_cast<MissionPhase>(static_cast<int>(MissionPhase::kLeg0) + i); };
  EXPECT_EQ(v.phases, (std::vector<MissionPhase>{MissionPhase::kArm, leg(0), leg(1), MissionPhase::kLand,
                                                 MissionPhase::kDisarm, MissionPhase::kDone}));
  EXPECT_FALSE(v.input.armed);
}

TEST(Mission, StopRequestLandsInOrder) {
  Obedient v = standing();
  v.run(60);
  ASSERT_EQ(leg_of(v.state.phase), 0);
  v.input.stop_requested = true;
  v.run(100);
  EXPECT_EQ(v.state.phase, MissionPhase::kDone);
}

TEST(Mission, DisarmedInFlightItNeverArmsAgain) {
  Obedient v = standing();
  v.run(60);
  v.input.armed = false;
  for (int i = 0; i < 200; ++i) {
    const MissionWish wish = v.step();
    if (i > 0) {
      EXPECT_FALSE(wish.armed);
      EXPECT_FALSE(wish.rotors);
    }
  }
  EXPECT_EQ(v.state.phase, MissionPhase::kBroken);
}

TEST(Mission, AsksForNoArmingWhileSomethingOfOursIsAmiss) {
  Obedient v = standing();
  v.input.may_arm = false;
  v.run(20);
  EXPECT_EQ(v.state.phase, MissionPhase::kWait);
  EXPECT_FALSE(v.input.armed);
  v.input.may_arm = true;
  EXPECT_FALSE(v.step().armed);
  ASSERT_EQ(v.state.phase, MissionPhase::kArm);
  v.input.may_arm = false;  // it came while the autopilot was being asked
  EXPECT_FALSE(v.step().armed);
  v.input.may_arm = true;
  EXPECT_TRUE(v.step().armed);
  v.input.may_arm = false;  // in the air it bars nothing: a landing needs the rotors
  v.run(20);
  EXPECT_EQ(leg_of(v.state.phase), 0);
}

/// Whatever an autopilot does after the flight began, nothing of ours asks to arm again.
TEST(Mission, HavingFlownItNeverAsksToArmAgainWhateverTheAutopilotDoes) {
  for (unsigned pattern = 0; pattern < 256; ++pattern) {
    Obedient v = standing();
    v.run(30);
    ASSERT_EQ(leg_of(v.state.phase), 0);
    for (int i = 0; i < 400; ++i) {
      v.input.armed = (pattern >> (i / 8 % 8) & 1) != 0;
      v.input.follows = (pattern >> (i / 5 % 8) & 1) != 0;
      v.input.heard = i % 11 != 0;
      mission_step(v.params, v.input, v.state);
      v.input.now_ns += 50 * kMillisecond;
      EXPECT_NE(v.state.phase, MissionPhase::kArm);
      EXPECT_NE(v.state.phase, MissionPhase::kWait);
    }
  }
}

TEST(Mission, ALandingThatNeverEndsIsBrokenOff) {
  Obedient v = standing();
  v.run(60);
  v.input.stop_requested = true;
  v.run(1);
  v.input.ground_seen = false;
  v.run(61 * 20);
  EXPECT_EQ(v.state.phase, MissionPhase::kBroken);
  EXPECT_EQ(v.state.early_end, EarlyEnd::kNoGround);
}

/// A height that drifts, as an autopilot's own estimate does: the ground is not where it was.
TEST(Mission, WhatDoesNotMoveThoughAskedDownStands) {
  Obedient v = standing();
  v.run(60);
  v.input.stop_requested = true;
  for (int i = 0; i < 20 && v.state.phase != MissionPhase::kLand; ++i) v.step();
  ASSERT_EQ(v.state.phase, MissionPhase::kLand);
  for (int i = 0; i < 40; ++i) {  // two seconds of sinking, then 0.3 m above where it started from
    v.step();
    v.input.height_m = std::max(0.5f, 0.9f - 0.01f * static_cast<float>(i));
    ASSERT_EQ(v.state.phase, MissionPhase::kLand);
  }
  for (int i = 0; i < 70 && v.state.phase == MissionPhase::kLand; ++i) {
    v.step();
    v.input.height_m = i % 2 == 0 ? 0.5f : 0.52f;
  }
  EXPECT_EQ(v.state.phase, MissionPhase::kDisarm);
}

TEST(Mission, GivesUpWhenTheGroundIsNeverSeen) {
  Obedient v;
  v.run(static_cast<int>(v.params.patience_s * 20) + 10);
  EXPECT_EQ(v.state.phase, MissionPhase::kBroken);
  EXPECT_FALSE(v.input.armed);
  EXPECT_EQ(v.state.early_end, EarlyEnd::kNoPatience);
}

TEST(Mission, SaysWhyItEndedEarly) {
  Obedient found;
  found.input.ground_seen = found.input.heard = found.input.armed = true;
  found.run(2);
  EXPECT_EQ(found.state.early_end, EarlyEnd::kFoundArmed);
  Obedient stopped = standing();
  stopped.run(60);
  stopped.input.stop_requested = true;
  stopped.run(2);
  EXPECT_EQ(stopped.state.phase, MissionPhase::kLand);
  EXPECT_EQ(stopped.state.early_end, EarlyEnd::kStopped);
  Obedient whole = standing();
  whole.run(400);
  EXPECT_EQ(whole.state.phase, MissionPhase::kDone);
  EXPECT_EQ(whole.state.early_end, EarlyEnd::kNone);
  EXPECT_STREQ(name_of(EarlyEnd::kNotDisarming), "the autopilot did not disarm");
}

}  // namespace
}  // namespace wasp::control
