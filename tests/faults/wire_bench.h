// Byte streams of a companion and an autopilot, as a test writes them.
#pragma once

#include <array>
#include <vector>

#include "faults/wire_checker.h"
#include "faults/wire_reader.h"
#include "messages/mavlink_frame.h"

namespace wasp::faults::test {

inline std::array<float, 4> level() { return {1, 0, 0, 0}; }
inline std::array<float, 4> pitched(float rad) { return {std::cos(rad / 2), 0, std::sin(rad / 2), 0}; }

/// Writes into a reader what both sides say, with times.
class WireBench {
 public:
  std::vector<std::uint8_t> setpoint(TimeNs at_ns, const std::array<float, 4>& q = level(), float yaw_rate = 0,
                                     float thrust = 0.8f) {
    mavlink::SetAttitudeTarget m{};
    m.time_boot_ms = static_cast<std::uint32_t>(at_ns / kMillisecond);
    m.q = q, m.body_yaw_rate = yaw_rate, m.thrust = thrust, m.type_mask = 3;
    m.target_system = m.target_component = 1;
    return say(at_ns, Direction::kToAutopilot, companion_, m);
  }
  void beat(TimeNs at_ns, std::uint8_t status, const drivers::CompanionState& state) {
    mavlink::Heartbeat m{};
    m.system_status = status, m.custom_mode = drivers::custom_mode_of(state);
    say(at_ns, Direction::kToAutopilot, companion_, m);
  }
  /// As the flight says it of itself.
  void beat(TimeNs at_ns, const drivers::CompanionState& state) {
    beat(at_ns, drivers::system_status_of(state), state);
  }
  void ask_to_arm(TimeNs at_ns) {
    mavlink::CommandLong m{};
    m.command = mavlink::mav_cmd::kComponentArmDisarm, m.param1 = 1;
    say(at_ns, Direction::kToAutopilot, companion_, m);
  }
  void armed(TimeNs at_ns, bool armed) {
    mavlink::Heartbeat m{};
    m.base_mode = armed ? 128 : 0;
    say(at_ns, Direction::kToFlight, autopilot_, m);
  }
  void bytes(TimeNs at_ns, Direction direction, std::vector<std::uint8_t> raw) {
    reader.take({at_ns, direction, std::move(raw)});
  }

  WireReader reader;

 private:
  template <class Message>
  std::vector<std::uint8_t> say(TimeNs at_ns, Direction direction, mavlink::Encoder& encoder, const Message& message) {
    std::vector<std::uint8_t> raw(mavlink::kMaxFrame);
    raw.resize(encoder.encode(message, raw));
    bytes(at_ns, direction, raw);
    return raw;
  }
  mavlink::Encoder companion_{1, 191}, autopilot_{1, 1};
};

}  // namespace wasp::faults::test
