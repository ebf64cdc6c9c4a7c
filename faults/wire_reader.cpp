#include "faults/wire_reader.h"

#include <algorithm>
#include <cmath>

namespace wasp::faults {
namespace {

constexpr float kNeutral = 1e-4f;
constexpr std::uint8_t kAutopilotComponent = mavlink::mav_component::kCompIdAutopilot1;

}  // namespace

std::array<float, 2> roll_pitch(const std::array<float, 4>& q) {
  const auto [w, x, y, z] = q;
  const float roll = std::atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y));
  return {roll, std::asin(std::clamp(2 * (w * y - z * x), -1.f, 1.f))};
}

bool Setpoint::neutral() const {
  const auto [roll, pitch] = roll_pitch(q);
  return std::abs(roll) <= kNeutral && std::abs(pitch) <= kNeutral && std::abs(yaw_rate_radps) <= kNeutral &&
         thrust >= 0.f && thrust <= 1.f;  // a NaN fails
}

void WireReader::follow(const WireLog& log) {
  for (const std::size_t end = log.size(); taken_ < end; ++taken_) take(log.at(taken_));
}

void WireReader::take(const WireChunk& chunk) {
  if (chunk.direction == Direction::kToAutopilot)
    to_autopilot_.feed(chunk.bytes, [&](const mavlink::Frame& frame) { companion(frame, chunk.at_ns); });
  else
    to_flight_.feed(chunk.bytes, [&](const mavlink::Frame& frame) { autopilot(frame, chunk.at_ns); });
}

void WireReader::companion(const mavlink::Frame& frame, TimeNs at_ns) {
  if (frame.is<mavlink::SetAttitudeTarget>()) {
    const auto m = frame.as<mavlink::SetAttitudeTarget>();
    setpoints.push_back(
        {at_ns, frame.sequence, m.q, m.body_yaw_rate, m.thrust, {frame.wire.begin(), frame.wire.end()}});
  } else if (frame.is<mavlink::Heartbeat>()) {
    const auto m = frame.as<mavlink::Heartbeat>();
    beats.push_back({at_ns, m.system_status, drivers::companion_state_of(m.custom_mode)});
  } else if (frame.is<mavlink::CommandLong>()) {
    const auto m = frame.as<mavlink::CommandLong>();
    if (m.command == mavlink::mav_cmd::kComponentArmDisarm) arm_requests.push_back({at_ns, m.param1 > 0.5f});
  }
}

void WireReader::autopilot(const mavlink::Frame& frame, TimeNs at_ns) {
  if (frame.component_id != kAutopilotComponent) return;
  if (frame.is<mavlink::Heartbeat>()) {
    const auto m = frame.as<mavlink::Heartbeat>();
    autopilot_beats.push_back({at_ns, (m.base_mode & mavlink::mav_mode_flag::kSafetyArmed) != 0, m.custom_mode});
  } else if (frame.is<mavlink::Statustext>()) {
    const auto m = frame.as<mavlink::Statustext>();
    texts.push_back({at_ns, {m.text.begin(), std::find(m.text.begin(), m.text.end(), '\0')}});
  }
}

TimeNs WireReader::first_armed_ns() const {
  const auto armed = std::ranges::find_if(autopilot_beats, [](const AutopilotBeat& b) { return b.armed; });
  return armed == autopilot_beats.end() ? kForever : armed->at_ns;
}

}  // namespace wasp::faults
