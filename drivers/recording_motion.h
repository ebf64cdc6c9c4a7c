// What was recorded beside the frames of a recording: inertial samples and true poses, in the recording's own clock and
// the sensors' own axes, and how those lie to the camera where the recording says so. And what follows: the pose and
// the attitude at an instant. Realtime-safe: no.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "types/camera.h"
#include "types/messages.h"

namespace wasp::drivers {

struct InertialSample {
  TimeNs time_ns = 0;
  Eigen::Vector3d gyro_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_mps2 = Eigen::Vector3d::Zero();  ///< specific force
};

struct InertialStream {
  std::string source{};  ///< the file
  bool has_gyro = false, has_accel = false;
  std::vector<InertialSample> samples{};  ///< times rise strictly
  /// Camera axes (right, down, forward) from the sensor's: v_cam = R_cam_imu v_imu; nullopt: the recording is silent.
  std::optional<Eigen::Matrix3d> R_cam_imu{};
};

struct PoseSample {
  TimeNs time_ns = 0;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_world_sensor = Eigen::Quaterniond::Identity();
};

struct PoseStream {
  std::string source{};
  bool level = false;  ///< the world's z axis is known to point up
  std::vector<PoseSample> samples{};
  std::optional<Eigen::Matrix3d> R_sensor_cam{};  ///< nullopt: the recording is silent
  /// The camera is known to look down at a level floor, which has this z in the world [m].
  std::optional<double> floor_z_m{};
};

struct RecordingMotion {
  InertialStream inertial;
  PoseStream poses;
};

/// Two samples further apart than this do not say what was between them.
inline constexpr DurationNs kLongestPoseGap = 150 * kMillisecond;

/// Pose at an instant between two samples (straight line, great arc); nullopt outside the stream or in a gap.
std::optional<PoseSample> pose_at(const PoseStream& poses, TimeNs time_ns);

/// Attitude of the body that carries the camera with `R_body_cam`, and its rates over the 40 ms about the instant, from
/// the poses of a stream that is level and knows its camera; nullopt where those do not say.
std::optional<AttitudeSample> attitude_of(const RecordingMotion& motion, const Mat3& R_body_cam, TimeNs time_ns);

/// Mean specific force of the samples in (after_ns, until_ns], body axes; nullopt: none, or axes unknown.
std::optional<std::array<float, 3>> mean_specific_force(const RecordingMotion& motion, const Mat3& R_body_cam,
                                                        TimeNs after_ns, TimeNs until_ns);

}  // namespace wasp::drivers
