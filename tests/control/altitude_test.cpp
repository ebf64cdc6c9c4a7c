// Altitude hold and height filter against a point mass on virtual time.
#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <random>

#include "control/altitude_hold.h"
#include "control/height_filter.h"

namespace wasp::control {
namespace {

/// Point mass under thrust with a first-order motor, a 30 Hz height sensor with delay and noise, a biased
/// accelerometer.
struct Loop {
  AltitudeHoldParams hold;
  HeightFilterParams filter;
  AltitudeHoldState hold_state;
  HeightFilterState filter_state;
  double height_m = 0.2, climb_mps = 0, thrust = 0, accel_mps2 = 0;
  double noise_m = 0.005, bias_mps2 = 0.15, thrust_error = 1.0;
  DurationNs delay_ns = 40 * kMillisecond;
  std::mt19937 random{3};

  /// Runs to `seconds`; returns the greatest |error| after `settle_s`.
  double run(double target_m, double seconds, double settle_s) {
    double worst = 0;
    std::deque<std::pair<TimeNs, double>> seen;
    std::normal_distribution<double> noise(0, noise_m);
    double command = 0;
    for (int i = 0; i < static_cast<int>(seconds * 1000); ++i) {
      t_ns += kMillisecond;
      thrust += (command * thrust_error - thrust) * 0.001 / 0.05;
      accel_mps2 = thrust * static_cast<double>(hold.full_thrust_n / hold.mass_kg) - 9.80665 - 0.3 * climb_mps;
      climb_mps += accel_mps2 * 0.001;
      height_m += climb_mps * 0.001;
      if (height_m < 0.2) height_m = 0.2, climb_mps = std::max(0.0, climb_mps), accel_mps2 = std::max(0.0, accel_mps2);
      if (i % 33 == 0) seen.emplace_back(t_ns, height_m + noise(random));
      if (i % 50 == 0) command = tick(target_m, seen);
      if (i > settle_s * 1000) worst = std::max(worst, std::fabs(height_m - target_m));
    }
    return worst;
  }
  double tick(double target_m, std::deque<std::pair<TimeNs, double>>& seen) {
    predict(filter, static_cast<float>(accel_mps2 + bias_mps2), t_ns, filter_state);
    while (!seen.empty() && seen.front().first + delay_ns <= t_ns) {
      correct(filter, static_cast<float>(seen.front().second), seen.front().first, t_ns, filter_state);
      seen.pop_front();
    }
    if (!filter_state.started) return 0;
    return static_cast<double>(altitude_hold_step(hold, static_cast<float>(target_m), filter_state.height_m,
                                                  filter_state.climb_rate_mps, 1.f, 0.05f, hold_state));
  }
  TimeNs t_ns = 0;
};

TEST(AltitudeHold, StepResponseSettlesWithoutLargeOvershoot) {
  Loop loop;
  EXPECT_LT(loop.run(0.5, 10, 5), 0.05);
  EXPECT_LT(loop.run(1.0, 10, 5), 0.05);
}

TEST(AltitudeHold, ThrustCalibrationErrorIsIntegratedAway) {
  Loop loop;
  loop.thrust_error = 0.93;
  EXPECT_LT(loop.run(0.8, 30, 20), 0.05);
}

TEST(AltitudeHold, WithoutDampingItSwingsAsTheThesisSaw) {
  Loop damped, printed;
  printed.hold.kd_nspm = 0;
  const double with = damped.run(1.0, 20, 8), without = printed.run(1.0, 20, 8);
  EXPECT_GT(without, 3 * with);
}

TEST(AltitudeHold, OutputStaysInRange) {
  AltitudeHoldParams p;
  AltitudeHoldState s;
  for (const float h : {-100.f, 0.f, 100.f, 1e20f})
    for (const float v : {-1e6f, 0.f, 1e6f}) {
      const float thrust = altitude_hold_step(p, 1.f, h, v, 0.9f, 0.05f, s);
      EXPECT_GE(thrust, 0.f);
      EXPECT_LE(thrust, 1.f);
    }
}

TEST(HeightFilter, CorrectsAtTheInstantOfExposure) {
  // Climbing at 1 m/s, heights arrive 100 ms late: the estimate must be the present height, not the old one.
  HeightFilterParams p;
  HeightFilterState s;
  for (int i = 0; i < 200; ++i) {
    const TimeNs now = i * 50 * kMillisecond;
    predict(p, 0.f, now, s);
    correct(p, static_cast<float>(to_seconds(now - 100 * kMillisecond)), now - 100 * kMillisecond, now, s);
  }
  EXPECT_NEAR(s.height_m, to_seconds(199 * 50 * kMillisecond), 0.01);
  EXPECT_NEAR(s.climb_rate_mps, 1.f, 0.01f);
}

TEST(HeightFilter, AJumpIsBelievedOnlyWhenItStays) {
  HeightFilterParams p;
  HeightFilterState s;
  correct(p, 1.f, 1, 1, s);
  TimeNs now = 0;
  for (int i = 1; i < p.jumps_to_accept; ++i) {
    now += 50 * kMillisecond;
    correct(p, 3.f, now, now, s);
  }
  EXPECT_NEAR(s.height_m, 1.f, 1e-3f);
  now += 50 * kMillisecond;
  correct(p, 3.f, now, now, s);
  EXPECT_NEAR(s.height_m, 3.f, 1e-3f);
}

TEST(HeightFilter, IgnoresOldAndNonFinite) {
  HeightFilterParams p;
  HeightFilterState s;
  correct(p, 1.f, 100, 100, s);
  correct(p, 1.2f, 100, 200, s);
  correct(p, std::nanf(""), 300, 300, s);
  EXPECT_FLOAT_EQ(s.height_m, 1.f);
  predict(p, std::nanf(""), 400, s);
  EXPECT_TRUE(std::isfinite(s.height_m));
}

}  // namespace
}  // namespace wasp::control
