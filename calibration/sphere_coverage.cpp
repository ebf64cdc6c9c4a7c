#include "calibration/sphere_coverage.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

namespace wasp::calibration {
namespace {

using Eigen::Vector3d;

std::vector<Vector3d> fibonacci(int n) {
  std::vector<Vector3d> points;
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (int i = 0; i < n; ++i) {
    const double z = 1 - (2 * i + 1.0) / n, r = std::sqrt(1 - z * z);
    points.emplace_back(r * std::cos(golden * i), r * std::sin(golden * i), z);
  }
  return points;
}

}  // namespace

int sphere_cell(const Vector3d& direction) {
  static const std::vector<Vector3d> kCentres = fibonacci(kSphereCells);
  const auto nearest = std::max_element(kCentres.begin(), kCentres.end(), [&](const auto& a, const auto& b) {
    return a.dot(direction) < b.dot(direction);
  });
  return static_cast<int>(nearest - kCentres.begin());
}

SphereCoverage sphere_coverage(const std::vector<Vector3d>& directions) {
  std::set<int> cells;
  for (const auto& d : directions) cells.insert(sphere_cell(d));
  double widest = 0;
  for (const Vector3d& probe : fibonacci(600)) {
    double nearest = -1;
    for (const auto& d : directions) nearest = std::max(nearest, probe.dot(d));
    widest = std::max(widest, std::acos(std::clamp(nearest, -1.0, 1.0)));
  }
  return {static_cast<int>(cells.size()), widest};
}

}  // namespace wasp::calibration
