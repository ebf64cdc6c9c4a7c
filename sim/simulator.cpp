#include "sim/simulator.h"

namespace wasp::sim {
namespace {

constexpr std::uint64_t kStepsPerControl = kControlPeriod_ns / kPhysicsPeriod_ns;

std::array<float, 3> to_floats(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

}  // namespace

Simulator::Simulator(const SimConfig& config, TimeNs start_ns)
    : camera_body_m_(config.camera.position_body_m),
      stand_(config.stand),
      vehicle_(config.vehicle),
      wind_(config.wind, mix(config.seed, 2)),
      imu_(config.imu, mix(config.seed, 1)),
      flight_(config.vehicle, kind_of(config.flavour)),
      link_(flight_, from_seconds(config.clock_offset_s)),
      second_(flight_, from_seconds(config.clock_offset_s), Chatter::kHeartbeat),
      pilot_(config.safety_pilot && !config.stand.turntable, config.pilot),
      start_ns_(start_ns),
      now_ns_(start_ns) {
  for (const auto& assignment : config.autopilot_parameters) link_.parameters().set(assignment);
  link_.apply_parameters();
  if (stand_.turntable) physics_step();
}

void Simulator::advance_to(TimeNs t_ns) {
  while (now_ns_ + kPhysicsPeriod_ns <= t_ns) {
    physics_step();
    now_ns_ += kPhysicsPeriod_ns;
    if (++physics_steps_ % kStepsPerControl == 0) control_tick();
  }
}

void Simulator::physics_step() {
  if (stand_.turntable) {
    const double t_s = to_seconds(now_ns_ - start_ns_);
    return vehicle_.reset(carried(stand_, vehicle_.state(), t_s, vehicle_.params().gravity_mps2));
  }
  wind_.step(kPhysicsStep_s);
  vehicle_.set_wind(wind_.velocity_ned_mps());
  vehicle_.step(wanted_radps_);
}

void Simulator::control_tick() {
  const VehicleState& state = vehicle_.state();
  const bool flies = stand_.turntable ? flight_.armed() : !state.on_ground;
  if (flies && took_off_ns_ == kNever) took_off_ns_ = now_ns_;
  ImuSample imu = imu_.sample(state, to_seconds(kControlPeriod_ns), now_ns_);
  link_.failures().apply(imu);
  const AttitudeSetpoint commanded = flight_.descending() ? AttitudeSetpoint{} : flight_.setpoint();
  const PilotTrim trim = pilot_.step(state, commanded, flight_.armed() && !state.on_ground);
  flight_.set_trim(trim.roll_rad, trim.pitch_rad, trim.yaw_rate_radps);
  wanted_radps_ = flight_.step(imu, state.on_ground, now_ns_);
  const LocalPosition where{to_floats(state.position_ned_m), to_floats(state.velocity_ned_mps)};
  second_.share_reboot(link_);
  link_.share_reboot(second_);
  link_.step(imu, where, now_ns_);
  second_.step(imu, where, now_ns_);
}

double Simulator::flight_time_s() const { return took_off_ns_ == kNever ? 0 : to_seconds(now_ns_ - took_off_ns_); }

BodyPose Simulator::pose() const {
  const VehicleState& s = vehicle_.state();
  return {now_ns_,
          s.position_ned_m.cast<float>(),
          s.q_ned_body.cast<float>(),
          s.velocity_ned_mps.cast<float>(),
          s.rate_body_radps.cast<float>(),
          flight_time_s()};
}

Truth Simulator::truth() const {
  const VehicleState& s = vehicle_.state();
  const Eigen::Vector3d camera = s.position_ned_m + s.q_ned_body * camera_body_m_.cast<double>();
  Truth truth;
  truth.exposed_at_ns = now_ns_;
  truth.position_ned_m = to_floats(s.position_ned_m);
  truth.velocity_ned_mps = to_floats(s.velocity_ned_mps);
  const Eigen::Quaternionf q = s.q_ned_body.cast<float>();
  truth.q_ned_body = {q.w(), q.x(), q.y(), q.z()};
  truth.rate_body_radps = to_floats(s.rate_body_radps);
  truth.height_m = static_cast<float>(-camera.z());
  truth.armed = flight_.armed() ? 1.f : 0.f;
  truth.flight_time_s = static_cast<float>(flight_time_s());
  return truth;
}

}  // namespace wasp::sim
