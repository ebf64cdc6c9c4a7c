// What a flight controller decides: armed or not, which mode, whose setpoint. In offboard it follows attitude
// setpoints. Without one for a while it does what its kind does (autopilot_kind.h): wasp's own, after 0.5 s, levels and
// descends gently until it stands, then disarms; a new setpoint before that takes over again. PX4 leaves for a landing,
// ArduCopter levels and stays. Manual while flying descends likewise: nobody holds the sticks of a simulated radio.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "sim/attitude_controller.h"
#include "sim/attitude_estimator.h"
#include "sim/autopilot_kind.h"
#include "sim/vertical_estimator.h"
#include "types/messages.h"

namespace wasp::sim {

inline constexpr DurationNs kSetpointTimeout_ns = 500 * kMillisecond;

enum class ControllerMode : std::uint32_t { kManual = 0, kOffboard = 1, kLand = 2 };

/// Answers to commands, as MAV_RESULT numbers.
enum class CommandResult : std::uint8_t {
  kAccepted = 0,
  kTemporarilyRejected = 1,
  kDenied = 2,
  kUnsupported = 3,
  kFailed = 4
};

class FlightController {
 public:
  explicit FlightController(const VehicleParams& params, const AutopilotKind& kind = {});

  /// One IMU sample (200 Hz); wanted rotor speeds [rad/s]. `on_ground` is the switch in the legs.
  std::array<double, 4> step(const ImuSample& imu, bool on_ground, TimeNs now_ns);

  void set_setpoint(const AttitudeSetpoint& setpoint, TimeNs now_ns);
  /// Disarming in flight, or while a stream asks it to stay up, needs `force`; arming needs a settled estimate and
  /// ground under the legs.
  CommandResult arm(bool armed, bool force);
  /// As after power-up: disarmed, manual, nothing estimated. In the air the vehicle falls.
  void restart() { *this = FlightController(params_, kind_); }
  CommandResult set_mode(ControllerMode mode);
  /// How long a setpoint lasts, and what the thrust field means: parameters of other autopilots.
  void set_timeout(DurationNs timeout_ns) { timeout_ns_ = timeout_ns; }
  void set_climb_rate(bool meant, float up_mps, float down_mps) {
    kind_.climb_rate = meant, climb_up_mps_ = up_mps, climb_down_mps_ = down_mps;
  }
  /// Small corrections a safety pilot adds to the companion's roll and pitch [rad] and yaw rate [rad/s].
  void set_trim(float roll_rad, float pitch_rad, float yaw_rate_radps = 0) {
    trim_roll_rad_ = roll_rad, trim_pitch_rad_ = pitch_rad, trim_yaw_rate_radps_ = yaw_rate_radps;
  }

  [[nodiscard]] bool armed() const { return armed_; }
  [[nodiscard]] bool descending() const { return descending_; }  ///< without a companion
  [[nodiscard]] const AutopilotKind& kind() const { return kind_; }
  [[nodiscard]] bool settled() const { return estimator_.settled(); }
  [[nodiscard]] ControllerMode mode() const { return mode_; }
  [[nodiscard]] const AttitudeSetpoint& setpoint() const { return setpoint_; }
  [[nodiscard]] Euler euler() const { return estimator_.euler(); }
  [[nodiscard]] Vec3 rate_body_radps() const { return estimator_.rate_body_radps(); }
  [[nodiscard]] float barometric_height_m() const { return vertical_.height_m(); }
  /// Text of the latest event, once; empty if there is none.
  std::string_view take_event();

 private:
  void estimate(const ImuSample& imu, float dt_s);
  void watch_setpoints(bool on_ground, TimeNs now_ns);
  [[nodiscard]] AttitudeSetpoint active_setpoint(float dt_s);
  [[nodiscard]] float climb_thrust(float climb_mps, float dt_s);
  [[nodiscard]] bool asked_up() const;
  void watch_idleness(bool on_ground, TimeNs now_ns);
  void lose_setpoints();
  [[nodiscard]] bool streamed() const;
  [[nodiscard]] AttitudeSetpoint own_flight(float climb_mps, float dt_s);
  void start_descent(std::string_view event);

  VehicleParams params_;
  AutopilotKind kind_;
  DurationNs timeout_ns_ = kSetpointTimeout_ns;
  float climb_up_mps_ = 2.5f, climb_down_mps_ = 1.5f;
  AttitudeEstimator estimator_;
  VerticalEstimator vertical_;
  AttitudeController controller_;
  AttitudeSetpoint setpoint_;
  static constexpr TimeNs kLongAgo = INT64_MIN / 2;  ///< leaves room to subtract
  TimeNs streaming_since_ns_ = kLongAgo, idle_since_ns_ = kLongAgo;
  TimeNs setpoint_at_ns_ = kLongAgo, grounded_since_ns_ = kLongAgo, mode_since_ns_ = kLongAgo, now_ns_ = kLongAgo;
  ControllerMode mode_ = ControllerMode::kManual;
  bool armed_ = false, descending_ = false, on_ground_ = true, level_ = false;
  float trim_roll_rad_ = 0, trim_pitch_rad_ = 0, trim_yaw_rate_radps_ = 0;
  float descent_integral_ = 0, descent_yaw_rad_ = 0;
  std::string_view event_;
};

}  // namespace wasp::sim
