// Attitude at an exposure: turned on by the rates it is nearer to the truth than the sample as it came.
#include "types/attitude_at.h"

#include <gtest/gtest.h>

#include <limits>

#include "types/frames.h"

namespace wasp {
namespace {

/// A vehicle that rocks about all three axes, as in an aggressive flight: up to 3 rad/s, 2 Hz.
class Rocking {
 public:
  Rocking() {  // the attitude has no closed form: integrated at 20 kHz
    std::array<double, 4> q{1, 0, 0, 0};
    for (std::size_t i = 0; i < kSteps; ++i) {
      q_.push_back(q);
      const auto w = rate((static_cast<double>(i) + 0.5) * kStep_s);
      const Eigen::Quaterniond now(q[0], q[1], q[2], q[3]);
      const Eigen::Vector3d v = Eigen::Vector3d(w[0], w[1], w[2]) * kStep_s;
      const Eigen::Quaterniond next =
          (now * Eigen::Quaterniond(Eigen::AngleAxisd(v.norm(), v.normalized()))).normalized();
      q = {next.w(), next.x(), next.y(), next.z()};
    }
  }
  [[nodiscard]] AttitudeSample at(double t_s) const {
    AttitudeSample s;
    s.exposed_at_ns = from_seconds(t_s + 1e-10);
    const auto& q = q_[static_cast<std::size_t>(std::lround(t_s / kStep_s))];
    const auto w = rate(t_s);
    for (std::size_t i = 0; i < 4; ++i) s.q_ned_body[i] = static_cast<float>(q[i]);
    for (std::size_t i = 0; i < 3; ++i) s.rate_body_radps[i] = static_cast<float>(w[i]);
    return s;
  }

 private:
  static std::array<double, 3> rate(double t_s) {
    return {3 * std::sin(12.6 * t_s), 2 * std::cos(9.0 * t_s), 1.5 * std::sin(5.0 * t_s + 1)};
  }
  static constexpr double kStep_s = 5e-5;
  static constexpr std::size_t kSteps = 41'000;
  std::vector<std::array<double, 4>> q_;
};

float angle_between(const AttitudeSample& a, const AttitudeSample& b) {
  const auto& p = a.q_ned_body;
  const auto& q = b.q_ned_body;
  return Quat(p[0], p[1], p[2], p[3]).angularDistance(Quat(q[0], q[1], q[2], q[3]));
}

TEST(AttitudeAt, InterpolatedRatesBeatHeldOnesWhichBeatTheSampleAsItCame) {
  const Rocking truth;
  float worst_as_it_came = 0, worst_held = 0, worst_between = 0;
  for (double t = 0.02; t < 1.9; t += 0.02)  // 50 samples a second
    for (double s = 0.001; s < 0.02; s += 0.001) {
      const AttitudeSample before = truth.at(t), after = truth.at(t + 0.02), wanted = truth.at(t + s);
      worst_as_it_came = std::max(worst_as_it_came, angle_between(before, wanted));
      worst_held = std::max(worst_held, angle_between(attitude_at(before, nullptr, wanted.exposed_at_ns), wanted));
      worst_between = std::max(worst_between, angle_between(attitude_at(before, &after, wanted.exposed_at_ns), wanted));
    }
  EXPECT_GT(worst_as_it_came, 0.04f);
  EXPECT_LT(worst_held, 0.2f * worst_as_it_came);
  EXPECT_LT(worst_between, 0.1f * worst_held);
}

TEST(AttitudeAt, RatesAreThoseOfTheInstant) {
  AttitudeSample before, after;
  before.rate_body_radps = {0, 1, 2};
  after.rate_body_radps = {4, 1, -2};
  after.exposed_at_ns = 20 * kMillisecond;
  const AttitudeSample out = attitude_at(before, &after, 5 * kMillisecond);
  EXPECT_EQ(out.exposed_at_ns, 5 * kMillisecond);
  EXPECT_FLOAT_EQ(out.rate_body_radps[0], 1.f);
  EXPECT_FLOAT_EQ(out.rate_body_radps[1], 1.f);
  EXPECT_FLOAT_EQ(out.rate_body_radps[2], 1.f);
}

TEST(AttitudeAt, TurnsAtMostFiftyMilliseconds) {
  AttitudeSample before, far;
  before.rate_body_radps = {1, 0, 0};
  far.exposed_at_ns = kSecond;  // too far away to say anything of the time between
  far.rate_body_radps = {100, 0, 0};
  for (const AttitudeSample* after :
       {static_cast<const AttitudeSample*>(nullptr), static_cast<const AttitudeSample*>(&far)}) {
    const AttitudeSample out = attitude_at(before, after, 800 * kMillisecond);
    EXPECT_NEAR(angle_between(before, out), 0.05f, 1e-5f);
    EXPECT_FLOAT_EQ(out.rate_body_radps[0], 1.f);
  }
}

TEST(AttitudeAt, NothingIsTurnedByRatesThatAreNoNumbersOrByTimeThatRunsBackwards) {
  AttitudeSample before;
  before.exposed_at_ns = kSecond;
  before.rate_body_radps = {std::numeric_limits<float>::quiet_NaN(), 0, 0};
  EXPECT_EQ(attitude_at(before, nullptr, kSecond + kMillisecond).q_ned_body, before.q_ned_body);
  before.rate_body_radps = {5, 5, 5};
  EXPECT_EQ(attitude_at(before, nullptr, 0).q_ned_body, before.q_ned_body);
}

}  // namespace
}  // namespace wasp
