// The autopilot's side of the serial line: MAVLink 2 as system 1, component 1. Sends HEARTBEAT 1 Hz or as asked,
// ATTITUDE_QUATERNION 100 Hz, HIGHRES_IMU 200 Hz, its own TIMESYNC requests 1 Hz, STATUSTEXT on events; answers
// TIMESYNC; obeys COMMAND_LONG 400 (arm), 176 (mode), 511 (its own HEARTBEAT's interval), 246 (reboot: disarmed, 1.5 s
// of silence, its clock starts again; denied while armed unless param6 is 20190226, as ArduPilot does), 420 (sensor
// failures, as PX4's simulation) and 31010 (MAV_CMD_USER_1: its clock jumps by param1 seconds); acknowledges every
// command; follows SET_ATTITUDE_TARGET. Its clock runs at an offset from the simulator's, so that a companion must
// synchronise.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "messages/mavlink_frame.h"
#include "messages/mavlink_messages.h"
#include "sim/autopilot_parameters.h"
#include "sim/flight_controller.h"
#include "sim/sensor_failures.h"

namespace wasp::sim {

class AutopilotLink {
 public:
  /// `clock_offset_ns`: autopilot time minus simulation time. Its kind is the flight controller's.
  AutopilotLink(FlightController& flight, DurationNs clock_offset_ns);

  /// Bytes from the companion, in any pieces.
  void receive(std::span<const std::uint8_t> bytes, TimeNs now_ns);
  /// Where an estimator with a satellite receiver would have it, for LOCAL_POSITION_NED; sent when asked for.
  void set_local_position(const Vec3& position_ned_m, const Vec3& velocity_ned_mps) {
    position_ned_m_ = position_ned_m, velocity_ned_mps_ = velocity_ned_mps;
  }
  /// Once for every IMU sample (200 Hz): queues what is due.
  void step(const ImuSample& imu, TimeNs now_ns);
  /// What is wrong with the sensors, on command: to be applied to a sample before anybody reads it.
  [[nodiscard]] SensorFailures& failures() { return failures_; }
  /// Moves the queued bytes to the end of `out`. At most 64 KiB wait; older output is dropped when nobody drains.
  void drain(std::vector<std::uint8_t>& out);

  /// Companion clock minus autopilot clock from the last answered TIMESYNC [ns]; 0 before.
  [[nodiscard]] DurationNs companion_offset_ns() const { return companion_offset_ns_; }
  [[nodiscard]] AutopilotParameters& parameters() { return parameters_; }
  /// What parameters say of the flight is obeyed from here on.
  void apply_parameters();
  [[nodiscard]] std::uint64_t setpoints_dropped() const { return setpoints_dropped_; }
  [[nodiscard]] std::uint64_t frames_received() const { return frames_received_; }

 private:
  void handle(const mavlink::Frame& frame, TimeNs now_ns);
  void on_command(const mavlink::CommandLong& command, const mavlink::Frame& frame, TimeNs now_ns);
  CommandResult obey(const mavlink::CommandLong& command, TimeNs now_ns);
  CommandResult reboot(const mavlink::CommandLong& command, TimeNs now_ns);
  void on_setpoint(const mavlink::SetAttitudeTarget& target, TimeNs now_ns);
  CommandResult set_mode(float main_mode);
  CommandResult set_interval(const mavlink::CommandLong& command);
  CommandResult send_version(TimeNs now_ns);
  void on_parameter_read(const mavlink::ParamRequestRead& request);
  void on_parameter_set(const mavlink::ParamSet& request);
  void send_parameter(const SimParameter& row);
  [[nodiscard]] bool is(Flavour flavour) const { return flight_.kind().flavour == flavour; }
  void on_timesync(const mavlink::Timesync& sync, const mavlink::Frame& frame, TimeNs now_ns);
  void send_heartbeat();
  void send_attitude(TimeNs now_ns);
  void send_local_position(TimeNs now_ns);
  void send_imu(const ImuSample& imu, TimeNs now_ns);
  void send_text(std::string_view text, std::uint8_t severity);
  [[nodiscard]] TimeNs own_time(TimeNs now_ns) const { return now_ns + clock_offset_ns_; }
  template <class Message>
  void send(const Message& message);

  FlightController& flight_;
  DurationNs clock_offset_ns_, companion_offset_ns_ = 0;
  mavlink::Encoder encoder_{1, 1};
  mavlink::Parser parser_;
  SensorFailures failures_;
  TimeNs silent_until_ns_ = kNever;  ///< starting again
  std::vector<std::uint8_t> output_;
  AutopilotParameters parameters_;
  std::uint64_t ticks_ = 0, frames_received_ = 0, setpoints_dropped_ = 0;
  std::uint64_t beat_every_ = 200, imu_every_ = 1, attitude_every_ = 2;  ///< ticks
  std::uint64_t position_every_ = 0;                                     ///< 0: not asked for
  Vec3 position_ned_m_ = Vec3::Zero(), velocity_ned_mps_ = Vec3::Zero();
};

/// HEARTBEAT.custom_mode of a mode.
std::uint32_t custom_mode_of(const AutopilotKind& kind, ControllerMode mode);

/// Setpoint of a SET_ATTITUDE_TARGET; false when it must be ignored (masked attitude or thrust, numbers not finite, a
/// quaternion that is none).
bool setpoint_of(const mavlink::SetAttitudeTarget& target, Flavour flavour, AttitudeSetpoint& setpoint);

}  // namespace wasp::sim
