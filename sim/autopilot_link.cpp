#include "sim/autopilot_link.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace wasp::sim {
namespace {

constexpr std::uint8_t kSystem = 1, kComponent = 1;
constexpr std::uint64_t kTicksPerSecond = 200;
constexpr std::size_t kMaxQueued = 64 * 1024;
constexpr std::uint16_t kCommandClockStep = 31010;  ///< MAV_CMD_USER_1, of this simulator alone
constexpr float kForce = 21196.f, kForceReboot = 20190226.f;
constexpr DurationNs kRebootTime = 1500 * kMillisecond;
constexpr std::uint8_t kIgnoreYawRate = 4, kIgnoreThrust = 64, kIgnoreAttitude = 128;

bool for_us(std::uint8_t system, std::uint8_t component) {
  return (system == kSystem || system == 0) && (component == kComponent || component == 0);
}

}  // namespace

std::uint32_t custom_mode_of(const AutopilotKind& kind, ControllerMode mode) {
  constexpr std::uint32_t kPx4[] = {1u << 16, 6u << 16, 4u << 16 | 6u << 24};  // MANUAL, OFFBOARD, AUTO LAND
  constexpr std::uint32_t kCopter[] = {0, 20, 9};                              // STABILIZE, GUIDED_NOGPS, LAND
  const auto i = static_cast<std::uint32_t>(mode);
  return kind.flavour == Flavour::kPx4 ? kPx4[i] : kind.flavour == Flavour::kArduPilot ? kCopter[i] : i;
}

bool setpoint_of(const mavlink::SetAttitudeTarget& target, Flavour flavour, AttitudeSetpoint& setpoint) {
  if ((target.type_mask & (kIgnoreThrust | kIgnoreAttitude)) != 0) return false;
  const unsigned rates = target.type_mask & 7u;
  if (flavour == Flavour::kArduPilot && rates != 0 && rates != 7) return false;  // "The body rates are ill-defined"
  const Quat q(target.q[0], target.q[1], target.q[2], target.q[3]);
  const float norm = q.norm();
  const bool by_rate = (target.type_mask & kIgnoreYawRate) == 0;
  if (!std::isfinite(norm) || norm < 0.5f || !std::isfinite(target.thrust)) return false;
  if (by_rate && !std::isfinite(target.body_yaw_rate)) return false;
  setpoint.euler = euler_from_quat(q.normalized());
  constexpr float kMaxTilt_rad = 0.6f;
  setpoint.euler.roll_rad = std::clamp(setpoint.euler.roll_rad, -kMaxTilt_rad, kMaxTilt_rad);
  setpoint.euler.pitch_rad = std::clamp(setpoint.euler.pitch_rad, -kMaxTilt_rad, kMaxTilt_rad);
  setpoint.yaw_by_rate = by_rate && flavour == Flavour::kWasp;  // the others turn to the heading of the quaternion
  setpoint.yaw_rate_radps = by_rate ? target.body_yaw_rate : 0.f;
  setpoint.thrust = std::clamp(target.thrust, 0.f, 1.f);
  return true;
}

AutopilotLink::AutopilotLink(FlightController& flight, DurationNs clock_offset_ns, Chatter chatter)
    : flight_(flight),
      clock_offset_ns_(clock_offset_ns),
      parameters_(flight.kind().flavour),
      tells_events_(chatter == Chatter::kFull) {
  const bool full = tells_events_, px4 = is(Flavour::kPx4), ardupilot = is(Flavour::kArduPilot);
  streams_ = {{{mavlink::Heartbeat::kId, kTicksPerSecond, kTicksPerSecond},
               {ardupilot ? mavlink::Attitude::kId : mavlink::AttitudeQuaternion::kId, ardupilot ? 50u : 2u, 0},
               {ardupilot ? mavlink::RawImu::kId : mavlink::HighresImu::kId,
                ardupilot ? 100u
                : px4     ? 4u
                          : 1u,
                0},
               {mavlink::LocalPositionNed::kId, 0, 0}}};
  for (std::size_t i : {kAttitude, kImu})
    if (!full) streams_[i].usual = 0;
  for (Stream& stream : streams_) stream.every = stream.usual;
  output_.reserve(kMaxQueued);
  apply_parameters();
}

void AutopilotLink::apply_parameters() {
  if (is(Flavour::kPx4)) flight_.set_timeout(from_seconds(parameters_.value("COM_OF_LOSS_T", 1)));
  if (!is(Flavour::kArduPilot)) return;
  flight_.set_timeout(from_seconds(parameters_.value("GUID_TIMEOUT", 3)));
  const auto options = static_cast<unsigned>(parameters_.value("GUID_OPTIONS", 0));
  flight_.set_climb_rate((options & 8u) == 0, static_cast<float>(parameters_.value("WPNAV_SPEED_UP", 250) / 100),
                         static_cast<float>(parameters_.value("WPNAV_SPEED_DN", 150) / 100));
}

void AutopilotLink::use_signing(const std::string& key_file) {
  if (key_file.empty()) return;
  signing_ = drivers::open_signing({"require", key_file}, drivers::LinkSigning::kAutopilotLink);
  encoder_.sign_with(signing_->signer());
  parser_.check_signatures(signing_->check());
}

template <class Message>
void AutopilotLink::send(const Message& message) {
  std::array<std::uint8_t, 280> bytes{};
  const std::size_t size = encoder_.encode(message, bytes);
  if (output_.size() + size > kMaxQueued) output_.clear();
  output_.insert(output_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
}

void AutopilotLink::drain(std::vector<std::uint8_t>& out) {
  out.insert(out.end(), output_.begin(), output_.end());
  output_.clear();
}

void AutopilotLink::receive(std::span<const std::uint8_t> bytes, TimeNs now_ns) {
  if (signing_) signing_->follow(now_ns);
  parser_.feed(bytes, [&](const mavlink::Frame& frame) { handle(frame, now_ns); });
}

void AutopilotLink::handle(const mavlink::Frame& frame, TimeNs now_ns) {
  if (now_ns < silent_until_ns_) return;  // what came behind the command to restart
  ++frames_received_;
  if (frame.is<mavlink::CommandLong>()) on_command(frame.as<mavlink::CommandLong>(), frame, now_ns);
  if (frame.is<mavlink::SetAttitudeTarget>()) on_setpoint(frame.as<mavlink::SetAttitudeTarget>(), now_ns);
  if (frame.is<mavlink::ParamRequestRead>()) on_parameter_read(frame.as<mavlink::ParamRequestRead>());
  if (frame.is<mavlink::ParamSet>()) on_parameter_set(frame.as<mavlink::ParamSet>());
  if (frame.is<mavlink::Timesync>()) on_timesync(frame.as<mavlink::Timesync>(), frame, now_ns);
}

CommandResult AutopilotLink::obey(const mavlink::CommandLong& command, TimeNs now_ns) {
  switch (command.command) {
    case mavlink::mav_cmd::kComponentArmDisarm:
      return flight_.arm(command.param1 > 0.5f, command.param2 == kForce);
    case mavlink::mav_cmd::kDoSetMode:
      return command.param1 >= 1 ? set_mode(command.param2) : CommandResult::kDenied;
    case mavlink::mav_cmd::kRequestMessage:
      return command.param1 == float{mavlink::AutopilotVersion::kId} ? send_version(now_ns) : CommandResult::kDenied;
    case mavlink::mav_cmd::kPreflightRebootShutdown:
      return reboot(command, now_ns);
    case mavlink::mav_cmd::kInjectFailure:
      return failures_.set(command.param1, command.param2) ? CommandResult::kAccepted : CommandResult::kUnsupported;
    case kCommandClockStep:
      if (!(std::abs(command.param1) <= 1e9f)) return CommandResult::kDenied;
      clock_offset_ns_ += from_seconds(static_cast<double>(command.param1));
      return CommandResult::kAccepted;
    case mavlink::mav_cmd::kSetMessageInterval:
      return set_interval(command.param1, command.param2);
    default:
      return CommandResult::kUnsupported;
  }
}

CommandResult AutopilotLink::set_mode(float main_mode) {
  const AutopilotKind& kind = flight_.kind();
  for (const auto mode : {ControllerMode::kManual, ControllerMode::kOffboard, ControllerMode::kLand}) {
    if (kind.flavour == Flavour::kWasp && mode == ControllerMode::kLand) continue;
    const std::uint32_t number = drivers::main_mode_of(kind.flavour, custom_mode_of(kind, mode));
    if (main_mode == static_cast<float>(number)) return flight_.set_mode(mode);
  }
  return main_mode >= 0 && main_mode < 256 ? CommandResult::kUnsupported : CommandResult::kDenied;  // NaN: denied
}

CommandResult AutopilotLink::send_version(TimeNs) {
  if (is(Flavour::kWasp)) return CommandResult::kUnsupported;
  mavlink::AutopilotVersion m;
  constexpr std::uint64_t kBoth = 64 | 8192;  // SET_ATTITUDE_TARGET, MAVLink 2
  m.capabilities = kBoth | drivers::capability_of(drivers::facts_of(flight_.kind().flavour).encoding);
  m.flight_sw_version = is(Flavour::kPx4) ? 0x010e00ffu : 0x040500ffu;
  send(m);
  return CommandResult::kAccepted;
}

void AutopilotLink::send_parameter(const SimParameter& row) {
  const auto value = drivers::encode_parameter(drivers::facts_of(flight_.kind().flavour).encoding, row.type, row.value);
  mavlink::ParamValue m;
  m.param_value = value.value_or(0.f);
  m.param_count = static_cast<std::uint16_t>(parameters_.size());
  m.param_index = static_cast<std::uint16_t>(parameters_.index_of(row));
  m.param_id = drivers::parameter_name(row.name);
  m.param_type = row.type;
  send(m);
}

/// Silence for a name it does not have.
void AutopilotLink::on_parameter_read(const mavlink::ParamRequestRead& request) {
  if (!for_us(request.target_system, request.target_component)) return;
  if (const SimParameter* row = parameters_.find(drivers::name_of(request.param_id))) send_parameter(*row);
}

void AutopilotLink::on_parameter_set(const mavlink::ParamSet& request) {
  const SimParameter* row = parameters_.find(drivers::name_of(request.param_id));
  if (row == nullptr || !for_us(request.target_system, request.target_component)) return;
  const auto encoding = drivers::facts_of(flight_.kind().flavour).encoding;
  if (const auto value = drivers::decode_parameter(encoding, request.param_type, request.param_value))
    parameters_.set(row->name, *value);
  apply_parameters();
  send_parameter(*row);
}

/// Of 200 ticks a second; -1 stops, 0 is the usual.
CommandResult AutopilotLink::set_interval(float message, float interval_us) {
  for (Stream& stream : streams_) {
    if (message != static_cast<float>(stream.id)) continue;
    if (is(Flavour::kPx4) && stream.id == mavlink::Heartbeat::kId) return CommandResult::kFailed;
    if (interval_us == 0.f || interval_us == -1.f) {
      stream.every = interval_us == 0.f ? stream.usual : 0;
      return CommandResult::kAccepted;
    }
    if (!(interval_us >= 5000.f && interval_us <= 1e6f)) return CommandResult::kDenied;
    stream.every = static_cast<std::uint64_t>(std::lround(interval_us / 5000.f));
    return CommandResult::kAccepted;
  }
  return CommandResult::kDenied;
}

void AutopilotLink::share_reboot(const AutopilotLink& other) {
  if (other.silent_until_ns_ <= silent_until_ns_) return;
  silent_until_ns_ = other.silent_until_ns_;
  clock_offset_ns_ = other.clock_offset_ns_;
  ticks_ = 0;
  for (Stream& stream : streams_) stream.every = stream.usual;
}

CommandResult AutopilotLink::reboot(const mavlink::CommandLong& command, TimeNs now_ns) {
  if (command.param1 != 1.f) return CommandResult::kUnsupported;
  if (flight_.armed() && command.param6 != kForceReboot) return CommandResult::kDenied;
  flight_.restart();
  apply_parameters();
  failures_ = SensorFailures();
  clock_offset_ns_ = -now_ns;
  ticks_ = 0;                                                   // a heartbeat first
  for (Stream& stream : streams_) stream.every = stream.usual;  // what was asked of it is forgotten
  silent_until_ns_ = now_ns + kRebootTime;
  return CommandResult::kAccepted;
}

void AutopilotLink::on_command(const mavlink::CommandLong& command, const mavlink::Frame& frame, TimeNs now_ns) {
  if (!for_us(command.target_system, command.target_component)) return;
  const CommandResult result = obey(command, now_ns);
  mavlink::CommandAck ack{};
  ack.command = command.command;
  ack.result = static_cast<std::uint8_t>(result);
  ack.target_system = frame.system_id;
  ack.target_component = frame.component_id;
  send(ack);
  if (now_ns < silent_until_ns_) return;
  if (!is(Flavour::kWasp) && command.command == mavlink::mav_cmd::kComponentArmDisarm &&
      result == CommandResult::kTemporarilyRejected)
    send_text(flight_.settled() ? "PreArm: not on the ground" : "PreArm: attitude estimate not settled", 4);
  send_heartbeat();  // the new state at once, not within a second
}

void AutopilotLink::on_setpoint(const mavlink::SetAttitudeTarget& target, TimeNs now_ns) {
  AttitudeSetpoint setpoint;
  if (!for_us(target.target_system, target.target_component)) return;
  if (setpoint_of(target, flight_.kind().flavour, setpoint))
    flight_.set_setpoint(setpoint, now_ns);
  else
    ++setpoints_dropped_;
}

void AutopilotLink::on_timesync(const mavlink::Timesync& sync, const mavlink::Frame& frame, TimeNs now_ns) {
  if (sync.tc1 != 0) {  // the answer to a request of ours
    companion_offset_ns_ = sync.tc1 - (sync.ts1 + own_time(now_ns)) / 2;
    return;
  }
  mavlink::Timesync reply{};
  reply.tc1 = own_time(now_ns);
  reply.ts1 = sync.ts1;
  if (!is(Flavour::kArduPilot)) {  // whose answers are addressed to nobody
    reply.target_system = frame.system_id;
    reply.target_component = frame.component_id;
  }
  send(reply);
}

void AutopilotLink::step(const ImuSample& imu, const LocalPosition& where, TimeNs now_ns) {
  if (now_ns < silent_until_ns_) return;
  if (signing_) signing_->follow(now_ns);
  if (due(kImu)) send_imu(imu, now_ns);
  if (due(kAttitude)) send_attitude(now_ns);
  if (due(kPosition)) send_position(where, now_ns);
  if (due(kBeat)) send_heartbeat();
  const std::uint64_t asks_every = is(Flavour::kPx4) ? kTicksPerSecond / 10 : kTicksPerSecond;
  if (ticks_ % asks_every == asks_every / 2) {
    mavlink::Timesync request{};
    request.ts1 = own_time(now_ns);
    send(request);
  }
  if (!tells_events_) {
    ++ticks_;
    return;
  }
  if (const std::string_view event = flight_.take_event(); !event.empty()) {
    send_text(event, flight_.descending() ? 2 : 6);
    send_heartbeat();
  }
  ++ticks_;
}

void AutopilotLink::send_heartbeat() {
  mavlink::Heartbeat m{};
  const bool offboard = flight_.mode() == ControllerMode::kOffboard;
  m.custom_mode = custom_mode_of(flight_.kind(), flight_.mode());
  m.type = 2;  // quadrotor
  m.autopilot = flight_.kind().mav_autopilot;
  m.base_mode = static_cast<std::uint8_t>(1 | (offboard ? 8 : 64) | (flight_.armed() ? 128 : 0));
  m.system_status = flight_.descending() ? 5 : flight_.armed() ? 4 : 3;
  m.mavlink_version = 3;
  send(m);
}

void AutopilotLink::send_attitude(TimeNs now_ns) {
  if (is(Flavour::kArduPilot)) {
    const Euler e = flight_.euler();
    const Vec3 rates = flight_.rate_body_radps();
    return send(mavlink::Attitude{static_cast<std::uint32_t>(own_time(now_ns) / kMillisecond), e.roll_rad, e.pitch_rad,
                                  e.yaw_rad, rates.x(), rates.y(), rates.z()});
  }
  mavlink::AttitudeQuaternion m{};
  const Quat q = quat_from_euler(flight_.euler());
  const Vec3 rate = flight_.rate_body_radps();
  m.time_boot_ms = static_cast<std::uint32_t>(own_time(now_ns) / kMillisecond);
  m.q1 = q.w(), m.q2 = q.x(), m.q3 = q.y(), m.q4 = q.z();
  m.rollspeed = rate.x(), m.pitchspeed = rate.y(), m.yawspeed = rate.z();
  send(m);
}

void AutopilotLink::send_imu(const ImuSample& imu, TimeNs now_ns) {
  if (is(Flavour::kArduPilot)) {
    const auto whole = [](float value) { return static_cast<std::int16_t>(std::lround(value)); };
    const auto &a = imu.accel_body_mps2, &g = imu.gyro_body_radps;
    constexpr float kMilliG = 1000.f / 9.80665f;
    mavlink::RawImu m;
    m.time_usec = static_cast<std::uint64_t>(own_time(now_ns) / kMicrosecond);
    m.xacc = whole(a[0] * kMilliG), m.yacc = whole(a[1] * kMilliG), m.zacc = whole(a[2] * kMilliG);
    m.xgyro = whole(g[0] * 1000), m.ygyro = whole(g[1] * 1000), m.zgyro = whole(g[2] * 1000);
    return send(m);
  }
  mavlink::HighresImu m{};
  m.time_usec = static_cast<std::uint64_t>(own_time(now_ns) / kMicrosecond);
  m.xacc = imu.accel_body_mps2[0], m.yacc = imu.accel_body_mps2[1], m.zacc = imu.accel_body_mps2[2];
  m.xgyro = imu.gyro_body_radps[0], m.ygyro = imu.gyro_body_radps[1], m.zgyro = imu.gyro_body_radps[2];
  m.xmag = imu.mag_body_gauss[0], m.ymag = imu.mag_body_gauss[1], m.zmag = imu.mag_body_gauss[2];
  m.abs_pressure = imu.pressure_hpa;
  m.pressure_alt = flight_.barometric_height_m();
  m.temperature = imu.temperature_degc;
  m.fields_updated = static_cast<std::uint16_t>(imu.fields);
  send(m);
}

void AutopilotLink::send_position(const LocalPosition& where, TimeNs now_ns) {
  mavlink::LocalPositionNed m{};
  m.time_boot_ms = static_cast<std::uint32_t>(own_time(now_ns) / kMillisecond);
  m.x = where.position_ned_m[0], m.y = where.position_ned_m[1], m.z = where.position_ned_m[2];
  m.vx = where.velocity_ned_mps[0], m.vy = where.velocity_ned_mps[1], m.vz = where.velocity_ned_mps[2];
  send(m);
}

void AutopilotLink::send_text(std::string_view text, std::uint8_t severity) {
  mavlink::Statustext m{};
  m.severity = severity;
  std::copy_n(text.begin(), std::min(text.size(), std::size(m.text)), std::begin(m.text));
  send(m);
}

}  // namespace wasp::sim
