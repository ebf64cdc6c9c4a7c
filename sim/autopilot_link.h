// The autopilot's side of the serial line: MAVLink 2 as system 1, component 1. Sends HEARTBEAT 1 Hz,
// ATTITUDE_QUATERNION 100 Hz, HIGHRES_IMU 200 Hz, LOCAL_POSITION_NED not at all, or each as asked; its own TIMESYNC
// requests 1 Hz, STATUSTEXT on events; answers
// TIMESYNC; obeys COMMAND_LONG 400 (arm), 176 (mode), 511 (interval of one of the four), 246 (reboot: disarmed, 1.5 s
// of silence, its clock starts again; denied while armed unless param6 is 20190226, as ArduPilot does), 420 (sensor
// failures, as PX4's simulation) and 31010 (MAV_CMD_USER_1: its clock jumps by param1 seconds); acknowledges every
// command; follows SET_ATTITUDE_TARGET. Its clock runs at an offset from the simulator's, so that a companion must
// synchronise.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "messages/mavlink_frame.h"
#include "messages/mavlink_messages.h"
#include "sim/autopilot_parameters.h"
#include "sim/flight_controller.h"
#include "sim/sensor_failures.h"

namespace wasp::sim {

/// Where the vehicle is, as its estimator has it: in the simulator, without error.
struct LocalPosition {
  std::array<float, 3> position_ned_m{}, velocity_ned_mps{};
};

/// What a link sends before anybody asks.
enum class Chatter : std::uint8_t {
  kFull,      ///< as above
  kHeartbeat  ///< a telemetry port: nothing else, and it tells no events
};

class AutopilotLink {
 public:
  /// `clock_offset_ns`: autopilot time minus simulation time. Its kind is the flight controller's.
  AutopilotLink(FlightController& flight, DurationNs clock_offset_ns, Chatter chatter = Chatter::kFull);

  /// Bytes from the companion, in any pieces.
  void receive(std::span<const std::uint8_t> bytes, TimeNs now_ns);
  /// Once for every IMU sample (200 Hz): queues what is due.
  void step(const ImuSample& imu, const LocalPosition& where, TimeNs now_ns);
  /// The autopilot was told to start again on another of its links.
  void share_reboot(const AutopilotLink& other);
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
  CommandResult send_version(TimeNs now_ns);
  void on_parameter_read(const mavlink::ParamRequestRead& request);
  void on_parameter_set(const mavlink::ParamSet& request);
  void send_parameter(const SimParameter& row);
  [[nodiscard]] bool is(Flavour flavour) const { return flight_.kind().flavour == flavour; }
  void on_timesync(const mavlink::Timesync& sync, const mavlink::Frame& frame, TimeNs now_ns);
  CommandResult set_interval(float message, float interval_us);
  void send_heartbeat();
  void send_attitude(TimeNs now_ns);
  void send_imu(const ImuSample& imu, TimeNs now_ns);
  void send_position(const LocalPosition& where, TimeNs now_ns);
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
  /// A message and how often it is sent [ticks]; 0: not.
  struct Stream {
    std::uint32_t id;
    std::uint64_t usual, every;
  };
  [[nodiscard]] bool due(std::size_t stream) const {
    return streams_[stream].every > 0 && ticks_ % streams_[stream].every == 0;
  }
  enum : std::size_t { kBeat, kAttitude, kImu, kPosition };
  bool tells_events_;
  std::array<Stream, 4> streams_;
};

/// HEARTBEAT.custom_mode of a mode.
std::uint32_t custom_mode_of(const AutopilotKind& kind, ControllerMode mode);

/// Setpoint of a SET_ATTITUDE_TARGET; false when it must be ignored (masked attitude or thrust, numbers not finite, a
/// quaternion that is none).
bool setpoint_of(const mavlink::SetAttitudeTarget& target, Flavour flavour, AttitudeSetpoint& setpoint);

}  // namespace wasp::sim
