#include "calibration/ellipsoid_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>

namespace wasp::calibration {
namespace {

using Eigen::Matrix3d, Eigen::MatrixXd, Eigen::Vector3d, Eigen::VectorXd;
using Samples = std::vector<EllipsoidSample>;

constexpr double kLeastEigenvalueShare = 1e-2, kFarthestNeutral = 2.0;  ///< of a sensor that measures at all
constexpr int kDraws = 600;
constexpr double kSpoilt = 0.2;  ///< of the median residual of the fit to all
constexpr int kIterations = 60;
constexpr double kOutlier = 4.0;  ///< standard deviations
constexpr double kTukey = 4.685;  ///< 95 % efficient for normal errors

double median_of(std::vector<double> v) {
  if (v.empty()) return 0;
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

/// Samples moved to their middle and shrunk to about one: the numbers the fit works on.
struct Scaling {
  Vector3d middle = Vector3d::Zero();
  double size = 1;
};

Scaling scaling_of(const Samples& samples) {
  Scaling s;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> v;
    for (const auto& p : samples) v.push_back(p.value[axis]);
    std::sort(v.begin(), v.end());
    s.middle[axis] = 0.5 * (v[v.size() / 20] + v[v.size() - 1 - v.size() / 20]);
  }
  std::vector<double> radii;
  for (const auto& p : samples) radii.push_back((p.value - s.middle).norm());
  s.size = std::max(median_of(radii), std::numeric_limits<double>::min());
  return s;
}

/// Parameters: neutral (3), K xx yy zz, [xy xz yz], [slopes (3)]; norm 1.
struct Parameters {
  Vector3d neutral = Vector3d::Zero(), slope = Vector3d::Zero();
  Matrix3d K = Matrix3d::Identity();
};

constexpr std::pair<int, int> kCross[3] = {{0, 1}, {0, 2}, {1, 2}};

double residual(const Parameters& p, const EllipsoidSample& s) {
  return (p.K * (s.value - p.neutral - p.slope * s.temperature_degc)).norm() - 1;
}

/// Row of the Jacobian of the residual.
VectorXd gradient(const EllipsoidModel& model, const Parameters& p, const EllipsoidSample& s) {
  const Vector3d d = s.value - p.neutral - p.slope * s.temperature_degc;
  const Vector3d v = p.K * d;
  const Vector3d u = v / std::max(v.norm(), 1e-12);
  VectorXd g(model.parameters());
  const Vector3d to_neutral = -p.K.transpose() * u;
  g.head<3>() = to_neutral;
  g.segment<3>(3) = u.cwiseProduct(d);
  int next = 6;
  if (model.cross_axis)
    for (const auto& [i, j] : kCross) g[next++] = u[i] * d[j] + u[j] * d[i];
  if (model.temperature) g.segment<3>(next) = to_neutral * s.temperature_degc;
  return g;
}

Parameters moved(const EllipsoidModel& model, Parameters p, const VectorXd& step) {
  p.neutral += step.head<3>();
  p.K.diagonal() += step.segment<3>(3);
  int next = 6;
  if (model.cross_axis)
    for (const auto& [i, j] : kCross) p.K(i, j) += step[next], p.K(j, i) += step[next], ++next;
  if (model.temperature) p.slope += step.segment<3>(next);
  return p;
}

/// Quadric x'Ax + b'x = 1 through the samples by least squares; nullopt when it is no ellipsoid.
std::optional<Parameters> algebraic(const std::vector<const EllipsoidSample*>& samples, bool cross_axis) {
  const int n = cross_axis ? 9 : 6;
  MatrixXd rows(static_cast<Eigen::Index>(samples.size()), n);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const Vector3d& m = samples[static_cast<std::size_t>(i)]->value;
    rows.row(i).head<3>() = m.cwiseProduct(m).transpose();
    rows.row(i).segment<3>(3) = m.transpose();
    if (cross_axis)
      for (int k = 0; k < 3; ++k) rows(i, 6 + k) = 2 * m[kCross[k].first] * m[kCross[k].second];
  }
  const VectorXd q = rows.colPivHouseholderQr().solve(VectorXd::Ones(rows.rows()));
  if (!q.allFinite()) return std::nullopt;
  Matrix3d A = q.head<3>().asDiagonal();
  if (cross_axis)
    for (int k = 0; k < 3; ++k) A(kCross[k].first, kCross[k].second) = A(kCross[k].second, kCross[k].first) = q[6 + k];
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(A);
  if (!(eigen.eigenvalues()[0] > kLeastEigenvalueShare * eigen.eigenvalues()[2])) return std::nullopt;
  Parameters p;
  p.neutral = -0.5 * A.ldlt().solve(q.segment<3>(3));
  const double scale = 1 + p.neutral.dot(A * p.neutral);
  if (!(scale > 0)) return std::nullopt;
  p.K = eigen.operatorSqrt() / std::sqrt(scale);
  // A nearly flat ellipsoid about a far centre passes by all readings (values are scaled to the unit sphere here).
  return p.K.allFinite() && p.neutral.norm() < kFarthestNeutral ? std::optional(p) : std::nullopt;
}

double median_residual(const Parameters& p, const Samples& samples) {
  std::vector<double> r;
  for (const auto& s : samples) r.push_back(std::fabs(residual(p, s)));
  return median_of(std::move(r));
}

/// Best of: all samples, the sphere about their middle, and many draws of few samples.
Parameters robust_start(const Samples& samples, bool cross_axis) {
  Parameters best;  // the unit sphere about the middle
  double least = median_residual(best, samples);
  const auto consider = [&](const std::vector<const EllipsoidSample*>& some, bool full) {
    const auto p = algebraic(some, full);
    if (!p) return;
    if (const double m = median_residual(*p, samples); m < least) least = m, best = *p;
  };
  std::vector<const EllipsoidSample*> all;
  for (const auto& s : samples) all.push_back(&s);
  consider(all, cross_axis);
  // Few readings always fit themselves: a draw is believed only where the fit to all is spoilt by gross errors.
  least *= kSpoilt;
  // As few as determine it, and one: of ten with a third wrong one draw in sixty is clean, of seven one in seventeen.
  std::mt19937 random(1);
  for (int draw = 0; draw < kDraws; ++draw)
    for (const std::size_t few : {std::size_t{7}, std::size_t{10}}) {
      if (few >= samples.size() || (few == 10 && !cross_axis)) continue;
      std::vector<const EllipsoidSample*> some;
      for (std::size_t k = 0; k < few; ++k) some.push_back(&samples[random() % samples.size()]);
      consider(some, few == 10);
    }
  return best;
}

struct Normal {
  MatrixXd matrix;
  VectorXd vector;
  double cost = 0;
};

/// Weighted normal equations; `weight` may be zero.
Normal normal_of(const EllipsoidModel& model, const Parameters& p, const Samples& samples, const VectorXd& weight) {
  const int n = model.parameters();
  Normal out{MatrixXd::Zero(n, n), VectorXd::Zero(n), 0};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double w = weight[static_cast<Eigen::Index>(i)];
    if (w <= 0) continue;
    const double r = residual(p, samples[i]);
    const VectorXd g = gradient(model, p, samples[i]);
    out.matrix.noalias() += w * g * g.transpose();
    out.vector.noalias() += w * r * g;
    out.cost += w * r * r;
  }
  return out;
}

double cost_of(const Parameters& p, const Samples& samples, const VectorXd& weight) {
  double cost = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double r = residual(p, samples[i]);
    cost += weight[static_cast<Eigen::Index>(i)] * r * r;
  }
  return cost;
}

/// Levenberg-Marquardt with fixed weights.
Parameters refine(const EllipsoidModel& model, Parameters p, const Samples& samples, const VectorXd& weight) {
  double damping = 1e-4;
  for (int i = 0; i < kIterations; ++i) {
    const Normal normal = normal_of(model, p, samples, weight);
    MatrixXd damped = normal.matrix;
    damped.diagonal() += damping * normal.matrix.diagonal() + VectorXd::Constant(damped.rows(), 1e-12);
    const VectorXd step = -damped.ldlt().solve(normal.vector);
    const Parameters next = moved(model, p, step);
    if (step.allFinite() && cost_of(next, samples, weight) <= normal.cost) {
      p = next;
      damping = std::max(damping * 0.1, 1e-12);
      if (step.norm() < 1e-12) break;
    } else if ((damping *= 10) > 1e8) {
      break;
    }
  }
  return p;
}

/// Standard deviation by the median, widened for few samples (Rousseeuw and Leroy 1987); never below `least`.
double robust_sigma(const EllipsoidModel& model, const Parameters& p, const Samples& samples, double least) {
  const double spare = std::max(1.0, static_cast<double>(samples.size()) - model.parameters());
  return std::max(1.4826 * (1 + 5 / spare) * median_residual(p, samples), least);
}

VectorXd tukey_weights(const Parameters& p, const Samples& samples, double sigma) {
  VectorXd w(static_cast<Eigen::Index>(samples.size()));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double x = residual(p, samples[i]) / (kTukey * sigma);
    w[static_cast<Eigen::Index>(i)] = std::fabs(x) < 1 ? std::pow(1 - x * x, 2) : 0;
  }
  return w;
}

VectorXd inliers(const Parameters& p, const Samples& samples, double sigma) {
  VectorXd w(static_cast<Eigen::Index>(samples.size()));
  for (std::size_t i = 0; i < samples.size(); ++i)
    w[static_cast<Eigen::Index>(i)] = std::fabs(residual(p, samples[i])) <= kOutlier * sigma ? 1 : 0;
  return w;
}

/// Covariance from scatter, and from the sums over groups (errors within a group may be the same error).
MatrixXd covariance_of(const EllipsoidModel& model, const Parameters& p, const Samples& samples, const VectorXd& used,
                       double least_sigma) {
  const Normal normal = normal_of(model, p, samples, used);
  const MatrixXd inverse = normal.matrix.completeOrthogonalDecomposition().pseudoInverse();
  const double spare = used.sum() - model.parameters();
  const double variance = std::max(spare > 0 ? normal.cost / spare : 0.0, least_sigma * least_sigma);
  std::map<int, VectorXd> sums;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (used[static_cast<Eigen::Index>(i)] <= 0) continue;
    auto& sum = sums.try_emplace(samples[i].group, VectorXd::Zero(model.parameters())).first->second;
    sum += residual(p, samples[i]) * gradient(model, p, samples[i]);
  }
  MatrixXd middle = MatrixXd::Zero(inverse.rows(), inverse.cols());
  for (const auto& [group, sum] : sums) middle += sum * sum.transpose();
  const MatrixXd plain = variance * inverse, grouped = inverse * middle * inverse;
  // Few groups say little: with less than three a parameter their sum is no measure.
  if (static_cast<int>(sums.size()) < 3 * model.parameters()) return plain;
  VectorXd stretch(inverse.rows());
  for (Eigen::Index i = 0; i < stretch.size(); ++i)
    stretch[i] = std::sqrt(std::max(1.0, grouped(i, i) / std::max(plain(i, i), 1e-300)));
  return stretch.asDiagonal() * plain * stretch.asDiagonal();
}

double least_eigenvalue_of(const EllipsoidModel& model, const Parameters& p, const Samples& samples,
                           const VectorXd& used) {
  // In units of the norm: neutrals by K, K by itself, so that the shape of the ellipsoid does not count.
  Samples round;
  Parameters unit;
  double spread = 0;
  for (const auto& s : samples) spread = std::max(spread, std::fabs(s.temperature_degc));
  for (const auto& s : samples)
    round.push_back({p.K * (s.value - p.neutral - p.slope * s.temperature_degc),
                     spread > 0 ? s.temperature_degc / spread : 0.0, s.group});
  const Normal normal = normal_of(model, unit, round, used);
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(normal.matrix / used.sum()).eigenvalues()[0];
}

/// Back to the units of samples and norm.
Ellipsoid unscaled(const EllipsoidModel& model, const Parameters& p, const Scaling& scaling, double norm,
                   const MatrixXd& covariance) {
  Ellipsoid e;
  e.model = model, e.norm = norm;
  const double to_k = norm / scaling.size;
  e.K = p.K * to_k;
  e.neutral = scaling.middle + scaling.size * p.neutral;
  e.neutral_per_degc = scaling.size * p.slope;
  VectorXd unit = VectorXd::Constant(model.parameters(), scaling.size);
  unit.segment(3, model.cross_axis ? 6 : 3).setConstant(to_k);
  e.covariance = unit.asDiagonal() * covariance * unit.asDiagonal();
  const VectorXd sigma = e.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  e.neutral_sigma = sigma.head<3>();
  e.K_sigma.diagonal() = sigma.segment<3>(3);
  int next = 6;
  if (model.cross_axis)
    for (const auto& [i, j] : kCross) e.K_sigma(i, j) = e.K_sigma(j, i) = sigma[next++];
  if (model.temperature) e.neutral_per_degc_sigma = sigma.segment<3>(next);
  return e;
}

}  // namespace

std::optional<Ellipsoid> fit_ellipsoid(const Samples& samples, const EllipsoidModel& model, double norm, double noise) {
  if (static_cast<int>(samples.size()) < model.parameters()) return std::nullopt;
  const Scaling scaling = scaling_of(samples);
  double at_degc = 0;
  for (const auto& s : samples) at_degc += s.temperature_degc / static_cast<double>(samples.size());
  Samples scaled;
  for (const auto& s : samples)
    scaled.push_back({(s.value - scaling.middle) / scaling.size, s.temperature_degc - at_degc, s.group});
  const double least_sigma = std::max(noise / norm, 1e-9);

  Parameters p = robust_start(scaled, model.cross_axis);
  VectorXd used = VectorXd::Ones(static_cast<Eigen::Index>(samples.size()));
  if (static_cast<int>(samples.size()) >= 2 * model.parameters()) {  // with fewer, nobody can tell who is the outlier
    for (int round = 0; round < 15; ++round)
      p = refine(model, p, scaled,
                 tukey_weights(p, scaled, std::max(robust_sigma(model, p, scaled, least_sigma), 1e-6)));
    used = inliers(p, scaled, robust_sigma(model, p, scaled, std::max(least_sigma, 1e-6)));
  }
  if (used.sum() < model.parameters()) return std::nullopt;
  p = refine(model, p, scaled, used);
  if (!p.K.allFinite() || !p.neutral.allFinite() || !(p.K.determinant() > 0)) return std::nullopt;

  Ellipsoid e = unscaled(model, p, scaling, norm, covariance_of(model, p, scaled, used, least_sigma));
  e.at_degc = at_degc;
  e.used_count = static_cast<std::size_t>(used.sum());
  e.residual_rms = norm * std::sqrt(cost_of(p, scaled, used) / used.sum());
  e.least_eigenvalue = least_eigenvalue_of(model, p, scaled, used);
  for (Eigen::Index i = 0; i < used.size(); ++i) e.used.push_back(used[i] > 0);
  return e;
}

}  // namespace wasp::calibration
