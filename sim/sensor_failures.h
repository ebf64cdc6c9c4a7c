// Sensor failures on command, as PX4's simulation knows them (MAV_CMD_INJECT_FAILURE): what the flight controller and
// the companion are told is falsified behind the sensor, for both alike.
#pragma once

#include <array>
#include <cstdint>

#include "sim/random.h"
#include "types/messages.h"

namespace wasp::sim {

/// FAILURE_UNIT_SENSOR_*.
enum class SensorUnit : std::uint8_t { kGyro = 0, kAccel = 1, kMag = 2, kBaro = 3, kCount };
/// FAILURE_TYPE_*.
enum class SensorFailure : std::uint8_t {
  kNone = 0,
  kOff = 1,      ///< reads zero, and its bits in ImuSample::fields are clear
  kStuck = 2,    ///< the last good reading for ever
  kGarbage = 3,  ///< anything within the sensor's range
  kWrong = 4,    ///< off by a constant: 0.2 rad/s, 2 m/s2, 0.2 gauss, 1.2 hPa (10 m)
  kSlow = 5,     ///< a new reading ten times a second
};

class SensorFailures {
 public:
  explicit SensorFailures(std::uint32_t seed = 0) : random_{seed} {}

  /// MAV_CMD_INJECT_FAILURE's param1 and param2; false for a unit or a kind that is not simulated.
  bool set(float unit, float failure);
  /// Falsifies a sample (200 Hz).
  void apply(ImuSample& sample);

 private:
  struct Channel {
    SensorFailure failure = SensorFailure::kNone;
    std::array<float, 3> held{};
    std::uint32_t age = 0;
  };
  void falsify(Channel& channel, float* values, std::size_t count, float range, float wrong);

  std::array<Channel, static_cast<std::size_t>(SensorUnit::kCount)> channels_{};
  Random random_;
};

}  // namespace wasp::sim
