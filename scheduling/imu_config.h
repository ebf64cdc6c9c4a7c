// [imu] of the configuration: what `wasp calibrate accel | mag | gyro | baro` wrote.
#pragma once

#include "drivers/imu_correction.h"
#include "scheduling/toml_table.h"

namespace wasp::scheduling {

/// Throws ConfigError; a matrix that mirrors, or scales a volume by less than 0.2 or more than 5, is refused.
void read_imu(TomlTable t, drivers::ImuCorrection& correction);

}  // namespace wasp::scheduling
