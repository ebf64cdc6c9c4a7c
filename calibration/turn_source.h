// What the vehicle's own sensors say of its turning: the integral of a gyro, or of the rates that differentiated poses
// give; and, where poses come with a level floor below a camera that looks down, how that floor moves in the image.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "drivers/recording_motion.h"

namespace wasp::calibration {

/// 0 ... 2: turn rates [rad/s], in camera axes (right, down, forward) where the recording knows how the sensor lies to
/// the camera, else in the sensor's. 3 ... 5: shift of a level floor at the centre of the image, right and down, in
/// focal lengths a second, and its growth [1/s].
using MotionRates = Eigen::Matrix<double, 6, 1>;

class TurnSource {
 public:
  static TurnSource from_gyro(const drivers::InertialStream& inertial);
  /// Rates at each pose are the slope of a straight line through the turns within 30 ms, or to its two neighbours:
  /// motion capture is too noisy to differentiate over less. The filter is even about the instant and so delays
  /// nothing. A log faster than its motion capture repeats poses: between two it would be late by half their distance,
  /// so the repeated ones are left out.
  static TurnSource from_poses(const drivers::PoseStream& poses);
  /// The gyro where there is one, else the poses; nullopt: neither.
  static std::optional<TurnSource> best_of(const drivers::RecordingMotion& motion);

  /// Mean rates between two instants; nullopt where the samples do not reach or leave a gap above 0.15 s.
  [[nodiscard]] std::optional<MotionRates> mean_rate(TimeNs from_ns, TimeNs until_ns) const;
  [[nodiscard]] TimeNs begin_ns() const { return times_ns_.empty() ? 0 : times_ns_.front(); }
  [[nodiscard]] TimeNs end_ns() const { return times_ns_.empty() ? 0 : times_ns_.back(); }
  [[nodiscard]] std::size_t size() const { return times_ns_.size(); }
  [[nodiscard]] const std::string& name() const { return name_; }
  /// The recording says how the sensor lies to the camera.
  [[nodiscard]] bool axes_known() const { return axes_known_; }
  [[nodiscard]] bool over_floor() const { return over_floor_; }

 private:
  void add(TimeNs time_ns, const MotionRates& rates);
  [[nodiscard]] std::optional<MotionRates> integral(TimeNs time_ns) const;

  std::string name_;
  bool axes_known_ = false, over_floor_ = false;
  std::vector<TimeNs> times_ns_;
  std::vector<MotionRates> rates_, integrals_;
  std::vector<std::size_t> piece_;  ///< number of gaps before the sample
};

}  // namespace wasp::calibration
