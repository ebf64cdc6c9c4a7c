#include "drivers/autopilot_link.h"

#include <algorithm>
#include <cmath>

namespace wasp::drivers {
namespace {

constexpr DurationNs kClockJumpNs = kSecond;           ///< a stream's time going back further than this: a reboot
constexpr DurationNs kOldestCredibleNs = kSecond / 2;  ///< no serial link holds a message back longer

}  // namespace

void AutopilotLink::restart() noexcept {
  parser_.reset();
  restart_clock();
  asked_at_ns_.fill(0);
}

bool AutopilotLink::is_from_autopilot(const mavlink::Frame& frame) noexcept {
  const auto from = [&frame](std::uint8_t system, std::uint8_t component) noexcept {
    return frame.system_id == system && frame.component_id == component;
  };
  if (from(identity_.autopilot_system_id, identity_.autopilot_component_id)) return true;
  if (from(identity_.system_id, identity_.component_id))
    ++counts_.own_echoes;
  else if (frame.system_id != identity_.autopilot_system_id)
    ++counts_.foreign_systems;
  else
    ++counts_.other_components;
  return false;
}

bool AutopilotLink::for_us(std::uint8_t target_system, std::uint8_t target_component) noexcept {
  const bool ours = (target_system == 0 || target_system == identity_.system_id) &&
                    (target_component == 0 || target_component == identity_.component_id);
  if (!ours) ++counts_.not_for_us;
  return ours;
}

bool AutopilotLink::usable(Finiteness finiteness) noexcept {
  if (finiteness == Finiteness::kRefused) ++counts_.refused_samples;
  if (finiteness == Finiteness::kPartial) ++counts_.partial_samples;
  return finiteness != Finiteness::kRefused;
}

bool AutopilotLink::admitted(PreferredSource& source, int rank, TimeNs received_at_ns) noexcept {
  const bool admitted = source.admit(rank, received_at_ns);
  if (!admitted) ++counts_.outranked_samples;
  return admitted;
}

bool AutopilotLink::unsupported_command(const mavlink::Frame& frame, mavlink::CommandAck& answer) const noexcept {
  std::uint8_t system = 0, component = 0;
  if (frame.is<mavlink::CommandLong>()) {
    const auto m = frame.as<mavlink::CommandLong>();
    answer.command = m.command, system = m.target_system, component = m.target_component;
  } else if (frame.is<mavlink::CommandInt>()) {
    const auto m = frame.as<mavlink::CommandInt>();
    answer.command = m.command, system = m.target_system, component = m.target_component;
  } else {
    return false;
  }
  const bool own_echo = frame.system_id == identity_.system_id && frame.component_id == identity_.component_id;
  if (own_echo || system != identity_.system_id || component != identity_.component_id) return false;
  answer.result = mavlink::mav_result::kUnsupported;
  answer.target_system = frame.system_id;
  answer.target_component = frame.component_id;
  return true;
}

/// An answer counts only for a question that is still open: ts1 is what tells a 0/0-addressed answer to us from others.
void AutopilotLink::add_exchange(const mavlink::Timesync& answer, TimeNs received_at_ns) noexcept {
  const auto question = std::find(asked_at_ns_.begin(), asked_at_ns_.end(), answer.ts1);
  if (answer.ts1 == 0 || question == asked_at_ns_.end()) {
    ++counts_.timesync_refused;
    return;
  }
  *question = 0;
  const ClockOutcome outcome = clock_.add({answer.ts1, answer.tc1, received_at_ns});
  const bool accepted = outcome == ClockOutcome::kAccepted || outcome == ClockOutcome::kRestarted;
  ++(accepted ? counts_.timesync_accepted : counts_.timesync_refused);
  if (outcome == ClockOutcome::kRestarted) ++counts_.clock_restarts;
  share_offset(received_at_ns);
}

TimeNs AutopilotLink::exposed_at(Stream stream, TimeNs remote_ns, TimeNs received_at_ns) noexcept {
  TimeNs& last = last_remote_ns_[stream];
  const bool went_back = last >= 0 && remote_ns >= 0 && remote_ns < last - kClockJumpNs;
  last = remote_ns;
  if (went_back) ++counts_.reboots;
  if (went_back && clock_.synced()) {
    restart_clock();
    ++counts_.clock_restarts;
  }
  if (clock_.synced() && remote_ns >= 0) {
    const TimeNs exposed_at_ns = clock_.to_local(remote_ns);
    // Slightly after arrival is the error of the map; far after or long before is another clock.
    if (std::abs(exposed_at_ns - received_at_ns) <= kOldestCredibleNs) return std::min(exposed_at_ns, received_at_ns);
  }
  ++counts_.unmapped_times;
  return received_at_ns;
}

void AutopilotLink::restart_clock() noexcept {
  clock_.restart();
  last_remote_ns_.fill(-1);
  shared_offset_ns_.store(kNever, std::memory_order_relaxed);
}

void AutopilotLink::share_offset(TimeNs now_ns) noexcept {
  shared_offset_ns_.store(clock_.synced() ? clock_.offset_at(now_ns) : kNever, std::memory_order_relaxed);
}

std::size_t AutopilotLink::encode_attitude_target(const AttitudeTargetCommand& target, TimeNs now_ns,
                                                  std::span<std::uint8_t> out) WASP_REALTIME {
  namespace mask = mavlink::attitude_target_typemask;
  const bool finite = std::all_of(target.q_ned_body.begin(), target.q_ned_body.end(),
                                  [](float component) { return std::isfinite(component); }) &&
                      std::isfinite(target.yaw_rate_radps) && std::isfinite(target.thrust);
  if (!finite) return 0;
  if (signing_ != nullptr) signing_->follow(now_ns);
  const DurationNs offset = shared_offset_ns_.load(std::memory_order_relaxed);
  const TimeNs stamp_ns = offset == kNever ? now_ns : now_ns + offset;
  mavlink::SetAttitudeTarget m;
  m.time_boot_ms = static_cast<std::uint32_t>(stamp_ns / kMillisecond);
  m.q = target.q_ned_body;
  m.thrust = target.thrust;
  m.target_system = identity_.autopilot_system_id;
  m.target_component = identity_.autopilot_component_id;
  m.type_mask = mask::kBodyRollRateIgnore | mask::kBodyPitchRateIgnore;
  if (target.use_yaw_rate)
    m.body_yaw_rate = target.yaw_rate_radps;
  else
    m.type_mask = m.type_mask | mask::kBodyYawRateIgnore;
  return encoder_.encode(m, out);
}

std::size_t AutopilotLink::encode_heartbeat(const CompanionState& state, std::span<std::uint8_t> out) WASP_REALTIME {
  mavlink::Heartbeat m;
  m.type = mavlink::mav_type::kOnboardController;
  m.autopilot = mavlink::mav_autopilot::kInvalid;
  m.system_status = system_status_of(state);
  m.custom_mode = custom_mode_of(state);
  m.mavlink_version = 3;
  return encoder_.encode(m, out);
}

std::size_t AutopilotLink::encode_command(std::uint16_t command, const std::array<float, 7>& parameters,
                                          std::uint8_t confirmation, std::span<std::uint8_t> out) WASP_REALTIME {
  const auto& p = parameters;
  return encoder_.encode(
      mavlink::CommandLong{p[0], p[1], p[2], p[3], p[4], p[5], p[6], command, identity_.autopilot_system_id,
                           identity_.autopilot_component_id, confirmation},
      out);
}

std::size_t AutopilotLink::encode_arm(bool arm, std::uint8_t confirmation, std::span<std::uint8_t> out) WASP_REALTIME {
  return encode_command(mavlink::mav_cmd::kComponentArmDisarm, {arm ? 1.f : 0.f}, confirmation, out);
}

std::size_t AutopilotLink::encode_set_mode(std::uint32_t main_mode, std::uint32_t sub_mode, std::uint8_t confirmation,
                                           std::span<std::uint8_t> out) WASP_REALTIME {
  constexpr float kCustom = mavlink::mav_mode_flag::kCustomModeEnabled;
  return encode_command(mavlink::mav_cmd::kDoSetMode,
                        {kCustom, static_cast<float>(main_mode), static_cast<float>(sub_mode)}, confirmation, out);
}

std::size_t AutopilotLink::encode_message_interval(std::uint32_t id, DurationNs interval_ns, std::uint8_t confirmation,
                                                   std::span<std::uint8_t> out) WASP_REALTIME {
  const float interval_us = interval_ns < 0 ? -1.f : static_cast<float>(interval_ns / kMicrosecond);
  return encode_command(mavlink::mav_cmd::kSetMessageInterval, {static_cast<float>(id), interval_us}, confirmation,
                        out);
}

std::size_t AutopilotLink::encode_timesync_request(TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME {
  mavlink::Timesync m;
  m.ts1 = now_ns;
  const std::size_t n = encoder_.encode(m, out);
  if (n != 0) {
    asked_at_ns_[next_question_] = now_ns;
    next_question_ = (next_question_ + 1) % asked_at_ns_.size();
  }
  return n;
}

}  // namespace wasp::drivers
