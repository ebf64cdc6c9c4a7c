#include "scheduling/sample_faults.h"

#include <cmath>
#include <limits>
#include <numbers>

namespace wasp::scheduling {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kSpikes = 0.1f;               // share of the samples
constexpr float kSamplePeriod_s = 1 / 100.f;  // rates of an attitude spike: there within one sample

/// q turned about the body's roll axis: q * (cos, sin, 0, 0).
void roll_by(AttitudeSample& s, float angle_rad) WASP_REALTIME {
  const float c = std::cos(angle_rad / 2), d = std::sin(angle_rad / 2);
  const auto [w, x, y, z] = s.q_ned_body;
  s.q_ned_body = {w * c - x * d, x * c + w * d, y * c + z * d, z * c - y * d};
}

constexpr float to_rad(float deg) { return deg * std::numbers::pi_v<float> / 180.f; }

}  // namespace

template <class Sample>
bool SampleFaults::pass_stream(const StreamPoints& points, Memory<Sample>& memory, Sample& sample,
                               TimeNs now_ns) WASP_REALTIME {
  if (on(points.stop, now_ns)) return false;
  if (on(points.slow, now_ns) &&
      static_cast<double>(now_ns - memory.shown_at_ns) * static_cast<double>(board_->value(points.slow)) <
          static_cast<double>(kSecond))
    return false;
  memory.shown_at_ns = now_ns;
  if (!on(points.freeze, now_ns)) {
    memory.is_frozen = false;
    return true;
  }
  if (!memory.is_frozen) memory.frozen = sample;
  memory.is_frozen = true;
  const TimeNs exposed_at_ns = sample.exposed_at_ns;
  const std::uint32_t sequence = sample.sequence;
  sample = memory.frozen;
  sample.exposed_at_ns = exposed_at_ns;
  sample.sequence = sequence;
  return true;
}

bool SampleFaults::corrupt(AttitudeSample& s, TimeNs now_ns) WASP_REALTIME {
  using enum FaultPoint;
  if (!pass_stream({kAttitudeStop, kAttitudeFreeze, kAttitudeSlow}, attitude_, s, now_ns)) return false;
  if (on(kAttitudeSpike, now_ns) && random_.chance(kSpikes)) {
    const float angle_rad = to_rad(board_->value(kAttitudeSpike));
    roll_by(s, angle_rad);
    s.rate_body_radps[0] += angle_rad / kSamplePeriod_s;
  }
  if (on(kAttitudeBias, now_ns)) roll_by(s, to_rad(board_->value(kAttitudeBias)));
  if (on(kAttitudeNan, now_ns)) {
    s.q_ned_body.fill(kNan);
    s.rate_body_radps.fill(kNan);
  }
  if (on(kAttitudeStampAhead, now_ns)) s.exposed_at_ns += milliseconds_of(*board_, kAttitudeStampAhead);
  if (on(kAttitudeStampBack, now_ns)) s.exposed_at_ns -= milliseconds_of(*board_, kAttitudeStampBack);
  return true;
}

bool SampleFaults::corrupt(ImuSample& s, TimeNs now_ns) WASP_REALTIME {
  using enum FaultPoint;
  if (!pass_stream({kImuStop, kImuFreeze, kImuSlow}, imu_, s, now_ns)) return false;
  if (on(kImuSpike, now_ns) && random_.chance(kSpikes)) {
    const std::uint32_t axis = random_.below(3);
    s.accel_body_mps2[axis] = s.gyro_body_radps[axis] = board_->value(kImuSpike);
  }
  if (on(kImuBias, now_ns)) s.accel_body_mps2[2] += board_->value(kImuBias);
  if (on(kImuNan, now_ns)) {
    s.accel_body_mps2.fill(kNan);
    s.gyro_body_radps.fill(kNan);
    s.pressure_hpa = kNan;
  }
  return true;
}

}  // namespace wasp::scheduling
