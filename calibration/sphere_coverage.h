// How much of the sphere a set of directions covers: the measure of whether a three-axis sensor was turned enough.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace wasp::calibration {

/// Cells of about equal size, each the neighbourhood of one point of a Fibonacci lattice.
inline constexpr int kSphereCells = 96;  ///< about 20 degrees across

/// The cell of a direction (unit vector).
int sphere_cell(const Eigen::Vector3d& direction);

struct SphereCoverage {
  int cells = 0;              ///< of kSphereCells, that hold a direction
  double widest_gap_rad = 0;  ///< radius of the largest empty cap, within a few degrees
};
SphereCoverage sphere_coverage(const std::vector<Eigen::Vector3d>& directions);

}  // namespace wasp::calibration
