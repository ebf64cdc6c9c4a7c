// The whole simulated vehicle on virtual time: physics at 1 kHz, sensors, flight controller and serial link at 200 Hz.
// It reads no clock: `advance_to` runs it as far as it is told, so a lockstep test and the real-time program use the
// same class, and the same seed and bytes give the same flight.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/autopilot_link.h"
#include "sim/pose.h"
#include "sim/safety_pilot.h"
#include "sim/sim_config.h"
#include "sim/vehicle.h"
#include "types/messages.h"

namespace wasp::sim {

inline constexpr DurationNs kPhysicsPeriod_ns = kMillisecond;
inline constexpr DurationNs kControlPeriod_ns = 5 * kMillisecond;  ///< IMU and flight controller, 200 Hz

class Simulator {
 public:
  explicit Simulator(const SimConfig& config, TimeNs start_ns = 0);
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  /// Runs whole milliseconds until less than one is left before `t`; earlier times change nothing.
  void advance_to(TimeNs t_ns);
  [[nodiscard]] TimeNs now_ns() const { return now_ns_; }

  /// Bytes the companion wrote. Heard now, or a little later where a real clock runs on between two ticks.
  void from_companion(std::span<const std::uint8_t> bytes) { link_.receive(bytes, now_ns_); }
  void from_companion(std::span<const std::uint8_t> bytes, TimeNs heard_at_ns) { link_.receive(bytes, heard_at_ns); }
  /// Moves the bytes the autopilot has written to the end of `out`.
  void drain(std::vector<std::uint8_t>& out) { link_.drain(out); }
  /// The same of the autopilot's second port, which sends its heartbeat and what it is asked for.
  void from_second_port(std::span<const std::uint8_t> bytes, TimeNs heard_at_ns) {
    second_.receive(bytes, heard_at_ns);
  }
  void drain_second_port(std::vector<std::uint8_t>& out) { second_.drain(out); }

  [[nodiscard]] Truth truth() const;
  [[nodiscard]] BodyPose pose() const;
  /// Since the vehicle first left the ground (on the turntable: since it was first armed) [s]; 0 before.
  [[nodiscard]] double flight_time_s() const;
  [[nodiscard]] const FlightController& flight() const { return flight_; }
  [[nodiscard]] const Vehicle& vehicle() const { return vehicle_; }
  [[nodiscard]] const AutopilotLink& link() const { return link_; }

 private:
  void physics_step();
  void control_tick();

  Vec3 camera_body_m_;
  StandParams stand_;
  Vehicle vehicle_;
  Wind wind_;
  ImuModel imu_;
  FlightController flight_;
  AutopilotLink link_, second_;
  SafetyPilot pilot_;
  std::array<double, 4> wanted_radps_{};
  TimeNs start_ns_, now_ns_, took_off_ns_ = kNever;
  std::uint64_t physics_steps_ = 0;
};

}  // namespace wasp::sim
