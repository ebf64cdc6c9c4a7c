#include "sim/flight_controller.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/imu_model.h"

namespace wasp::sim {
namespace {

constexpr float kStep_s = 0.005f;
constexpr float kDescent_mps = -0.3f;
constexpr float kDescentGain = 0.15f, kDescentIntegral_ps = 0.08f;
constexpr DurationNs kStanding_ns = 500 * kMillisecond;   ///< on the legs this long: landed
constexpr DurationNs kStreamGap_ns = 500 * kMillisecond;  ///< PX4: setpoints at more than 2 Hz ...
constexpr DurationNs kStreamFirst_ns = kSecond;           ///< ... for so long before the mode
constexpr float kIdleThrust = 0.03f;                      ///< below this the propellers only turn over

}  // namespace

FlightController::FlightController(const VehicleParams& params, const AutopilotKind& kind)
    : params_(params), kind_(kind), controller_(params) {
  if (kind.on_silence != OnSilence::kDescend) timeout_ns_ = kSecond;  // COM_OF_LOSS_T, GUID_TIMEOUT
}

void FlightController::set_setpoint(const AttitudeSetpoint& setpoint, TimeNs now_ns) {
  if (kind_.hears_in_mode && mode_ != ControllerMode::kOffboard) return;
  if (now_ns - setpoint_at_ns_ > kStreamGap_ns) streaming_since_ns_ = now_ns;
  setpoint_ = setpoint;
  setpoint_at_ns_ = now_ns;
}

/// What others need to take a vehicle on the ground for landed: PX4 thrust below MPC_MANTHR_MIN, ArduCopter being asked
/// down.
bool FlightController::asked_up() const {
  constexpr float kPx4Idle = 0.1f;
  const bool heard = mode_ == ControllerMode::kOffboard && now_ns_ - setpoint_at_ns_ <= timeout_ns_;
  if (kind_.flavour == Flavour::kWasp || !heard) return false;
  return setpoint_.thrust >= (kind_.climb_rate ? 0.5f : kPx4Idle);
}

CommandResult FlightController::arm(bool armed, bool force) {
  if (armed && !armed_ && !force && !(estimator_.settled() && on_ground_)) return CommandResult::kTemporarilyRejected;
  if (!armed && armed_ && !force && (!on_ground_ || asked_up())) return CommandResult::kDenied;
  if (armed != armed_) event_ = armed ? "armed" : "disarmed";
  if (armed && !armed_) mode_since_ns_ = now_ns_, grounded_since_ns_ = kLongAgo;
  armed_ = armed;
  descending_ = level_ = false;
  idle_since_ns_ = kLongAgo;
  return CommandResult::kAccepted;
}

bool FlightController::streamed() const {
  return now_ns_ - setpoint_at_ns_ <= kStreamGap_ns && now_ns_ - streaming_since_ns_ >= kStreamFirst_ns;
}

CommandResult FlightController::set_mode(ControllerMode mode) {
  if (mode == ControllerMode::kOffboard && kind_.needs_stream && mode_ != mode && !streamed())
    return CommandResult::kTemporarilyRejected;
  if (mode != mode_) {
    event_ = mode == ControllerMode::kOffboard ? "mode offboard"
             : mode == ControllerMode::kLand   ? "mode land"
                                               : "mode manual";
    mode_since_ns_ = now_ns_;
    descending_ = level_ = false;
  }
  mode_ = mode;
  return CommandResult::kAccepted;
}

std::string_view FlightController::take_event() { return std::exchange(event_, {}); }

std::array<double, 4> FlightController::step(const ImuSample& imu, bool on_ground, TimeNs now_ns) {
  now_ns_ = now_ns;
  on_ground_ = on_ground;
  estimate(imu, kStep_s);
  watch_setpoints(on_ground, now_ns);
  if (!armed_) {
    controller_.reset();
    return {};
  }
  const AttitudeSetpoint active = active_setpoint(kStep_s);
  if (active.thrust >= kIdleThrust) return controller_.step(active, euler(), rate_body_radps(), kStep_s);
  controller_.reset();
  const double idle_radps = 0.1 * params_.rotor.max_speed_radps();
  return {idle_radps, idle_radps, idle_radps, idle_radps};
}

void FlightController::estimate(const ImuSample& imu, float dt_s) {
  const Euler now = euler();
  const float tilt = std::hypot(now.roll_rad, now.pitch_rad);
  const float wanted = armed_ ? std::hypot(setpoint_.euler.roll_rad, setpoint_.euler.pitch_rad) : 0.f;
  estimator_.step(imu, dt_s, on_ground_ && !armed_, std::max(tilt, wanted));
  const Vec3 accel(imu.accel_body_mps2[0], imu.accel_body_mps2[1], imu.accel_body_mps2[2]);
  const double height_m = height_of_pressure_m(static_cast<double>(imu.pressure_hpa));
  vertical_.step(up_acceleration(accel, euler()), static_cast<float>(height_m), dt_s);
}

void FlightController::start_descent(std::string_view event) {
  if (descending_) return;
  descending_ = true;
  descent_integral_ = 0;
  descent_yaw_rad_ = euler().yaw_rad;
  event_ = event;
}

void FlightController::watch_setpoints(bool on_ground, TimeNs now_ns) {
  if (!armed_) return;
  const TimeNs since = std::max(setpoint_at_ns_, mode_since_ns_);  // a mode just entered has the same grace
  const bool silent = now_ns - since > timeout_ns_;
  watch_idleness(on_ground, now_ns);
  if (mode_ == ControllerMode::kManual && !on_ground) start_descent("nobody flies: levelling and descending");
  if (mode_ == ControllerMode::kLand) start_descent("landing");
  if (mode_ == ControllerMode::kOffboard && silent) lose_setpoints();
  if (mode_ == ControllerMode::kOffboard && !silent && (descending_ || level_)) {
    descending_ = level_ = false;
    event_ = "setpoints are back: following";
  }
  if (!descending_ || !on_ground) grounded_since_ns_ = kLongAgo;
  if (descending_ && on_ground && grounded_since_ns_ == kLongAgo) grounded_since_ns_ = now_ns;
  if (descending_ && on_ground && now_ns - grounded_since_ns_ > kStanding_ns) {
    armed_ = descending_ = false;
    event_ = "landed: disarmed";
  }
}

void FlightController::lose_setpoints() {
  switch (kind_.on_silence) {
    case OnSilence::kDescend:
      return start_descent("no setpoint for 0.5 s: levelling and descending");
    case OnSilence::kLand:
      set_mode(ControllerMode::kLand);
      event_ = "Failsafe mode on: no offboard setpoints, landing";
      return;
    case OnSilence::kLevel:
      if (!level_) event_ = "no setpoint for 1 s: level";
      descent_yaw_rad_ = level_ ? descent_yaw_rad_ : euler().yaw_rad;
      level_ = true;
  }
}

/// Armed on the ground with nobody who takes off.
void FlightController::watch_idleness(bool on_ground, TimeNs now_ns) {
  if (kind_.idle_disarm_ns == 0) return;
  if (!on_ground || idle_since_ns_ == kLongAgo) idle_since_ns_ = now_ns;
  if (now_ns - idle_since_ns_ < kind_.idle_disarm_ns) return;
  armed_ = descending_ = false;
  event_ = "Disarmed: nobody took off";
}

/// Level, at a climb rate.
AttitudeSetpoint FlightController::own_flight(float climb_mps, float dt_s) {
  return {{trim_roll_rad_, trim_pitch_rad_, descent_yaw_rad_}, false, 0, climb_thrust(climb_mps, dt_s)};
}

AttitudeSetpoint FlightController::active_setpoint(float dt_s) {
  if (descending_) return own_flight(kDescent_mps, dt_s);
  if (level_) return own_flight(0.f, dt_s);
  const bool heard = mode_ == ControllerMode::kOffboard && setpoint_at_ns_ >= mode_since_ns_ - timeout_ns_;
  if (!heard) return {};
  AttitudeSetpoint setpoint = setpoint_;
  setpoint.euler.roll_rad += trim_roll_rad_;
  setpoint.euler.pitch_rad += trim_pitch_rad_;
  setpoint.yaw_rate_radps += trim_yaw_rate_radps_;
  if (kind_.climb_rate) {
    const float wish = 2 * (setpoint_.thrust - 0.5f);
    setpoint.thrust = climb_thrust(wish * (wish > 0 ? climb_up_mps_ : climb_down_mps_), dt_s);
  }
  return setpoint;
}

/// PI on the climb rate about the hover thrust; on the ground the propellers are let go unless it is asked up.
float FlightController::climb_thrust(float climb_mps, float dt_s) {
  if (on_ground_ && climb_mps <= 0) {
    descent_integral_ = 0;
    return 0;
  }
  const float error = climb_mps - vertical_.climb_mps();
  descent_integral_ = std::clamp(descent_integral_ + kDescentIntegral_ps * error * dt_s, -0.15f, 0.1f);
  const auto hover = static_cast<float>(params_.hover_thrust());
  return std::clamp(hover + kDescentGain * error + descent_integral_, 0.6f * hover, 1.f);
}

}  // namespace wasp::sim
