// Autopilot messages to samples of this project: SI units, body FRD, finite numbers only. Times are left to the caller.
#pragma once

#include <cstdint>

#include "messages/mavlink_messages.h"
#include "rt/contract.h"
#include "types/messages.h"

namespace wasp::drivers {

/// What a conversion had to do about numbers that are not finite.
enum class Finiteness : std::uint8_t {
  kWhole,    ///< all finite
  kPartial,  ///< a side channel (magnetometer, pressure, temperature) was not: it reads 0 and its field bits are clear
  kRefused,  ///< a main channel was not, or a quaternion had no direction: the sample must not be used
};

/// Bits of ImuSample::fields (HIGHRES_IMU fields_updated).
inline constexpr std::uint32_t kFieldAccel = 0x007, kFieldGyro = 0x038, kFieldMag = 0x1C0,
                               kFieldPressure = kImuHasPressure, kFieldTemperature = 0x1000;
/// Not of HIGHRES_IMU: the numbers are whole mG and mrad/s, so that a sensor at rest may well repeat itself.
inline constexpr std::uint32_t kFieldCoarse = 0x10000;

Finiteness convert(const mavlink::HighresImu& from, ImuSample& to) WASP_REALTIME;
/// mG, mrad/s, mgauss (ArduPilot fills RAW_IMU so as well); temperature 0 means none was sent.
Finiteness convert(const mavlink::ScaledImu& from, ImuSample& to) WASP_REALTIME;
Finiteness convert(const mavlink::RawImu& from, ImuSample& to) WASP_REALTIME;
/// The quaternion comes out with unit norm; one shorter than 0.5 or longer than 2 is refused.
Finiteness convert(const mavlink::AttitudeQuaternion& from, AttitudeSample& to) WASP_REALTIME;
/// Euler angles Z-Y-X to q_ned_body.
Finiteness convert(const mavlink::Attitude& from, AttitudeSample& to) WASP_REALTIME;

}  // namespace wasp::drivers
