#include "sim/pose_placement.h"

#include <cmath>

namespace wasp::sim {
namespace {

constexpr double kSamePlace_m = 2;  // a source that goes on this near to where it stopped is the same
constexpr float kOffTheGround_m = 0.05f;
constexpr float kRising_mps = 0.15f;

Quat about_vertical(float angle_rad) { return Quat(Eigen::AngleAxisf(angle_rad, Vec3::UnitZ())); }

}  // namespace

void PosePlacement::armed(bool armed) {
  armed_ = armed;
  if (armed) armed_once_ = true;
}

/// The vehicle's centre is never below its standing height.
Vec3 PosePlacement::in_world(const Eigen::Vector3d& position_ned_m) const {
  Vec3 world = q_world_ned_ * (position_ned_m - origin_ned_m_).cast<float>();
  world.z() = std::fmin(world.z(), -params_.standing_m);
  return world;
}

/// Joins what begins anew on what was before.
void PosePlacement::join(const ReportedPosition& reported) {
  const bool same_place = (reported.position_ned_m - last_reported_m_).norm() < kSamePlace_m;
  if (joining_ && !same_place)
    origin_ned_m_ = reported.position_ned_m - (q_world_ned_.conjugate() * last_world_m_).cast<double>();
  if (restarted_ && !same_place) {
    placed_ = false;
    armed_once_ = armed_;
  }
  joining_ = restarted_ = false;
}

void PosePlacement::find_origin(const ReportedPosition& reported) {
  if (!params_.keep_heading) q_world_ned_ = about_vertical(-heading_rad_);
  const Eigen::Vector3d standing(0, 0, static_cast<double>(params_.standing_m));
  if (params_.origin_ned_m)
    origin_ned_m_ = params_.origin_ned_m->cast<double>();
  else
    origin_ned_m_ = armed_once_ ? standing : Eigen::Vector3d(reported.position_ned_m + standing);
  placed_ = true;
}

PositionFix PosePlacement::place(const ReportedPosition& reported, TimeNs at_ns) {
  join(reported);
  // Who is told once a second that it is armed may rise before that.
  const bool rises = placed_ && reported.velocity_ned_mps.z() < -kRising_mps;
  const bool at_start = !armed_once_ && !rises && !params_.origin_ned_m;
  if (!placed_ || at_start) find_origin(reported);
  last_reported_m_ = reported.position_ned_m;
  last_world_m_ = in_world(reported.position_ned_m);
  const bool up = -last_world_m_.z() > params_.standing_m + kOffTheGround_m;
  if (up && armed_once_ && left_ground_at_ns_ == kNever) left_ground_at_ns_ = at_ns;
  const Vec3 velocity = at_start ? Vec3(Vec3::Zero()) : Vec3(q_world_ned_ * reported.velocity_ned_mps);
  return {at_ns, last_world_m_, velocity};
}

AttitudeFix PosePlacement::place(const AttitudeFix& reported) {
  heading_rad_ = euler_from_quat(reported.q_ned_body).yaw_rad;
  AttitudeFix fix = reported;
  fix.q_ned_body = (q_world_ned_ * reported.q_ned_body).normalized();
  return fix;
}

}  // namespace wasp::sim
