// Height from air pressure: which pressures count, and what its zero is learned from.
#include "control/barometer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "control/control_step.h"

namespace wasp::control {
namespace {

float pressure_at(float altitude_m) { return 1013.25f * std::pow(1.f - altitude_m / 44330.77f, 1.f / 0.190263f); }

ImuSample sample(float pressure_hpa, std::uint32_t fields) {
  ImuSample s;
  s.pressure_hpa = pressure_hpa;
  s.fields = fields;
  return s;
}

TEST(PressureMean, CountsOnlySamplesThatCarryAPressure) {
  PressureMean mean;
  mean.add(sample(1000.f, kImuHasPressure));
  mean.add(sample(0.f, 0x3f));    // accelerometer and gyroscope alone
  mean.add(sample(500.f, 0x3f));  // a number without its bit
  mean.add(sample(0.f, kImuHasPressure));
  mean.add(sample(-3.f, kImuHasPressure));
  mean.add(sample(std::numeric_limits<float>::quiet_NaN(), kImuHasPressure));
  mean.add(sample(std::numeric_limits<float>::infinity(), kImuHasPressure));
  mean.add(sample(1002.f, kImuHasPressure | 0x3f));
  EXPECT_FLOAT_EQ(mean.take(), 1001.f);
  EXPECT_EQ(mean.take(), 0.f);  // taken
}

struct Barometer : ::testing::Test {
  BarometerParams params{.enabled = true};
  BarometerState state;
  float height_m = 0;
  bool step(float altitude_m, bool seen, float seen_m = 0, bool standing = false) {
    return barometer_step(params, pressure_at(altitude_m), standing, seen, seen_m, state, height_m);
  }
};

TEST_F(Barometer, ItsZeroFollowsWhatIsSeenAndStaysWhenNothingIs) {
  for (int i = 0; i < 200; ++i) step(100.f, true, 1.f);
  for (int i = 0; i < 200; ++i) step(101.f, true, 1.f);  // weather
  EXPECT_NEAR(state.zero_m, 100.f, 0.05f);
  for (int i = 0; i < 200; ++i) step(103.f, false);
  EXPECT_NEAR(state.zero_m, 100.f, 0.05f);
  EXPECT_NEAR(height_m, 3.f, 0.1f);
}

TEST_F(Barometer, AJumpIsNotLearned) {
  for (int i = 0; i < 100; ++i) step(100.f, true, 1.f);
  for (int i = 0; i < params.jumps_to_accept - 1; ++i) step(100.f + params.max_jump_m + 1.f, true, 1.f);
  EXPECT_NEAR(state.zero_m, 99.f, 0.05f);
  step(100.f, true, 1.f);
  for (int i = 0; i < params.jumps_to_accept - 1; ++i) step(100.f + params.max_jump_m + 1.f, true, 1.f);
  EXPECT_NEAR(state.zero_m, 99.f, 0.05f);  // the one between broke the row
}

TEST_F(Barometer, AZeroThatBeganWrongIsGivenUpOnceTheJumpStays) {
  step(900.f, true, 1.f);
  for (int i = 0; i < params.jumps_to_accept; ++i) step(100.f, true, 1.f);
  EXPECT_NEAR(state.zero_m, 99.f, 0.05f);
}

TEST_F(Barometer, WithoutABelievablePressureThereIsNoHeight) {
  for (const float bad : {0.f, 299.f, 1201.f, std::numeric_limits<float>::quiet_NaN()})
    EXPECT_FALSE(barometer_step(params, bad, true, true, 1.f, state, height_m));
  EXPECT_FALSE(state.started);
}

TEST(BarometerInControl, CuesThatComeLateDoNotTeachAZeroThatLags) {
  ControlParams p;
  p.arbiter.behaviour_count = 1;
  p.arbiter.rows[0] = {.age_limit_ns = 250 * kMillisecond, .height_rank = 0};
  p.barometer.enabled = true;
  p.mission.leg_count = 1;
  ControlState state;
  ControlInput in;
  in.attitude_present = in.accel_present = true;
  in.accel_body_mps2 = {0, 0, -9.80665f};
  in.cues.present[0] = true;
  Cue& cue = in.cues.cues[0];
  cue.body.validity = Validity::kValid;
  cue.body.has_height = 1;
  const auto height_at = [](TimeNs t) { return 0.5f + 1.f * static_cast<float>(to_seconds(t)); };  // climbs at 1 m/s
  for (int i = 1; i < 160; ++i) {
    in.now_ns = i * 50 * kMillisecond;
    in.attitude.exposed_at_ns = in.now_ns;
    in.autopilot = {in.now_ns, i > 4, i > 4, {}};
    in.pressure_hpa = pressure_at(100.f + height_at(in.now_ns));
    if (i % 4 == 0) {  // one cue for four ticks, 50 to 200 ms old
      cue.exposed_at_ns = in.now_ns - 50 * kMillisecond;
      cue.body.height_m = height_at(cue.exposed_at_ns);
    }
    control_step(p, in, state);
  }
  EXPECT_NEAR(state.barometer.zero_m, 100.f, 0.04f);  // the cue's own height would teach 0.125 m too much
}

}  // namespace
}  // namespace wasp::control
