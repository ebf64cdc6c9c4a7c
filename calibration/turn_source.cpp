#include "calibration/turn_source.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace wasp::calibration {
namespace {

using Eigen::Vector3d;

constexpr DurationNs kHalfWindow = 30 * kMillisecond;
constexpr DurationNs kLongestHold = 20 * kMillisecond;  ///< a pose that stays for longer says that nothing moved

/// Rotation vector of the shorter way.
Vector3d vector_of(Eigen::Quaterniond q) {
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  return sine < 1e-12 ? Vector3d(2 * q.vec()) : Vector3d(2 * std::atan2(sine, q.w()) / sine * q.vec());
}

/// Poses without those that only repeat the last one.
std::vector<drivers::PoseSample> news(const std::vector<drivers::PoseSample>& poses) {
  std::vector<drivers::PoseSample> out;
  for (const auto& pose : poses)
    if (out.empty() || pose.position_m != out.back().position_m ||
        pose.q_world_sensor.coeffs() != out.back().q_world_sensor.coeffs() ||
        pose.time_ns - out.back().time_ns >= kLongestHold)
      out.push_back(pose);
  return out;
}

/// Slopes of turn (the sensor's axes) and position (the world's) about pose i.
struct Slopes {
  Vector3d turn_radps, velocity_mps;
};

Slopes slopes_at(const std::vector<drivers::PoseSample>& poses, std::size_t i) {
  const TimeNs now = poses[i].time_ns;
  std::size_t first = i - 1, last = i + 1;
  while (first > 0 && now - poses[first - 1].time_ns <= kHalfWindow) --first;
  while (last + 1 < poses.size() && poses[last + 1].time_ns - now <= kHalfWindow) ++last;
  const std::size_t half = std::min(i - first, last - i);  // even about the instant
  double t = 0, tt = 0;
  Vector3d r = Vector3d::Zero(), tr = Vector3d::Zero(), x = Vector3d::Zero(), tx = Vector3d::Zero();
  const auto count = static_cast<double>(2 * half + 1);
  for (std::size_t k = i - half; k <= i + half; ++k) {
    const double dt = to_seconds(poses[k].time_ns - now);
    const Vector3d turn = vector_of(poses[i].q_world_sensor.conjugate() * poses[k].q_world_sensor);
    const Vector3d moved = poses[k].position_m - poses[i].position_m;
    t += dt, tt += dt * dt, r += turn, tr += dt * turn, x += moved, tx += dt * moved;
  }
  const double spread = count * tt - t * t;
  return {(count * tr - t * r) / spread, (count * tx - t * x) / spread};
}

/// A point X of the floor on the optical axis, distance Z: (x/z)' = -v_x / Z - w_y, (y/z)' = -v_y / Z + w_x; growth v_z
/// / Z.
Vector3d floor_rates(const drivers::PoseStream& poses, const drivers::PoseSample& pose, const Vector3d& rate_cam,
                     const Vector3d& velocity_world) {
  const Eigen::Matrix3d R_world_cam = pose.q_world_sensor.toRotationMatrix() * *poses.R_sensor_cam;
  const double down = -R_world_cam(2, 2), height = pose.position_m.z() - *poses.floor_z_m;
  const double distance = height / std::max(down, 0.2);
  if (!(distance > 0.05)) return Vector3d::Zero();
  const Vector3d v = R_world_cam.transpose() * velocity_world / distance;
  return {-v.x() - rate_cam.y(), -v.y() + rate_cam.x(), v.z()};
}

}  // namespace

TurnSource TurnSource::from_gyro(const drivers::InertialStream& inertial) {
  TurnSource source;
  source.name_ = "gyro of " + inertial.source;
  source.axes_known_ = inertial.R_cam_imu.has_value();
  const Eigen::Matrix3d R = inertial.R_cam_imu.value_or(Eigen::Matrix3d::Identity());
  for (const auto& sample : inertial.samples) {
    MotionRates rates = MotionRates::Zero();
    rates.head<3>() = R * sample.gyro_radps;
    source.add(sample.time_ns, rates);
  }
  return source;
}

TurnSource TurnSource::from_poses(const drivers::PoseStream& poses) {
  TurnSource source;
  source.name_ = "poses of " + poses.source;
  source.axes_known_ = poses.R_sensor_cam.has_value();
  source.over_floor_ = source.axes_known_ && poses.floor_z_m.has_value();
  const Eigen::Matrix3d R = poses.R_sensor_cam.value_or(Eigen::Matrix3d::Identity()).transpose();
  const std::vector<drivers::PoseSample> samples = news(poses.samples);
  for (std::size_t i = 1; i + 1 < samples.size(); ++i) {
    const Slopes slopes = slopes_at(samples, i);
    MotionRates rates = MotionRates::Zero();
    rates.head<3>() = R * slopes.turn_radps;
    if (source.over_floor_) rates.tail<3>() = floor_rates(poses, samples[i], rates.head<3>(), slopes.velocity_mps);
    source.add(samples[i].time_ns, rates);
  }
  return source;
}

std::optional<TurnSource> TurnSource::best_of(const drivers::RecordingMotion& motion) {
  if (motion.inertial.has_gyro && motion.inertial.samples.size() > 2) return from_gyro(motion.inertial);
  if (motion.poses.samples.size() > 4) return from_poses(motion.poses);
  return std::nullopt;
}

void TurnSource::add(TimeNs time_ns, const MotionRates& rates) {
  const bool first = times_ns_.empty();
  const bool gap = !first && time_ns - times_ns_.back() > drivers::kLongestPoseGap;
  MotionRates integral = MotionRates::Zero();
  if (!first) integral = integrals_.back() + 0.5 * to_seconds(time_ns - times_ns_.back()) * (rates_.back() + rates);
  piece_.push_back(first ? 0 : piece_.back() + (gap ? 1 : 0));
  times_ns_.push_back(time_ns);
  rates_.push_back(rates);
  integrals_.push_back(integral);
}

std::optional<MotionRates> TurnSource::integral(TimeNs time_ns) const {
  const auto after = std::lower_bound(times_ns_.begin(), times_ns_.end(), time_ns);
  if (after == times_ns_.end() || (after == times_ns_.begin() && *after != time_ns)) return std::nullopt;
  const auto i = static_cast<std::size_t>(after - times_ns_.begin());
  if (*after == time_ns) return integrals_[i];
  const double dt = to_seconds(time_ns - times_ns_[i - 1]), whole = to_seconds(times_ns_[i] - times_ns_[i - 1]);
  const MotionRates rate = rates_[i - 1] + dt / whole * (rates_[i] - rates_[i - 1]);
  return integrals_[i - 1] + 0.5 * dt * (rates_[i - 1] + rate);
}

std::optional<MotionRates> TurnSource::mean_rate(TimeNs from_ns, TimeNs until_ns) const {
  const auto from = integral(from_ns), until = integral(until_ns);
  if (!from || !until || until_ns <= from_ns) return std::nullopt;
  const auto piece = [&](TimeNs t) {
    return piece_[static_cast<std::size_t>(std::lower_bound(times_ns_.begin(), times_ns_.end(), t) -
                                           times_ns_.begin())];
  };
  const auto first_after = std::upper_bound(times_ns_.begin(), times_ns_.end(), from_ns) - times_ns_.begin();
  const auto before = first_after > 0 ? piece_[static_cast<std::size_t>(first_after - 1)] : 0;
  if (before != piece(until_ns)) return std::nullopt;
  return MotionRates((*until - *from) / to_seconds(until_ns - from_ns));
}

}  // namespace wasp::calibration
