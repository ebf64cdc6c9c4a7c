#include "vision/kernels/avoid_decision.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"

namespace wasp::vision {
namespace {

TEST(StudentT, MatchesPublishedTables) {
  // Two-sided 5 % and 1 % points.
  EXPECT_NEAR(student_t_two_sided(12.706, 1), 0.05, 1e-5);
  EXPECT_NEAR(student_t_two_sided(4.3027, 2), 0.05, 1e-5);
  EXPECT_NEAR(student_t_two_sided(3.1824, 3), 0.05, 1e-5);
  EXPECT_NEAR(student_t_two_sided(-5.8409, 3), 0.01, 1e-5);
  EXPECT_NEAR(student_t_two_sided(2.7764, 4), 0.05, 1e-5);
  EXPECT_NEAR(student_t_two_sided(2.2281, 10), 0.05, 1e-5);
  EXPECT_NEAR(student_t_two_sided(2.1314, 15), 0.05, 1e-5);
  EXPECT_EQ(student_t_two_sided(0.0, 3), 1.0);
  EXPECT_EQ(student_t_two_sided(std::numeric_limits<double>::infinity(), 3), 0.0);
  EXPECT_EQ(student_t_two_sided(std::nan(""), 3), 1.0);
  EXPECT_EQ(student_t_two_sided(5.0, 0), 1.0);
}

TEST(AvoidDecision, StraightApproachAvoidsOnceContactIsNear) {
  AvoidMonitor monitor;
  for (int frame = 0; frame <= 90; ++frame) {
    const auto decision = monitor.add(frame, 100.f - static_cast<float>(frame));
    EXPECT_EQ(decision.ready, frame >= 4);
    EXPECT_EQ(decision.avoid, frame >= 70) << frame;  // contact at frame 100, 30 frames ahead
    if (decision.ready) {
      EXPECT_NEAR(decision.contact_in_frames, 100.f - static_cast<float>(frame), 1e-3f);
      EXPECT_NEAR(decision.line.slope, -1.f, 1e-5f);
    }
  }
}

TEST(AvoidDecision, NoiseAloneAvoidsAboutAsOftenAsThePValueSays) {
  std::mt19937 random(8);
  std::normal_distribution<float> noise(0.f, 1.f);
  int significant = 0;
  constexpr int kRuns = 4000;
  for (int run = 0; run < kRuns; ++run) {
    AvoidMonitor monitor;
    AvoidDecision last;
    for (int frame = 0; frame < 5; ++frame) last = monitor.add(frame, 10.f + noise(random));
    significant += last.line.p_value < 0.05f ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(significant) / kRuns, 0.05, 0.0125);  // 3.6 sigma of a binomial
}

TEST(AvoidDecision, RecedingStillOrUntrustworthyDoesNotAvoid) {
  AvoidMonitor receding, still, wild;
  const float jumps[] = {12.f, 2.f, 15.f, 1.f, 9.f};
  for (int frame = 0; frame < 5; ++frame) {
    EXPECT_FALSE(receding.add(frame, 10.f + static_cast<float>(frame)).avoid);
    EXPECT_FALSE(still.add(frame, 10.f).avoid);
    EXPECT_FALSE(wild.add(frame, jumps[frame]).avoid);
  }
}

TEST(AvoidDecision, BadInputIsNotTaken) {
  AvoidMonitor monitor;
  for (int frame = 0; frame < 4; ++frame) monitor.add(frame, 20.f - static_cast<float>(frame));
  EXPECT_FALSE(monitor.add(4, std::numeric_limits<float>::quiet_NaN()).ready);
  EXPECT_FALSE(monitor.add(4, std::numeric_limits<float>::infinity()).ready);
  EXPECT_FALSE(monitor.add(3, 16.f).ready);  // not a later frame
  EXPECT_TRUE(monitor.add(4, 16.f).avoid);
  monitor.reset();
  EXPECT_FALSE(monitor.add(5, 15.f).ready);
  AvoidMonitor huge({.pairs = 1000});
  for (int frame = 0; frame < 100; ++frame) huge.add(frame, 50.f);
}

TEST(AvoidDecision, DoesNotAllocate) {
  AvoidMonitor monitor;
  bool avoided = false;
  const wasp::test::MallocCount count;
  {
    const rt::RealtimeSection section;
    for (int frame = 0; frame < 50; ++frame) avoided = monitor.add(frame, 60.f - static_cast<float>(frame)).avoid;
  }
  EXPECT_TRUE(avoided);
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
