#include "calibration/kinect_depth_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace wasp::calibration {
namespace {

using drivers::KinectDepthModel;
using drivers::KinectModel;
using Eigen::MatrixXd, Eigen::VectorXd;

constexpr double kMiddle = 800, kScale = 300;  ///< raw values as s = (x - 800) / 300 in the exponentials

constexpr double kFlattest = -6.9;  ///< of p2: flatter ones have coefficients beyond all numbers

/// a exp(-((x - b)/c)^2) = exp(p0 + p1 s - exp(p2) s^2).
void parabola_of(const double* abc, double* p) {
  const double d = kMiddle - abc[1];
  p[2] = std::log(kScale * kScale / (abc[2] * abc[2]));
  p[1] = -2 * d * kScale / (abc[2] * abc[2]);
  p[0] = std::log(abc[0]) - d * d / (abc[2] * abc[2]);
}
void gaussian_of(const double* p, double* abc) {
  abc[2] = kScale / std::exp(0.5 * p[2]);
  const double d = -p[1] * abc[2] * abc[2] / (2 * kScale);
  abc[1] = kMiddle - d;
  abc[0] = std::exp(p[0] + d * d / (abc[2] * abc[2]));
}

/// Unscaled coefficients to numbers of order one, and back.
VectorXd parameters_of(const KinectDepthModel& m) {
  const auto& c = m.coefficients;
  if (m.kind == KinectModel::kLinear) return Eigen::Vector2d(1000 * c[0], c[1]);
  if (m.kind == KinectModel::kTangent) return Eigen::Vector3d(c[0], c[1] / 1000, 10 * c[2]);
  VectorXd p(6);
  parabola_of(c.data(), p.data());
  parabola_of(c.data() + 3, p.data() + 3);
  return p;
}
KinectDepthModel model_of(KinectModel kind, const VectorXd& p) {
  KinectDepthModel m;
  m.kind = kind;
  auto& c = m.coefficients;
  if (kind == KinectModel::kLinear) {
    c[0] = p[0] / 1000, c[1] = p[1];
  } else if (kind == KinectModel::kTangent) {
    c[0] = p[0], c[1] = 1000 * p[1], c[2] = p[2] / 10;
  } else {
    gaussian_of(p.data(), c.data());
    gaussian_of(p.data() + 3, c.data() + 3);
  }
  return m;
}

double depth_of(KinectModel kind, const VectorXd& p, double raw) {
  if (kind != KinectModel::kTwoGaussians) return drivers::model_depth_m(model_of(kind, p), raw);
  const double s = (raw - kMiddle) / kScale;
  const auto bell = [s](const double* q) { return std::exp(q[0] + q[1] * s - std::exp(q[2]) * s * s); };
  return 0.01 * (bell(p.data()) + bell(p.data() + 3));
}

VectorXd gradient(KinectModel kind, const VectorXd& p, double raw) {
  VectorXd g(p.size());
  for (Eigen::Index k = 0; k < p.size(); ++k) {
    const double h = 1e-6 * std::max(1.0, std::fabs(p[k]));
    VectorXd up = p, down = p;
    up[k] += h, down[k] -= h;
    g[k] = (depth_of(kind, up, raw) - depth_of(kind, down, raw)) / (2 * h);
  }
  return g;
}

/// Residuals in standard deviations; a raw step at z is worth 3.07 mm z^2.
VectorXd residuals(KinectModel kind, const VectorXd& p, const std::vector<KinectPoint>& points,
                   const VectorXd& weight) {
  VectorXd r(static_cast<Eigen::Index>(points.size()));
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    const KinectPoint& point = points[static_cast<std::size_t>(i)];
    r[i] = weight[i] * (depth_of(kind, p, point.raw) - point.distance_m);
  }
  return r;
}

VectorXd weights(const std::vector<KinectPoint>& points, const KinectNoise& noise) {
  VectorXd w(static_cast<Eigen::Index>(points.size()));
  for (Eigen::Index i = 0; i < w.size(); ++i) {
    const double z = points[static_cast<std::size_t>(i)].distance_m;
    w[i] = 1 / std::hypot(noise.tape_m, noise.raw_steps * -drivers::kBurrusLinear.coefficients[0] * z * z);
  }
  return w;
}

MatrixXd jacobian(KinectModel kind, const VectorXd& p, const std::vector<KinectPoint>& points, const VectorXd& w) {
  MatrixXd J(w.size(), p.size());
  for (Eigen::Index i = 0; i < w.size(); ++i)
    J.row(i) = w[i] * gradient(kind, p, points[static_cast<std::size_t>(i)].raw).transpose();
  return J;
}

/// False where no step improves and the residuals are not finite.
bool minimise(KinectModel kind, VectorXd& p, const std::vector<KinectPoint>& points, const VectorXd& w) {
  double damping = 1e-3;
  VectorXd r = residuals(kind, p, points, w);
  if (!r.allFinite()) return false;
  for (int step = 0; step < 400 && damping < 1e12; ++step) {
    const MatrixXd J = jacobian(kind, p, points, w);
    MatrixXd A = J.transpose() * J;
    A.diagonal() *= 1 + damping;
    A.diagonal().array() += 1e-12;
    VectorXd next = p - A.ldlt().solve(J.transpose() * r);
    if (kind == KinectModel::kTwoGaussians) next[2] = std::max(next[2], kFlattest), next[5] = std::max(next[5], kFlattest);
    const VectorXd r_next = residuals(kind, next, points, w);
    if (next.allFinite() && r_next.allFinite() && r_next.squaredNorm() < r.squaredNorm()) {
      const double gain = 1 - r_next.squaredNorm() / r.squaredNorm();
      p = next, r = r_next;
      damping = std::max(damping / 5, 1e-9);
      if (gain < 1e-10) break;
    } else {
      damping *= 4;
    }
  }
  return true;
}

/// Where to begin: the published coefficients; for the Gaussians, whose sum has valleys to get caught in, other widths
/// and places of the first one as well.
std::vector<VectorXd> starts(KinectModel kind) {
  KinectDepthModel m;
  drivers::published_model(drivers::name_of(kind), m);
  std::vector<VectorXd> out{parameters_of(m)};
  if (kind != KinectModel::kTwoGaussians) return out;
  for (const double width : {0.7, 1.0, 1.6, 2.5})
    for (const double place : {1100.0, 1200.0, 1338.0}) {
      KinectDepthModel other = m;
      other.coefficients[0] *= 0.1, other.coefficients[1] = place, other.coefficients[2] *= width;
      out.push_back(parameters_of(other));
    }
  return out;
}

/// The best of all starts; empty if none leads anywhere.
VectorXd solve(KinectModel kind, const std::vector<KinectPoint>& points, const VectorXd& w) {
  VectorXd best;
  double least = 1e300;
  for (VectorXd p : starts(kind)) {
    if (!minimise(kind, p, points, w)) continue;
    const double cost = residuals(kind, p, points, w).squaredNorm();
    if (cost < least) least = cost, best = p;
  }
  return best;
}

/// What the points leave open gets a variance beyond all measure instead of none.
MatrixXd inverse(const MatrixXd& A) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> e(A);
  const double floor = 1e-14 * std::max(e.eigenvalues().maxCoeff(), 1e-300);
  const VectorXd inverted = e.eigenvalues().cwiseMax(floor).cwiseInverse();
  return e.eigenvectors() * inverted.asDiagonal() * e.eigenvectors().transpose();
}

double held_out(KinectModel kind, const VectorXd& start, const std::vector<KinectPoint>& points, const VectorXd& w) {
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::vector<KinectPoint> rest = points;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
    VectorXd rest_w(w.size() - 1);
    rest_w << w.head(static_cast<Eigen::Index>(i)), w.tail(w.size() - 1 - static_cast<Eigen::Index>(i));
    VectorXd p = start;
    minimise(kind, p, rest, rest_w);
    const double share = depth_of(kind, p, points[i].raw) / points[i].distance_m - 1;
    sum += share * share;
  }
  return std::sqrt(sum / static_cast<double>(points.size()));
}

}  // namespace

double KinectDepthFit::sigma_m(double raw) const {
  const VectorXd g = gradient(model.kind, parameters, raw);
  return std::sqrt(std::max(0.0, g.dot(covariance * g)));
}

double KinectDepthFit::worst_sigma_share(const std::vector<KinectPoint>& points) const {
  const auto [low, high] = std::minmax_element(points.begin(), points.end(),
                                               [](const auto& a, const auto& b) { return a.raw < b.raw; });
  double worst = 0;
  constexpr int kSteps = 50;
  for (int i = 0; i <= kSteps; ++i) {
    const double raw = low->raw + (high->raw - low->raw) * i / kSteps;
    const double share = sigma_m(raw) / depth_of(model.kind, parameters, raw);
    worst = std::isfinite(share) && share >= 0 ? std::max(worst, share) : 1e9;
  }
  return worst;
}

std::optional<KinectDepthFit> fit_kinect_depth(KinectModel kind, const std::vector<KinectPoint>& points,
                                               const KinectNoise& noise) {
  const VectorXd w = weights(points, noise);
  if (w.size() <= drivers::coefficient_count(kind)) return std::nullopt;
  const VectorXd p = solve(kind, points, w);
  if (p.size() == 0) return std::nullopt;
  KinectDepthFit fit;
  fit.model = model_of(kind, p);
  fit.parameters = p;
  const VectorXd r = residuals(kind, p, points, w);
  fit.chi2_per_freedom = r.squaredNorm() / static_cast<double>(w.size() - p.size());
  const MatrixXd J = jacobian(kind, p, points, w);
  const MatrixXd A = J.transpose() * J;
  fit.covariance = std::max(1.0, fit.chi2_per_freedom) * inverse(A);
  double sum = 0, share = 0, low = 1e9, high = 0;
  for (const KinectPoint& point : points) {
    const double residual = depth_of(kind, p, point.raw) - point.distance_m;
    fit.residual_m.push_back(residual);
    sum += residual * residual;
    share += residual * residual / (point.distance_m * point.distance_m);
    low = std::min(low, point.distance_m), high = std::max(high, point.distance_m);
  }
  fit.rms_m = std::sqrt(sum / static_cast<double>(points.size()));
  fit.rms_share = std::sqrt(share / static_cast<double>(points.size()));
  fit.held_out_share = held_out(kind, p, points, w);
  fit.model.range = {static_cast<float>(low), static_cast<float>(high)};
  if (!std::isfinite(fit.rms_m)) return std::nullopt;
  return fit;
}

}  // namespace wasp::calibration
