#include "sim/stand.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace wasp::sim {
namespace {

constexpr double kRamp_s = 0.2;
constexpr std::array<double, 6> kThirds{1, -1, 2, -2, 3, -3};

/// Share of the amplitude in step number `i`; 0 before the first.
double step_share(std::int64_t i) { return i < 0 ? 0 : kThirds[static_cast<std::size_t>(i) % kThirds.size()] / 3; }

}  // namespace

double stand_yaw_rate_radps(const StandParams& p, double t_s) {
  const double t = t_s - p.start_s;
  if (t < 0) return 0;
  if (p.profile == StandProfile::kSine) return p.amplitude_radps * std::sin(2 * std::numbers::pi * t / p.period_s);
  const double steps = t / (p.period_s / 2);
  const auto i = static_cast<std::int64_t>(steps);
  const double into_s = (steps - static_cast<double>(i)) * p.period_s / 2, share = std::min(1.0, into_s / kRamp_s);
  return p.amplitude_radps * (step_share(i - 1) + share * (step_share(i) - step_share(i - 1)));
}

VehicleState carried(const StandParams& params, const VehicleState& before, double t_s, double gravity_mps2) {
  VehicleState s;
  const double rate = stand_yaw_rate_radps(params, t_s);
  s.position_ned_m = {0, 0, -params.height_m};
  s.q_ned_body =
      (before.q_ned_body * Eigen::Quaterniond(Eigen::AngleAxisd(rate * kPhysicsStep_s, Eigen::Vector3d::UnitZ())))
          .normalized();
  s.rate_body_radps.z() = rate;
  s.specific_force_body_mps2 = {0, 0, -gravity_mps2};
  return s;
}

}  // namespace wasp::sim
