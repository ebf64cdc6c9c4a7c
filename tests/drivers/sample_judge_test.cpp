// Samples that must not be used: not finite, beyond a sensor, jumping, frozen, misdated - and those that must.
#include "drivers/sample_judge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace wasp::drivers {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();

struct ImuJudgeTest : ::testing::Test {
  ImuJudge judge;
  TimeNs now_ns = 1000 * kSecond;
  std::mt19937 random{1};
  float noise() { return std::normal_distribution<float>(0.f, 0.05f)(random); }
  ImuSample next(DurationNs later_ns = 5 * kMillisecond) {
    now_ns += later_ns;
    ImuSample s;
    s.exposed_at_ns = now_ns - 2 * kMillisecond;
    s.accel_body_mps2 = {noise(), noise(), noise() - 9.81f};
    s.gyro_body_radps = {noise(), noise(), noise()};
    return s;
  }
  SampleFault give(DurationNs later_ns = 5 * kMillisecond) {
    const ImuSample s = next(later_ns);
    return judge.judge(s, now_ns);
  }
};

TEST_F(ImuJudgeTest, ALivingSensorPassesAtAnyRate) {
  for (const DurationNs period_ns : {1 * kMillisecond, 5 * kMillisecond, 100 * kMillisecond})
    for (int i = 0; i < 200; ++i) EXPECT_EQ(give(period_ns), SampleFault::kNone);
}

TEST_F(ImuJudgeTest, NothingThatIsNotFiniteOrBeyondTheSensorPassesInAnyField) {
  for (const float bad : {kNan, kInf, -kInf, 1e30f, 170.f, -400.f})
    for (std::size_t k = 0; k < 3; ++k) {
      ImuSample s = next();
      s.accel_body_mps2[k] = bad;
      EXPECT_EQ(judge.judge(s, now_ns), std::isfinite(bad) ? SampleFault::kOutOfRange : SampleFault::kNotFinite);
      s = next();
      s.gyro_body_radps[k] = bad;
      EXPECT_EQ(judge.judge(s, now_ns), std::isfinite(bad) ? SampleFault::kOutOfRange : SampleFault::kNotFinite);
      EXPECT_EQ(give(), SampleFault::kNone);
    }
}

TEST_F(ImuJudgeTest, ValuesThatRepeatForATenthOfASecondCountAsStoppedUntilTheyChange) {
  ImuSample s = next();
  ASSERT_EQ(judge.judge(s, now_ns), SampleFault::kNone);
  const TimeNs first_ns = now_ns;
  for (int i = 0; i < 100; ++i) {
    now_ns += 5 * kMillisecond;
    s.exposed_at_ns = now_ns - 2 * kMillisecond;
    const bool frozen = now_ns - first_ns >= FreezeWatch::kFrozenFor;
    EXPECT_EQ(judge.judge(s, now_ns), frozen ? SampleFault::kFrozen : SampleFault::kNone) << i;
  }
  EXPECT_EQ(give(), SampleFault::kNone);
}

TEST_F(ImuJudgeTest, TwoEqualReadingsFarApartAreNoFreeze) {
  ImuSample s = next();
  ASSERT_EQ(judge.judge(s, now_ns), SampleFault::kNone);
  for (int i = 0; i < 2; ++i) {
    s.exposed_at_ns = now_ns += 100 * kMillisecond;
    EXPECT_EQ(judge.judge(s, now_ns), SampleFault::kNone);
  }
}

TEST_F(ImuJudgeTest, TimesNeverRunAheadOfTheArrivalNorBehindWhatWasUsed) {
  ImuSample s = next();
  ASSERT_EQ(judge.judge(s, now_ns), SampleFault::kNone);
  const TimeNs used_ns = s.exposed_at_ns;
  s = next();
  s.exposed_at_ns = now_ns + 1;
  EXPECT_EQ(judge.judge(s, now_ns), SampleFault::kMisdated);
  s = next();
  s.exposed_at_ns = used_ns - 1;
  EXPECT_EQ(judge.judge(s, now_ns), SampleFault::kMisdated);
  s = next();
  s.exposed_at_ns = used_ns;  // two that arrived together, before the clocks were matched
  EXPECT_EQ(judge.judge(s, now_ns), SampleFault::kNone);
  EXPECT_EQ(give(), SampleFault::kNone);
}

struct AttitudeJudgeTest : ::testing::Test {
  AttitudeJudge judge;
  TimeNs now_ns = 1000 * kSecond;
  float yaw_rad = 0.3f, rate_radps = 0;
  std::mt19937 random{1};
  AttitudeSample next(DurationNs later_ns = 10 * kMillisecond) {
    now_ns += later_ns;
    yaw_rad += rate_radps * static_cast<float>(to_seconds(later_ns));
    AttitudeSample s;
    s.exposed_at_ns = now_ns - 2 * kMillisecond;
    const float noisy_rad = yaw_rad + std::normal_distribution<float>(0.f, 0.002f)(random);
    s.q_ned_body = {std::cos(noisy_rad / 2), 0, 0, std::sin(noisy_rad / 2)};
    s.rate_body_radps = {0, 0, rate_radps};
    return s;
  }
  SampleFault give(DurationNs later_ns = 10 * kMillisecond) {
    const AttitudeSample s = next(later_ns);
    return judge.judge(s, now_ns);
  }
};

TEST_F(AttitudeJudgeTest, FastTurnsPassAtFullAndAtATwentiethOfTheRate) {
  for (const DurationNs period_ns : {5 * kMillisecond, 10 * kMillisecond, 100 * kMillisecond})
    for (const float rate : {0.f, 3.f, -6.f}) {
      judge = AttitudeJudge{};
      rate_radps = rate;
      for (int i = 0; i < 100; ++i) EXPECT_EQ(give(period_ns), SampleFault::kNone) << rate;
    }
}

TEST_F(AttitudeJudgeTest, ASpikeIsRefusedAndTheNextGoodSamplePasses) {
  ASSERT_EQ(give(), SampleFault::kNone);
  for (int i = 0; i < 50; ++i) {
    yaw_rad += 1.f;
    EXPECT_EQ(give(), SampleFault::kJump);
    yaw_rad -= 1.f;
    EXPECT_EQ(give(), SampleFault::kNone);
  }
}

TEST_F(AttitudeJudgeTest, ASpikeThatBringsTheRatesToExplainItIsOneAllTheSame) {
  ASSERT_EQ(give(), SampleFault::kNone);
  for (const float angle_rad : {0.25f, 0.3f}) {
    yaw_rad += angle_rad;
    rate_radps = angle_rad / 0.01f;  // there within one sample
    AttitudeSample s = next(0);
    now_ns += 10 * kMillisecond;
    s.exposed_at_ns = now_ns;
    EXPECT_EQ(judge.judge(s, now_ns), SampleFault::kJump);
    yaw_rad -= angle_rad;
    rate_radps = 0;
    EXPECT_EQ(give(), SampleFault::kNone);
  }
}

TEST_F(AttitudeJudgeTest, SpikesThatAgreeWithNothingNeverPass) {
  ASSERT_EQ(give(), SampleFault::kNone);
  const float true_rad = yaw_rad;
  for (int i = 0; i < 40; ++i) {  // within 0.5 s of the last good one
    yaw_rad = true_rad + 0.8f + 1.1f * static_cast<float>(i % 3);
    EXPECT_EQ(give(), SampleFault::kJump) << i;
  }
}

TEST_F(AttitudeJudgeTest, AResetOfTheEstimatorsYawIsTakenAfterFiveSamplesThatAgree) {
  ASSERT_EQ(give(), SampleFault::kNone);
  yaw_rad += 2.f;
  for (int i = 0; i < AttitudeJudge::kAgree - 1; ++i) EXPECT_EQ(give(), SampleFault::kJump);
  for (int i = 0; i < 50; ++i) EXPECT_EQ(give(), SampleFault::kNone);
}

TEST_F(AttitudeJudgeTest, AfterALongSilenceWhateverComesIsTaken) {
  ASSERT_EQ(give(), SampleFault::kNone);
  yaw_rad += 2.f;
  EXPECT_EQ(give(AttitudeJudge::kLongGap + kMillisecond), SampleFault::kNone);
}

TEST_F(AttitudeJudgeTest, NothingThatIsNoAttitudePasses) {
  ASSERT_EQ(give(), SampleFault::kNone);
  for (const float bad : {kNan, kInf, 3.f})
    for (std::size_t k = 0; k < 4; ++k) {
      AttitudeSample s = next();
      s.q_ned_body[k] = bad;
      EXPECT_EQ(judge.judge(s, now_ns), std::isfinite(bad) ? SampleFault::kOutOfRange : SampleFault::kNotFinite);
      s = next();
      s.rate_body_radps[k % 3] = 20 * bad;
      EXPECT_EQ(judge.judge(s, now_ns), std::isfinite(bad) ? SampleFault::kOutOfRange : SampleFault::kNotFinite);
    }
  AttitudeSample zero = next();
  zero.q_ned_body = {};
  EXPECT_EQ(judge.judge(zero, now_ns), SampleFault::kOutOfRange);
  EXPECT_EQ(give(), SampleFault::kNone);
}

TEST_F(AttitudeJudgeTest, AFrozenAttitudeCountsAsStoppedWithinATenthOfASecond) {
  AttitudeSample s = next();
  ASSERT_EQ(judge.judge(s, now_ns), SampleFault::kNone);
  const TimeNs first_ns = now_ns;
  TimeNs used_ns = s.exposed_at_ns;
  for (int i = 0; i < 100; ++i) {
    now_ns += 10 * kMillisecond;
    s.exposed_at_ns = now_ns - 2 * kMillisecond;
    if (judge.judge(s, now_ns) == SampleFault::kNone) used_ns = s.exposed_at_ns;
  }
  EXPECT_LE(used_ns - first_ns, FreezeWatch::kFrozenFor);
  EXPECT_EQ(give(), SampleFault::kNone);
}

TEST_F(AttitudeJudgeTest, TimesNeverRunAheadOfTheArrivalNorBehindWhatWasUsed) {
  ASSERT_EQ(give(), SampleFault::kNone);
  AttitudeSample s = next();
  s.exposed_at_ns = now_ns + kSecond;
  EXPECT_EQ(judge.judge(s, now_ns), SampleFault::kMisdated);
  s = next();
  s.exposed_at_ns = now_ns - kSecond;
  EXPECT_EQ(judge.judge(s, now_ns), SampleFault::kMisdated);
  EXPECT_EQ(give(), SampleFault::kNone);
}

}  // namespace
}  // namespace wasp::drivers
