#include "calibration/image_turns.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "vision/kernels/derotate.h"
#include "vision/kernels/flow_grid.h"
#include "vision/kernels/similarity_fit.h"

namespace wasp::calibration {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;
using Pairs = std::vector<DirectionPair>;

constexpr int kRounds = 10;
constexpr double kLeastScale = 2e-4;  ///< of residuals [rad]: what flow can do; 0.1 px at 500 px of focal length
constexpr std::size_t kLeastCells = 12;

Matrix3d rotation(const Vector3d& turn) {
  const double angle = turn.norm();
  if (angle < 1e-12) return Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Tukey's weights for residuals against their own robust scale.
std::vector<double> weights_of(const std::vector<double>& residuals) {
  const double scale = std::max(1.4826 * median(residuals), kLeastScale);
  std::vector<double> weights;
  for (const double r : residuals) {
    const double u = r / (4.685 * scale);
    weights.push_back(u < 1 ? (1 - u * u) * (1 - u * u) : 0);
  }
  return weights;
}

/// Weighted Kabsch: R with second = R^T first.
Matrix3d kabsch(const Pairs& pairs, const std::vector<double>& weights) {
  Matrix3d H = Matrix3d::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i) H += weights[i] * pairs[i].second * pairs[i].first.transpose();
  const Eigen::JacobiSVD<Matrix3d> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3d flip = Matrix3d::Identity();
  flip(2, 2) = (svd.matrixV() * svd.matrixU().transpose()).determinant();
  return svd.matrixV() * flip * svd.matrixU().transpose();
}

Vector3d turn_of(const Matrix3d& R) {
  const Eigen::AngleAxisd turn(R);
  return turn.axis() * turn.angle();
}

/// Turn and direction of travel; the direction moves in the plane across itself.
struct Motion {
  Vector3d turn, travel;
};

Motion moved(const Motion& motion, const Eigen::Matrix<double, 5, 1>& step) {
  const Vector3d across = motion.travel.unitOrthogonal(), third = motion.travel.cross(across);
  return {motion.turn + step.head<3>(), (motion.travel + step[3] * across + step[4] * third).normalized()};
}

/// Sines of the angles between `second` and the epipolar planes; a cell near the direction of travel says little.
Eigen::VectorXd off_plane(const Pairs& pairs, const Motion& motion) {
  constexpr double kNear = 0.05;
  const Matrix3d R = rotation(motion.turn).transpose();
  Eigen::VectorXd out(static_cast<Eigen::Index>(pairs.size()));
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Vector3d normal = motion.travel.cross(R * pairs[i].first);
    out[static_cast<Eigen::Index>(i)] = pairs[i].second.dot(normal) / std::sqrt(normal.squaredNorm() + kNear * kNear);
  }
  return out;
}

std::vector<double> magnitudes(const Eigen::VectorXd& values) {
  std::vector<double> out;
  for (const double v : values) out.push_back(std::abs(v));
  return out;
}

/// Cost that can be compared between starts: residuals beyond the flow's own noise are all as bad.
double cost_of(const Eigen::VectorXd& residuals) {
  double sum = 0;
  for (const double r : residuals) {
    const double u = r * r / (25 * kLeastScale * kLeastScale);
    sum += u / (1 + u);
  }
  return sum;
}

/// Gauss-Newton with Tukey's weights from one start.
Motion descend(const Pairs& pairs, Motion motion) {
  constexpr double kStep = 1e-6;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::VectorXd r = off_plane(pairs, motion);
    Eigen::Matrix<double, Eigen::Dynamic, 5> J(r.size(), 5);
    for (int k = 0; k < 5; ++k)
      J.col(k) = (off_plane(pairs, moved(motion, kStep * Eigen::Matrix<double, 5, 1>::Unit(k))) - r) / kStep;
    const std::vector<double> w = weights_of(magnitudes(r));
    const Eigen::VectorXd weights = Eigen::Map<const Eigen::VectorXd>(w.data(), r.size());
    Eigen::Matrix<double, 5, 5> A = J.transpose() * weights.asDiagonal() * J;
    A.diagonal() += Eigen::Matrix<double, 5, 1>::Constant(1e-6 * A.trace() + 1e-12);
    Eigen::Matrix<double, 5, 1> step = -A.ldlt().solve(J.transpose() * weights.asDiagonal() * r);
    if (!step.allFinite()) break;
    const double length = step.tail<2>().norm();
    if (length > 0.5) step *= 0.5 / length;
    motion = moved(motion, step);
    if (step.norm() < 1e-8) break;
  }
  return motion;
}

/// Cells of a flow field as directions.
Pairs directions_of(const Lens& lens, const vision::FlowField& flow) {
  Pairs pairs;
  for (int i = 0; i < flow.count(); ++i) {
    const FlowCell& cell = flow.cells[static_cast<std::size_t>(i)];
    Vec3 first, second;
    if (cell.valid == 0 || !vision::direction_of(lens, {cell.x_px, cell.y_px}, first) ||
        !vision::direction_of(lens, {cell.x_px + cell.u_px, cell.y_px + cell.v_px}, second))
      continue;
    pairs.push_back({first.cast<double>(), second.cast<double>()});
  }
  return pairs;
}

/// Shift in focal lengths and growth of the image at the principal point.
Vector3d centre_motion(const Intrinsics& k, const vision::FlowField& flow) {
  const vision::SimilarityFit fit = vision::fit_similarity({.centre_x_px = k.cx_px, .centre_y_px = k.cy_px}, flow);
  if (!fit.valid) return Vector3d::Constant(std::nan(""));
  return {static_cast<double>(fit.shift_u_px / k.fx_px), static_cast<double>(fit.shift_v_px / k.fy_px),
          static_cast<double>(fit.log_scale)};
}

/// Frames lost between two of a rate.
bool close_enough(TimeNs first_ns, TimeNs second_ns, DurationNs period_ns) {
  return second_ns > first_ns && second_ns - first_ns < 7 * period_ns / 2;
}

DurationNs usual_period(const std::vector<TimeNs>& stamps) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i) steps.push_back(static_cast<double>(stamps[i] - stamps[i - 1]));
  return steps.empty() ? kSecond : static_cast<DurationNs>(median(steps));
}

}  // namespace

Vector3d fit_rotation(const Pairs& pairs) {
  std::vector<double> weights(pairs.size(), 1.0), residuals(pairs.size());
  Matrix3d R = Matrix3d::Identity();
  for (int round = 0; round < kRounds; ++round) {
    R = kabsch(pairs, weights);
    for (std::size_t i = 0; i < pairs.size(); ++i)
      residuals[i] = (pairs[i].second - R.transpose() * pairs[i].first).norm();
    weights = weights_of(residuals);
  }
  return turn_of(R);
}

Vector3d fit_epipolar(const Pairs& pairs, const Vector3d& start_rad) {
  static const std::array<Vector3d, 9> kTravels = {Vector3d(1, 0, 0),  Vector3d(0, 1, 0),  Vector3d(0, 0, 1),
                                                   Vector3d(1, 1, 0),  Vector3d(1, -1, 0), Vector3d(1, 0, 1),
                                                   Vector3d(1, 0, -1), Vector3d(0, 1, 1),  Vector3d(0, 1, -1)};
  Motion best{start_rad, Vector3d::UnitZ()};
  double least = 1e300;
  for (const Vector3d& travel : kTravels) {
    const Motion motion = descend(pairs, {start_rad, travel.normalized()});
    const double cost = cost_of(off_plane(pairs, motion));
    if (motion.turn.allFinite() && cost < least) least = cost, best = motion;
  }
  return best.turn;
}

std::vector<TimeNs> frame_stamps(const drivers::Recording& recording) {
  const auto& entries = recording.entries();
  std::vector<TimeNs> stamps;
  bool arrivals = false;
  for (const auto& entry : entries) {
    stamps.push_back(entry.stamped_ns);
    arrivals = arrivals || entry.stamped_ns != recording.time_ns(entry);
  }
  if (!arrivals || entries.size() < 3) return stamps;
  // The line through (frame number, stamp) that leaves the least squares.
  const double n0 = entries.front().sequence;
  const TimeNs t0 = stamps.front();
  double n = 0, t = 0, nn = 0, nt = 0;
  const auto count = static_cast<double>(entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const double x = entries[i].sequence - n0, y = static_cast<double>(stamps[i] - t0);
    n += x, t += y, nn += x * x, nt += x * y;
  }
  const double slope = (count * nt - n * t) / (count * nn - n * n), start = (t - slope * n) / count;
  for (std::size_t i = 0; i < entries.size(); ++i)
    stamps[i] = t0 + std::llround(start + slope * (entries[i].sequence - n0));
  return stamps;
}

std::vector<ImageTurn> image_turns(const drivers::Recording& recording, const std::function<void(double)>& progress) {
  const auto size = recording.gray_size();
  if (size.pixels() == 0) throw std::runtime_error(recording.folder().string() + ": holds no grey images");
  const std::vector<TimeNs> stamps = frame_stamps(recording);
  const DurationNs period_ns = usual_period(stamps);
  vision::FlowGrid grid(size.width_px, size.height_px, {});
  vision::FlowField flow;
  std::array<std::vector<std::uint8_t>, 2> pixels{std::vector<std::uint8_t>(size.pixels()),
                                                  std::vector<std::uint8_t>(size.pixels())};
  const auto view = [&](std::size_t i) {
    return GrayView{pixels[i].data(), size.width_px, size.height_px, size.width_px};
  };
  std::vector<ImageTurn> turns;
  std::optional<TimeNs> last_ns;
  std::size_t now = 0;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (progress) progress(static_cast<double>(i) / static_cast<double>(stamps.size()));
    if (!recording.entries()[i].has_gray()) continue;
    try {
      recording.load_gray(i, pixels[now]);
    } catch (const std::runtime_error&) {  // decodes no further than its header: as good as lost
      continue;
    }
    if (last_ns && close_enough(*last_ns, stamps[i], period_ns)) {
      grid.track(view(1 - now), view(now), flow);
      const Pairs pairs = directions_of(recording.geometry().lens(), flow);
      ImageTurn turn{*last_ns, stamps[i], pairs.size() >= kLeastCells};
      turn.cells = static_cast<int>(pairs.size());
      turn.centre = centre_motion(recording.intrinsics(), flow);
      if (turn.valid) {
        turn.rotation_rad = fit_rotation(pairs);
        turn.epipolar_rad = fit_epipolar(pairs, turn.rotation_rad);
      }
      turns.push_back(turn);
    }
    last_ns = stamps[i];
    now = 1 - now;
  }
  return turns;
}

}  // namespace wasp::calibration
