#include "control/arbiter.h"

#include <gtest/gtest.h>

#include <limits>

namespace wasp::control {
namespace {

Cue height_cue(TimeNs exposed_at_ns, float height_m) {
  Cue c;
  c.exposed_at_ns = exposed_at_ns;
  c.body.validity = Validity::kValid;
  c.body.has_height = 1;
  c.body.height_m = height_m;
  return c;
}

struct ArbiterTest : ::testing::Test {
  ArbiterParams params;
  CueSet set;
  ArbiterTest() {
    params.behaviour_count = 3;
    params.rows[0].height_rank = 0;
    params.rows[1].height_rank = 1;
  }
  void give(std::size_t i, const Cue& cue) {
    set.cues[i] = cue;
    set.present[i] = true;
  }
};

TEST_F(ArbiterTest, TakesTheFirstSourceThatSees) {
  give(0, height_cue(0, 1.f));
  give(1, height_cue(0, 2.f));
  EXPECT_EQ(arbitrate(params, set, 1).height_source, 0);
  set.cues[0].body.validity = Validity::kBlind;
  EXPECT_EQ(arbitrate(params, set, 1).height_source, 1);
  set.cues[1].body.validity = Validity::kBlind;
  EXPECT_EQ(arbitrate(params, set, 1).height_source, -1);
}

TEST_F(ArbiterTest, AnOldCueIsAbsent) {
  give(0, height_cue(0, 1.f));
  EXPECT_EQ(arbitrate(params, set, params.rows[0].age_limit_ns).height_source, 0);
  EXPECT_EQ(arbitrate(params, set, params.rows[0].age_limit_ns + 1).height_source, -1);
}

TEST_F(ArbiterTest, ACueFromTheFutureIsAbsent) {
  give(0, height_cue(10 * kSecond, 1.f));
  EXPECT_EQ(arbitrate(params, set, 1).height_source, -1);
}

TEST_F(ArbiterTest, ACueMadeOverBudgetIsAbsent) {
  give(0, height_cue(0, 1.f));
  set.cues[0].over_budget = 1;
  EXPECT_EQ(arbitrate(params, set, 1).height_source, -1);
}

TEST_F(ArbiterTest, NothingNonFinitePasses) {
  for (float CueBody::*field :
       {&CueBody::height_m, &CueBody::height_sigma_m, &CueBody::heading_rate_radps, &CueBody::pitch_rad})
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
      give(0, height_cue(0, 1.f));
      set.cues[0].body.*field = bad;
      EXPECT_EQ(arbitrate(params, set, 1).height_source, -1);
    }
}

TEST_F(ArbiterTest, NothingAbsurdPassesInAnyField) {
  for (float CueBody::*field : {&CueBody::height_m, &CueBody::height_sigma_m, &CueBody::heading_rate_radps,
                                &CueBody::pitch_rad, &CueBody::velocity_forward_mps, &CueBody::velocity_right_mps,
                                &CueBody::velocity_sigma_mps, &CueBody::climb_mps, &CueBody::climb_1ps})
    for (const float bad : {1e30f, -1e30f, 2000.f, std::numeric_limits<float>::max(),
                            std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()}) {
      give(0, height_cue(0, 1.f));
      set.cues[0].body.*field = bad;
      EXPECT_EQ(arbitrate(params, set, 1).height_source, -1) << bad;
    }
}

TEST_F(ArbiterTest, ACueThatIsPublishedAgainAndAgainAgesByItsExposure) {
  give(0, height_cue(0, 1.f));
  for (TimeNs t = 0; t <= 300 * kMillisecond; t += 10 * kMillisecond) {
    set.cues[0].finished_at_ns = t;  // new in the ring, old in its evidence
    set.cues[0].step_index++;
    EXPECT_EQ(arbitrate(params, set, t).height_source, t <= params.rows[0].age_limit_ns ? 0 : -1) << t;
  }
}

TEST_F(ArbiterTest, FramesComeWhileAnyCueIsRecentBeItBlind) {
  EXPECT_FALSE(arbitrate(params, set, 1).images);
  give(2, Cue{});
  EXPECT_TRUE(arbitrate(params, set, 1).images);
  EXPECT_FALSE(arbitrate(params, set, params.rows[2].age_limit_ns + 1).images);
}

TEST_F(ArbiterTest, ABehaviourThatWasSwitchedOffIsAbsentButItsAvoidIsHeard) {
  params.rows[0].heading_weight = 1.f;
  Cue cue = height_cue(0, 1.f);
  cue.body.has_heading_rate = 1;
  cue.body.heading_rate_radps = 0.5f;
  give(0, cue);
  give(1, height_cue(0, 2.f));
  set.off[0] = true;
  Intention out = arbitrate(params, set, 1);
  EXPECT_EQ(out.height_source, 1);
  EXPECT_FALSE(out.steered);
  EXPECT_EQ(out.heading_rate_radps, 0.f);
  EXPECT_FALSE(out.avoid);
  set.cues[0].body.avoid = 1;
  out = arbitrate(params, set, 1);
  EXPECT_TRUE(out.avoid);
  EXPECT_FALSE(out.steered);
}

TEST_F(ArbiterTest, AvoidForbidsForwardPitch) {
  Cue forward;
  forward.body.validity = Validity::kValid;
  forward.body.has_pitch = 1;
  forward.body.pitch_rad = -0.1f;
  params.rows[2].pitch_weight = 1.f;
  give(2, forward);
  EXPECT_FLOAT_EQ(arbitrate(params, set, 1).pitch_rad, -0.1f);
  Cue avoid = height_cue(0, 1.f);
  avoid.body.avoid = 1;
  give(0, avoid);
  EXPECT_TRUE(arbitrate(params, set, 1).avoid);
  EXPECT_FLOAT_EQ(arbitrate(params, set, 1).pitch_rad, 0.f);
}

TEST_F(ArbiterTest, AnAvoidIsHeardFromACueThatIsOtherwiseUnusable) {
  Cue avoid;
  avoid.exposed_at_ns = 10;
  avoid.body.avoid = 1;
  for (const int fault : {0, 1, 2}) {
    Cue cue = avoid;
    cue.body.validity = fault == 0 ? Validity::kBlind : Validity::kValid;
    cue.over_budget = fault == 1 ? 1 : 0;
    cue.body.climb_mps = fault == 2 ? std::numeric_limits<float>::quiet_NaN() : 0.f;
    give(2, cue);
    ASSERT_FALSE(usable(cue, params.rows[2], 20)) << fault;
    const Intention out = arbitrate(params, set, 20);
    EXPECT_TRUE(out.avoid) << fault;
    EXPECT_EQ(out.oldest_exposed_at_ns, 10) << fault;
    EXPECT_EQ(out.usable_until_ns, 10 + params.rows[2].age_limit_ns) << fault;
  }
}

TEST_F(ArbiterTest, NothingElseOfACueThatAvoidsIsTakenUnlessItIsUsable) {
  params.rows[0].heading_weight = 1.f;
  Cue cue = height_cue(10, 1.f);
  cue.body.avoid = cue.body.has_heading_rate = 1;
  cue.body.heading_rate_radps = 0.5f;
  cue.over_budget = 1;
  give(0, cue);
  const Intention out = arbitrate(params, set, 20);
  EXPECT_TRUE(out.avoid);
  EXPECT_EQ(out.height_source, -1);
  EXPECT_FALSE(out.steered);
  EXPECT_EQ(out.heading_rate_radps, 0.f);
}

TEST_F(ArbiterTest, AnAvoidThatIsTooOldFromTheFutureOrNeverExposedIsNone) {
  Cue avoid;
  avoid.body.avoid = 1;
  for (const TimeNs exposed_at_ns : {kSecond - params.rows[2].age_limit_ns - 1, 10 * kSecond, kNever}) {
    avoid.exposed_at_ns = exposed_at_ns;
    give(2, avoid);
    EXPECT_FALSE(arbitrate(params, set, kSecond).avoid) << exposed_at_ns;
  }
  avoid.exposed_at_ns = kSecond - params.rows[2].age_limit_ns;
  give(2, avoid);
  EXPECT_TRUE(arbitrate(params, set, kSecond).avoid);
  set.present[2] = false;
  EXPECT_FALSE(arbitrate(params, set, kSecond).avoid);
}

TEST_F(ArbiterTest, ASourceThatIsOverItsBudgetAtThisMomentIsAskedLastButNotForgotten) {
  give(0, height_cue(0, 1.f));
  set.overdue[0] = true;
  EXPECT_EQ(arbitrate(params, set, 1).height_source, 0);  // its last cue was made in time and is not old
  give(1, height_cue(0, 2.f));
  EXPECT_EQ(arbitrate(params, set, 1).height_source, 1);
  set.overdue[1] = true;
  EXPECT_EQ(arbitrate(params, set, 1).height_source, 0);
}

TEST_F(ArbiterTest, AnIntentionLastsUntilTheFirstOfItsCuesIsTooOld) {
  params.rows[1].heading_weight = 1.f;
  params.rows[0].age_limit_ns = 100;
  params.rows[1].age_limit_ns = 20;
  give(0, height_cue(10, 1.f));
  give(1, height_cue(50, 1.f));
  EXPECT_EQ(arbitrate(params, set, 60).usable_until_ns, 70);
  params.rows[1].heading_weight = 0.f;  // not used: its age does not matter
  EXPECT_EQ(arbitrate(params, set, 60).usable_until_ns, 110);
  EXPECT_EQ(arbitrate(params, {}, 60).usable_until_ns, kForever);
}

TEST_F(ArbiterTest, EvidenceIsTheOldestUsed) {
  params.rows[1].heading_weight = 1.f;
  give(0, height_cue(50, 1.f));
  give(1, height_cue(20, 1.f));
  EXPECT_EQ(arbitrate(params, set, 60).oldest_exposed_at_ns, 20);
}

}  // namespace
}  // namespace wasp::control
