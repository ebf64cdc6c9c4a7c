// How far the camera turned between successive grey frames of a recording, by its own flow alone. Two estimates a pair:
//   rotation: the turn that explains most of the flow, as if nothing had moved (robust: Tukey's weights);
//   epipolar: turn and direction of travel together, each cell at whatever depth it likes. Right where the camera moves
//             among near things; where a small field of view cannot tell a turn from a sideways step, noisy.
// Which of them to believe is for whoever has something to hold against them (delay_fit.h).
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <vector>

#include "drivers/recording.h"

namespace wasp::calibration {

struct ImageTurn {
  TimeNs first_ns = 0, second_ns = 0;  ///< stamps of the two frames
  bool valid = false;
  Eigen::Vector3d rotation_rad = Eigen::Vector3d::Zero();  ///< the camera's own turn, its axes (right, down, forward)
  Eigen::Vector3d epipolar_rad = Eigen::Vector3d::Zero();
  /// How the image as a whole moved at its centre, for a camera over a level floor: shift right and down in units of
  /// the focal length, and the natural logarithm of its growth. NaN without a similarity that most of the flow follows.
  Eigen::Vector3d centre = Eigen::Vector3d::Constant(std::nan(""));
  int cells = 0;
};

/// One viewing direction in two frames, unit, camera axes.
struct DirectionPair {
  Eigen::Vector3d first, second;
};

/// The turn that takes most of `first` to `second`: second = exp(-[turn]) first. Needs three pairs.
Eigen::Vector3d fit_rotation(const std::vector<DirectionPair>& pairs);

/// The turn that, with some direction of travel, leaves the least angles between `second` and the epipolar planes.
/// Starts from `start_rad`. Needs eight pairs.
Eigen::Vector3d fit_epipolar(const std::vector<DirectionPair>& pairs, const Eigen::Vector3d& start_rad);

/// Instants of the frames: the recorder's stamps, or, where those are of an arrival and jitter about an even grid (the
/// recording knows them apart from its frames' times), the grid by frame number that fits them best.
std::vector<TimeNs> frame_stamps(const drivers::Recording& recording);

/// Turns of all pairs of successive grey frames with at most two lost between them. `progress` hears the share done.
std::vector<ImageTurn> image_turns(const drivers::Recording& recording,
                                   const std::function<void(double)>& progress = {});

}  // namespace wasp::calibration
