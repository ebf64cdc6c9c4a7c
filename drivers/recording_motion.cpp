#include "drivers/recording_motion.h"

#include <algorithm>

namespace wasp::drivers {
namespace {

constexpr DurationNs kRateHalf = 20 * kMillisecond;  ///< motion capture is too noisy to differentiate over less

/// World z up to NED: x north from the world's y, y east from its x.
Eigen::Matrix3d R_ned_world() {
  Eigen::Matrix3d R;
  R << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  return R;
}

/// Turn about its own axes per second over the 40 ms about the instant; zero where the stream does not reach so far.
Eigen::Vector3d rate_of(const PoseStream& poses, TimeNs time_ns) {
  const auto before = pose_at(poses, time_ns - kRateHalf), after = pose_at(poses, time_ns + kRateHalf);
  if (!before || !after) return Eigen::Vector3d::Zero();
  const Eigen::AngleAxisd turn(before->q_world_sensor.conjugate() * after->q_world_sensor);
  return turn.axis() * turn.angle() / to_seconds(2 * kRateHalf);
}

}  // namespace

std::optional<PoseSample> pose_at(const PoseStream& poses, TimeNs time_ns) {
  const auto after = std::lower_bound(poses.samples.begin(), poses.samples.end(), time_ns,
                                      [](const PoseSample& p, TimeNs t) { return p.time_ns < t; });
  if (after == poses.samples.end()) return std::nullopt;
  if (after->time_ns == time_ns) return *after;
  if (after == poses.samples.begin() || after->time_ns - std::prev(after)->time_ns > kLongestPoseGap)
    return std::nullopt;
  const PoseSample& before = *std::prev(after);
  const double share =
      static_cast<double>(time_ns - before.time_ns) / static_cast<double>(after->time_ns - before.time_ns);
  return PoseSample{time_ns, before.position_m + share * (after->position_m - before.position_m),
                    before.q_world_sensor.slerp(share, after->q_world_sensor)};
}

std::optional<AttitudeSample> attitude_of(const RecordingMotion& motion, const Mat3& R_body_cam, TimeNs time_ns) {
  const PoseStream& poses = motion.poses;
  if (!poses.level || !poses.R_sensor_cam) return std::nullopt;
  const auto pose = pose_at(poses, time_ns);
  if (!pose) return std::nullopt;
  const Eigen::Matrix3d R_sensor_body = *poses.R_sensor_cam * R_body_cam.cast<double>().transpose();
  const Eigen::Matrix3d R_ned_body = R_ned_world() * pose->q_world_sensor.toRotationMatrix() * R_sensor_body;
  const Eigen::Quaterniond q(R_ned_body);
  const Eigen::Vector3d rate_body_radps = R_sensor_body.transpose() * rate_of(poses, time_ns);
  AttitudeSample out;
  out.exposed_at_ns = time_ns;
  out.q_ned_body = {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()),
                    static_cast<float>(q.z())};
  for (int i = 0; i < 3; ++i) out.rate_body_radps[static_cast<std::size_t>(i)] = static_cast<float>(rate_body_radps[i]);
  return out;
}

std::optional<std::array<float, 3>> mean_specific_force(const RecordingMotion& motion, const Mat3& R_body_cam,
                                                        TimeNs after_ns, TimeNs until_ns) {
  const InertialStream& inertial = motion.inertial;
  if (!inertial.has_accel || !inertial.R_cam_imu) return std::nullopt;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (auto it = std::upper_bound(inertial.samples.begin(), inertial.samples.end(), after_ns,
                                  [](TimeNs t, const InertialSample& s) { return t < s.time_ns; });
       it != inertial.samples.end() && it->time_ns <= until_ns; ++it, ++count)
    sum += it->accel_mps2;
  if (count == 0) return std::nullopt;
  const Eigen::Vector3d mean = R_body_cam.cast<double>() * (*inertial.R_cam_imu * (sum / count));
  return std::array{static_cast<float>(mean.x()), static_cast<float>(mean.y()), static_cast<float>(mean.z())};
}

}  // namespace wasp::drivers
