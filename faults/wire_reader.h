// The line read as MAVLink: every setpoint, heartbeat and arming of the companion with its time on the wire, and what
// the autopilot says of itself.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "drivers/companion_state.h"
#include "faults/wire_log.h"
#include "messages/mavlink_frame.h"

namespace wasp::faults {

/// SET_ATTITUDE_TARGET.
struct Setpoint {
  TimeNs at_ns = 0;
  std::uint8_t sequence = 0;
  std::array<float, 4> q{};
  float yaw_rate_radps = 0, thrust = 0;
  std::vector<std::uint8_t> wire;

  /// Level and not turning, within 1e-4; thrust anything in 0 ... 1.
  [[nodiscard]] bool neutral() const;
};

/// HEARTBEAT of the companion.
struct CompanionBeat {
  TimeNs at_ns = 0;
  std::uint8_t status = 0;  ///< MAV_STATE
  drivers::CompanionState state;

  [[nodiscard]] bool alarmed() const {
    return status == mavlink::mav_state::kCritical || status == mavlink::mav_state::kEmergency;
  }
};

/// COMMAND_LONG 400 of the companion.
struct ArmRequest {
  TimeNs at_ns = 0;
  bool arm = false;
};

/// HEARTBEAT of the autopilot.
struct AutopilotBeat {
  TimeNs at_ns = 0;
  bool armed = false;
  std::uint32_t custom_mode = 0;
};

struct AutopilotText {
  TimeNs at_ns = 0;
  std::string text;
};

class WireReader {
 public:
  void take(const WireChunk& chunk);
  /// Takes what is new in the log.
  void follow(const WireLog& log);

  std::vector<Setpoint> setpoints;
  std::vector<CompanionBeat> beats;
  std::vector<ArmRequest> arm_requests;
  std::vector<AutopilotBeat> autopilot_beats;
  std::vector<AutopilotText> texts;

  [[nodiscard]] const mavlink::Counts& companion_counts() const { return to_autopilot_.counts(); }
  [[nodiscard]] bool armed() const { return !autopilot_beats.empty() && autopilot_beats.back().armed; }
  /// When the autopilot first said it was armed, kForever if never.
  [[nodiscard]] TimeNs first_armed_ns() const;

 private:
  void companion(const mavlink::Frame& frame, TimeNs at_ns);
  void autopilot(const mavlink::Frame& frame, TimeNs at_ns);

  mavlink::Parser to_autopilot_, to_flight_;
  std::size_t taken_ = 0;
};

/// Roll and pitch of a setpoint [rad]; its yaw does not matter.
std::array<float, 2> roll_pitch(const std::array<float, 4>& q_wxyz);

}  // namespace wasp::faults
