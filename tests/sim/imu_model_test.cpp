#include "sim/imu_model.h"

#include <gtest/gtest.h>

namespace wasp::sim {
namespace {

TEST(ImuModel, LevelAtRestReadsGravityUpwardsWithTheStatedNoise) {
  ImuModel imu({}, 5);
  double sum = 0, squares = 0;
  constexpr int kSamples = 4000;
  for (int i = 0; i < kSamples; ++i) {
    const double z = static_cast<double>(imu.sample({}, 0.005, i).accel_body_mps2[2]);
    sum += z, squares += z * z;
  }
  const double mean = sum / kSamples;
  EXPECT_NEAR(mean, -9.81, 0.1);
  EXPECT_NEAR(std::sqrt(squares / kSamples - mean * mean), 0.08, 0.01);
}

TEST(ImuModel, SameSeedSameSamplesOtherSeedOthers) {
  ImuModel a({}, 1), b({}, 1), c({}, 2);
  const ImuSample x = a.sample({}, 0.005, 0), y = b.sample({}, 0.005, 0), z = c.sample({}, 0.005, 0);
  EXPECT_EQ(x.gyro_body_radps, y.gyro_body_radps);
  EXPECT_NE(x.gyro_body_radps, z.gyro_body_radps);
}

TEST(ImuModel, PressureAndHeightInvertEachOther) {
  for (const double h : {0.0, 0.5, 2.5}) EXPECT_NEAR(height_of_pressure_m(pressure_hpa(h)), h, 1e-6);
  EXPECT_LT(pressure_hpa(1), pressure_hpa(0));
}

}  // namespace
}  // namespace wasp::sim
