#include "calibration/robust_line.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace wasp::calibration {
namespace {

double middle(std::vector<double> v) {
  if (v.empty()) return 0;
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

/// Median of the slopes of pairs; of at most about 300 points.
double median_slope(const std::vector<LinePoint>& points) {
  std::vector<double> slopes;
  const std::size_t step = points.size() / 300 + 1;
  for (std::size_t i = 0; i < points.size(); i += step)
    for (std::size_t j = i + step; j < points.size(); j += step)
      if (const double dx = points[j].x - points[i].x; dx != 0) slopes.push_back((points[j].y - points[i].y) / dx);
  return middle(std::move(slopes));
}

void least_squares(const std::vector<LinePoint>& points, bool with_drift, double least_sigma, RobustLine& line) {
  const int n = with_drift ? 3 : 2;
  Eigen::MatrixXd A(static_cast<Eigen::Index>(line.used_count), n);
  Eigen::VectorXd y(A.rows());
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!line.used[i]) continue;
    A(row, 0) = 1, A(row, 1) = points[i].x, y[row] = points[i].y;
    if (with_drift) A(row, 2) = points[i].t;
    ++row;
  }
  const Eigen::VectorXd p = A.colPivHouseholderQr().solve(y);
  const double cost = (y - A * p).squaredNorm();
  const double spare = static_cast<double>(A.rows() - n);
  const double variance = std::max(spare > 0 ? cost / spare : 0.0, least_sigma * least_sigma);
  const Eigen::VectorXd sigma =
      (variance * (A.transpose() * A).completeOrthogonalDecomposition().pseudoInverse().diagonal())
          .cwiseMax(0)
          .cwiseSqrt();
  line.offset = p[0], line.slope = p[1], line.drift = with_drift ? p[2] : 0;
  line.offset_sigma = sigma[0], line.slope_sigma = sigma[1], line.drift_sigma = with_drift ? sigma[2] : 0;
  line.residual_rms = std::sqrt(cost / static_cast<double>(A.rows()));
}

void choose(const std::vector<LinePoint>& points, double least_sigma, RobustLine& line) {
  std::vector<double> size;
  for (const auto& p : points) size.push_back(std::fabs(p.y - line.at(p)));
  const double limit = 4 * std::max(1.4826 * middle(size), std::max(least_sigma, 1e-12));
  line.used_count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) line.used_count += (line.used[i] = size[i] <= limit) ? 1 : 0;
}

}  // namespace

RobustLine fit_line(const std::vector<LinePoint>& points, bool with_drift, double least_sigma) {
  RobustLine line;
  line.used.assign(points.size(), true);
  line.used_count = points.size();
  line.slope = median_slope(points);
  std::vector<double> offsets;
  for (const auto& p : points) offsets.push_back(p.y - line.slope * p.x);
  line.offset = middle(std::move(offsets));
  for (int round = 0; round < 5; ++round) {
    if (points.size() >= 6) choose(points, least_sigma, line);  // of fewer nobody can tell which is wrong
    if (line.used_count < 3) line.used.assign(points.size(), true), line.used_count = points.size();
    least_squares(points, with_drift, least_sigma, line);
  }
  return line;
}

}  // namespace wasp::calibration
