// Each attitude.* and imu.* point does to the samples what its row says; without a board nothing changes.
#include "scheduling/sample_faults.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace wasp::scheduling {
namespace {

constexpr DurationNs kStep = 10 * kMillisecond;  // 100 Hz

class SampleFaultsTest : public ::testing::Test {
 protected:
  SampleFaultsTest() { faults_.use(&board_); }
  void set(FaultPoint point, float value) { board_.set(point, 0, INT64_MAX, value); }
  void set(FaultPoint point) { set(point, row_of(point).value); }
  static AttitudeSample attitude(int i) {
    AttitudeSample s;
    s.exposed_at_ns = i * kStep;
    s.sequence = static_cast<std::uint32_t>(i);
    s.q_ned_body = {std::cos(0.01f * static_cast<float>(i)), 0, std::sin(0.01f * static_cast<float>(i)), 0};
    s.rate_body_radps = {0, static_cast<float>(i), 0};
    return s;
  }
  static ImuSample imu(int i) {
    ImuSample s;
    s.exposed_at_ns = i * kStep;
    s.sequence = static_cast<std::uint32_t>(i);
    s.accel_body_mps2 = {0, static_cast<float>(i), -9.81f};
    s.pressure_hpa = 1000;
    return s;
  }
  template <class Sample>
  static bool same(const Sample& a, const Sample& b) {
    return std::memcmp(&a, &b, sizeof a) == 0;
  }
  static float norm(const std::array<float, 4>& q) {
    return std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  }
  FaultBoard board_;
  SampleFaults faults_;
};

TEST_F(SampleFaultsTest, WithoutAFaultOrABoardSamplesPassUnchanged) {
  SampleFaults none;
  for (SampleFaults* faults : {&none, &faults_})
    for (int i = 0; i < 100; ++i) {
      AttitudeSample a = attitude(i);
      ImuSample m = imu(i);
      ASSERT_TRUE(faults->pass(a, i * kStep) && faults->pass(m, i * kStep));
      EXPECT_TRUE(same(a, attitude(i)) && same(m, imu(i)));
    }
}

TEST_F(SampleFaultsTest, StopKeepsBackEverySampleOfItsOwnKind) {
  set(FaultPoint::kAttitudeStop);
  AttitudeSample a = attitude(1);
  ImuSample m = imu(1);
  EXPECT_FALSE(faults_.pass(a, kStep));
  EXPECT_TRUE(faults_.pass(m, kStep));
  board_.clear(FaultPoint::kAttitudeStop);
  set(FaultPoint::kImuStop);
  EXPECT_TRUE(faults_.pass(a, kStep));
  EXPECT_FALSE(faults_.pass(m, kStep));
}

TEST_F(SampleFaultsTest, FreezeShowsOldValuesUnderNewStamps) {
  set(FaultPoint::kAttitudeFreeze);
  set(FaultPoint::kImuFreeze);
  for (int i = 5; i < 10; ++i) {
    AttitudeSample a = attitude(i);
    ImuSample m = imu(i);
    ASSERT_TRUE(faults_.pass(a, i * kStep) && faults_.pass(m, i * kStep));
    EXPECT_EQ(a.exposed_at_ns, i * kStep);
    EXPECT_EQ(m.sequence, static_cast<std::uint32_t>(i));
    EXPECT_EQ(a.q_ned_body, attitude(5).q_ned_body);
    EXPECT_EQ(a.rate_body_radps, attitude(5).rate_body_radps);
    EXPECT_EQ(m.accel_body_mps2, imu(5).accel_body_mps2);
  }
  board_.clear(FaultPoint::kAttitudeFreeze);
  AttitudeSample a = attitude(10);
  faults_.pass(a, 10 * kStep);
  EXPECT_TRUE(same(a, attitude(10)));
  set(FaultPoint::kAttitudeFreeze);  // a second freeze has a value of its own
  a = attitude(11);
  faults_.pass(a, 11 * kStep);
  EXPECT_TRUE(same(a, attitude(11)));
}

TEST_F(SampleFaultsTest, SlowLetsNoMoreSamplesThrough) {
  set(FaultPoint::kAttitudeSlow, 10);
  set(FaultPoint::kImuSlow, 20);
  int attitudes = 0, imus = 0;
  for (int i = 100; i < 200; ++i) {
    AttitudeSample a = attitude(i);
    ImuSample m = imu(i);
    attitudes += faults_.pass(a, i * kStep);
    imus += faults_.pass(m, i * kStep);
  }
  EXPECT_EQ(attitudes, 10);
  EXPECT_EQ(imus, 20);
}

TEST_F(SampleFaultsTest, SpikesComeNowAndThenAndAttitudesStayRotations) {
  set(FaultPoint::kAttitudeSpike);
  set(FaultPoint::kImuSpike);
  int attitudes = 0, imus = 0;
  for (int i = 0; i < 1000; ++i) {
    AttitudeSample a = attitude(i);
    ImuSample m = imu(i);
    ASSERT_TRUE(faults_.pass(a, i * kStep) && faults_.pass(m, i * kStep));
    EXPECT_NEAR(norm(a.q_ned_body), 1.f, 1e-5f);
    if (!same(a, attitude(i))) {
      ++attitudes;
      EXPECT_NEAR(std::abs(a.q_ned_body[0] / attitude(i).q_ned_body[0]), 0.5f, 1e-3f);  // cos(120 deg / 2)
      EXPECT_GT(a.rate_body_radps[0], 100.f);
    }
    if (!same(m, imu(i))) {
      ++imus;
      int huge = 0;
      for (std::size_t k = 0; k < 3; ++k) huge += m.accel_body_mps2[k] == 1000.f && m.gyro_body_radps[k] == 1000.f;
      EXPECT_EQ(huge, 1);
    }
  }
  EXPECT_NEAR(attitudes, 100, 40);
  EXPECT_NEAR(imus, 100, 40);
}

TEST_F(SampleFaultsTest, NanBiasAndStampsAreAsTheyAreCalled) {
  AttitudeSample a = attitude(0);
  set(FaultPoint::kAttitudeBias, 10);
  ASSERT_TRUE(faults_.pass(a, 0));
  EXPECT_NEAR(a.q_ned_body[1], std::sin(5.f * 3.14159265f / 180.f), 1e-6f);
  board_.clear(FaultPoint::kAttitudeBias);
  set(FaultPoint::kAttitudeNan);
  a = attitude(1);
  faults_.pass(a, kStep);
  for (const float x : a.q_ned_body) EXPECT_TRUE(std::isnan(x));
  board_.clear(FaultPoint::kAttitudeNan);
  set(FaultPoint::kAttitudeStampAhead, 700);
  a = attitude(2);
  faults_.pass(a, 2 * kStep);
  EXPECT_EQ(a.exposed_at_ns, 2 * kStep + 700 * kMillisecond);
  board_.clear(FaultPoint::kAttitudeStampAhead);
  set(FaultPoint::kAttitudeStampBack, 700);
  a = attitude(3);
  faults_.pass(a, 3 * kStep);
  EXPECT_EQ(a.exposed_at_ns, 3 * kStep - 700 * kMillisecond);
  set(FaultPoint::kImuBias, 2);
  ImuSample m = imu(3);
  faults_.pass(m, 3 * kStep);
  EXPECT_FLOAT_EQ(m.accel_body_mps2[2], -7.81f);
  set(FaultPoint::kImuNan);
  m = imu(4);
  faults_.pass(m, 4 * kStep);
  EXPECT_TRUE(std::isnan(m.accel_body_mps2[0]) && std::isnan(m.gyro_body_radps[2]) && std::isnan(m.pressure_hpa));
}

}  // namespace
}  // namespace wasp::scheduling
