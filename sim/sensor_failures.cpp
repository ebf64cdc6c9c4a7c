#include "sim/sensor_failures.h"

#include <algorithm>

namespace wasp::sim {
namespace {

constexpr std::uint32_t kSlowSteps = 20;  // of 200 Hz: 10 Hz
constexpr std::uint32_t kAccelBits = 0x007, kGyroBits = 0x038, kMagBits = 0x1c0;

}  // namespace

bool SensorFailures::set(float unit, float failure) {
  const bool known = unit >= 0.f && unit < static_cast<float>(channels_.size()) && failure >= 0.f &&
                     failure <= static_cast<float>(SensorFailure::kSlow);  // NaN fails
  if (!known) return false;
  channels_[static_cast<std::size_t>(unit)].failure = static_cast<SensorFailure>(static_cast<std::uint8_t>(failure));
  return true;
}

void SensorFailures::apply(ImuSample& s) {
  const auto fail = [&](SensorUnit unit, float* values, std::size_t count, std::uint32_t bits, float range,
                        float wrong) {
    Channel& channel = channels_[static_cast<std::size_t>(unit)];
    if (channel.failure == SensorFailure::kOff) s.fields &= ~bits;
    falsify(channel, values, count, range, wrong);
  };
  fail(SensorUnit::kGyro, s.gyro_body_radps.data(), 3, kGyroBits, 35.f, 0.2f);
  fail(SensorUnit::kAccel, s.accel_body_mps2.data(), 3, kAccelBits, 156.f, 2.f);
  fail(SensorUnit::kMag, s.mag_body_gauss.data(), 3, kMagBits, 8.f, 0.2f);
  fail(SensorUnit::kBaro, &s.pressure_hpa, 1, kImuHasPressure, 1100.f, 1.2f);
}

void SensorFailures::falsify(Channel& c, float* values, std::size_t count, float range, float wrong) {
  switch (c.failure) {
    case SensorFailure::kNone:
      std::copy_n(values, count, c.held.begin());
      c.age = 0;
      return;
    case SensorFailure::kOff:
      std::fill_n(values, count, 0.f);
      return;
    case SensorFailure::kStuck:
      std::copy_n(c.held.begin(), count, values);
      return;
    case SensorFailure::kGarbage:
      for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<float>(random_.uniform(-1, 1)) * range;
      return;
    case SensorFailure::kWrong:
      for (std::size_t i = 0; i < count; ++i) values[i] += wrong;
      return;
    case SensorFailure::kSlow:
      if (c.age++ % kSlowSteps == 0) std::copy_n(values, count, c.held.begin());
      std::copy_n(c.held.begin(), count, values);
      return;
  }
}

}  // namespace wasp::sim
