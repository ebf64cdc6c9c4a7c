#include "sim/attitude_kalman.h"

#include <gtest/gtest.h>

#include "sim/attitude_estimator.h"
#include "sim/random.h"

namespace wasp::sim {
namespace {

TEST(AttitudeKalman, ConvergesAndFindsTheGyroBias) {
  AttitudeKalman filter;
  Random random(3);
  const float truth = 0.3f, bias = 0.02f;
  for (int i = 0; i < 200 * 120; ++i) {
    filter.predict(bias + 0.004f * static_cast<float>(random.normal()), 0.005f);
    filter.correct(truth + 0.02f * static_cast<float>(random.normal()) - filter.angle_rad(), 0.01f);
  }
  EXPECT_NEAR(filter.angle_rad(), truth, 0.005f);
  EXPECT_NEAR(filter.bias_radps(), bias, 0.002f);
}

TEST(AttitudeKalman, FollowsTheGyroBetweenCorrections) {
  AttitudeKalman filter;
  for (int i = 0; i < 200; ++i) filter.predict(0.5f, 0.005f);
  EXPECT_NEAR(filter.angle_rad(), 0.5f, 1e-4f);
}

TEST(AttitudeKalman, CovarianceStaysPositiveAndSymmetricInEffect) {
  AttitudeKalman filter;
  for (int i = 0; i < 2'000'000; ++i) {
    filter.predict(0, 0.005f);
    filter.correct(0.001f, 0.01f);
    ASSERT_GT(filter.angle_variance_rad2(), 0) << "step " << i;
  }
}

TEST(AttitudeEstimator, AnglesOfABodyAtRest) {
  const Euler tilt{0.2f, -0.3f, 1.1f};
  const Quat q = quat_from_euler(tilt);
  const Vec3 accel = q.conjugate() * Vec3(0, 0, -9.81f), mag = q.conjugate() * Vec3(0.21f, 0, 0.45f);
  const Euler level = level_from_accel(accel);
  EXPECT_NEAR(level.roll_rad, tilt.roll_rad, 1e-5f);
  EXPECT_NEAR(level.pitch_rad, tilt.pitch_rad, 1e-5f);
  EXPECT_NEAR(heading_from_mag(mag, level.roll_rad, level.pitch_rad), tilt.yaw_rad, 1e-5f);
}

TEST(AttitudeEstimator, WrapsAngles) {
  EXPECT_NEAR(wrap_angle(3.5f), 3.5f - 6.2831853f, 1e-5f);
  EXPECT_NEAR(wrap_angle(-3.5f), 6.2831853f - 3.5f, 1e-5f);
  EXPECT_NEAR(wrap_angle(0.1f), 0.1f, 1e-6f);
}

}  // namespace
}  // namespace wasp::sim
