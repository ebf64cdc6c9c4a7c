// Corrections of inertial samples: what they compute, and that none changes no bit.
#include "drivers/imu_correction.h"

#include <gtest/gtest.h>

#include <cstring>

#include "drivers/autopilot_samples.h"

namespace wasp::drivers {
namespace {

ImuSample sample() {
  ImuSample s;
  s.accel_body_mps2 = {-0.0f, 1.f, -9.f};
  s.gyro_body_radps = {0.1f, 0.2f, -0.3f};
  s.mag_body_gauss = {0.2f, 0.f, 0.4f};
  s.pressure_hpa = 1000.f;
  s.temperature_degc = 35.f;
  s.fields = kFieldAccel | kFieldGyro | kFieldMag | kFieldPressure | kFieldTemperature;
  return s;
}

TEST(ImuCorrection, TheDefaultKeepsEveryBit) {
  const ImuSample before = sample();
  ImuSample after = before;
  ImuCorrector().apply(after);
  EXPECT_EQ(std::memcmp(&before, &after, sizeof before), 0);
}

TEST(ImuCorrection, MatrixTimesMeasuredMinusNeutralAtItsTemperature) {
  ImuCorrection c;
  c.accel.matrix = {2, 0.5f, 0, 0.5f, 1, 0, 0, 0, 1.1f};
  c.accel.neutral = {0, 0.1f, 0};
  c.accel.neutral_per_degc = {0.01f, 0, 0};
  c.accel.at_degc = 25;
  c.pressure_scale = 0.9f, c.pressure_neutral_hpa = 990;
  ImuSample s = sample();
  ImuCorrector(c).apply(s);
  EXPECT_NEAR(s.accel_body_mps2[0], 2 * -0.1 + 0.5 * 0.9, 1e-6);
  EXPECT_NEAR(s.accel_body_mps2[1], 0.5 * -0.1 + 0.9, 1e-6);
  EXPECT_NEAR(s.accel_body_mps2[2], -9.9, 1e-5);
  EXPECT_NEAR(s.pressure_hpa, 999, 1e-3);
  EXPECT_EQ(s.gyro_body_radps, sample().gyro_body_radps);
}

TEST(ImuCorrection, WhatIsNotThereStaysAway) {
  ImuCorrection c;
  c.mag.neutral = {0.1f, 0, 0};
  c.accel.neutral_per_degc = {1, 1, 1};
  c.pressure_scale = 0.9f;
  ImuSample s = sample();
  s.mag_body_gauss = {0, 0, 0}, s.pressure_hpa = 0, s.temperature_degc = 0, s.fields = kFieldAccel | kFieldGyro;
  const ImuSample before = s;
  ImuCorrector(c).apply(s);
  EXPECT_EQ(s.mag_body_gauss, before.mag_body_gauss);
  EXPECT_EQ(s.pressure_hpa, 0);
  EXPECT_FLOAT_EQ(s.accel_body_mps2[2], before.accel_body_mps2[2]);  // no temperature: no drift
}

}  // namespace
}  // namespace wasp::drivers
