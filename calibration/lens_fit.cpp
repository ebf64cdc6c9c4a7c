#include "calibration/lens_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/calib3d.hpp>

namespace wasp::calibration {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;
using Board = std::vector<cv::Point3f>;
using Views = std::vector<Corners>;

constexpr std::size_t kFolds = 5, kLeastViews = 4;

int free_parameters(const LensModel& m) { return m.kind == LensKind::kFisheye || !m.k3 ? 8 : 9; }

/// Projected corners with their derivatives by the lens (2N x p) and by the pose (2N x 6).
struct Projection {
  std::vector<cv::Point2d> points;
  MatrixXd by_lens, by_pose;
};

MatrixXd columns(const cv::Mat& jacobian, int first, int count) {
  MatrixXd out(jacobian.rows, count);
  for (int i = 0; i < jacobian.rows; ++i)
    for (int j = 0; j < count; ++j) out(i, j) = jacobian.at<double>(i, first + j);
  return out;
}

Projection project(const LensFit& fit, const std::vector<cv::Point3d>& object, const cv::Vec3d& r, const cv::Vec3d& t) {
  Projection out;
  cv::Mat jacobian;
  const int n = free_parameters(fit.model);
  if (fit.model.kind == LensKind::kFisheye) {  // columns f2 c2 k4 om3 T3 alpha
    cv::fisheye::projectPoints(object, out.points, r, t, fit.K, fit.distortion, 0, jacobian);
    out.by_lens = columns(jacobian, 0, n);
    out.by_pose = columns(jacobian, 8, 6);
  } else {  // om3 T3 f2 c2 k1 k2 p1 p2 k3
    cv::projectPoints(object, r, t, fit.K, fit.distortion, out.points, jacobian);
    out.by_lens = columns(jacobian, 6, n);
    out.by_pose = columns(jacobian, 0, 6);
  }
  return out;
}

std::vector<cv::Point3d> to_double(const Board& board) { return {board.begin(), board.end()}; }

VectorXd difference(const Corners& seen, const std::vector<cv::Point2d>& projected) {
  VectorXd r(2 * static_cast<Eigen::Index>(seen.size()));
  for (std::size_t i = 0; i < seen.size(); ++i) {
    r[2 * static_cast<Eigen::Index>(i)] = static_cast<double>(seen[i].x) - projected[i].x;
    r[2 * static_cast<Eigen::Index>(i) + 1] = static_cast<double>(seen[i].y) - projected[i].y;
  }
  return r;
}

double distance_rms(const VectorXd& r) { return std::sqrt(2 * r.squaredNorm() / static_cast<double>(r.size())); }

/// OpenCV's calibration; false where it throws or does not converge.
bool pinhole(const std::vector<Board>& boards, const Views& views, cv::Size image, LensFit& fit) {
  fit.distortion.assign(5, 0.0);
  cv::Mat K, D, r, t;
  cv::calibrateCamera(boards, views, image, K, D, r, t, fit.model.k3 ? 0 : cv::CALIB_FIX_K3,
                      {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-12});
  fit.K = cv::Matx33d(K.ptr<double>());
  for (int i = 0; i < 5; ++i) fit.distortion[static_cast<std::size_t>(i)] = D.at<double>(i);
  for (int i = 0; i < r.rows; ++i)
    fit.rotation.push_back(r.at<cv::Vec3d>(i)), fit.translation.push_back(t.at<cv::Vec3d>(i));
  return true;
}

bool fisheye(const Board& board, const Views& views, cv::Size image, double f_px, LensFit& fit) {
  std::vector<std::vector<cv::Point3d>> objects(views.size(), to_double(board));
  std::vector<std::vector<cv::Point2d>> points;
  for (const auto& v : views) points.emplace_back(v.begin(), v.end());
  cv::Matx33d K(f_px, 0, 0.5 * (image.width - 1), 0, f_px, 0.5 * (image.height - 1), 0, 0, 1);
  cv::Vec4d D(0, 0, 0, 0);
  std::vector<cv::Vec3d> r, t;
  cv::fisheye::calibrate(
      objects, points, image, K, D, r, t,
      cv::fisheye::CALIB_USE_INTRINSIC_GUESS | cv::fisheye::CALIB_RECOMPUTE_EXTRINSIC | cv::fisheye::CALIB_FIX_SKEW,
      {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-10});
  fit.K = K, fit.distortion = {D[0], D[1], D[2], D[3]}, fit.rotation = r, fit.translation = t;
  return true;
}

/// Residuals, and the covariance with the poses eliminated (Schur complement).
void complete(const Board& board, const Views& views, LensFit& fit) {
  const int p = free_parameters(fit.model);
  MatrixXd normal = MatrixXd::Zero(p, p), middle = MatrixXd::Zero(p, p);
  double cost = 0;
  const auto object = to_double(board);
  fit.view_rms.clear(), fit.residuals.clear();
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Projection projection = project(fit, object, fit.rotation[v], fit.translation[v]);
    const VectorXd r = difference(views[v], projection.points);
    const MatrixXd& A = projection.by_lens;
    const MatrixXd& B = projection.by_pose;
    const MatrixXd seen = A - B * (B.transpose() * B).ldlt().solve(B.transpose() * A);  // what the pose cannot explain
    normal += seen.transpose() * seen;
    const VectorXd pull = seen.transpose() * r;
    middle += pull * pull.transpose();
    cost += r.squaredNorm();
    fit.view_rms.push_back(distance_rms(r));
    Corners residual;
    for (Eigen::Index i = 0; i < r.size(); i += 2)
      residual.emplace_back(static_cast<float>(r[i]), static_cast<float>(r[i + 1]));
    fit.residuals.push_back(std::move(residual));
  }
  const double points = static_cast<double>(views.size() * board.size());
  const double spare = 2 * points - p - 6 * static_cast<double>(views.size());
  fit.rms = std::sqrt(cost / points);
  const MatrixXd inverse = normal.completeOrthogonalDecomposition().pseudoInverse();
  fit.covariance = inverse * (spare > 0 ? cost / spare : std::numeric_limits<double>::infinity());
  fit.bias = kCornerBias_px * (2 * points * inverse.diagonal()).cwiseMax(0).cwiseSqrt();
  const MatrixXd by_view = inverse * middle * inverse;
  fit.sigma = fit.covariance.diagonal().cwiseMax(by_view.diagonal()).cwiseMax(0).cwiseSqrt();
}

bool sane(const LensFit& fit, cv::Size image) {
  const double most = 50.0 * std::max(image.width, image.height);
  return std::isfinite(fit.rms) && fit.K(0, 0) > 1 && fit.K(1, 1) > 1 && fit.K(0, 0) < most && fit.K(1, 1) < most &&
         std::isfinite(fit.K(0, 2)) && std::isfinite(fit.K(1, 2)) && fit.sigma.allFinite();
}

/// Rays of pixels, normalised by their z.
std::vector<cv::Point2d> rays_of(const LensFit& fit, const std::vector<cv::Point2d>& pixels) {
  std::vector<cv::Point2d> rays;
  if (fit.model.kind == LensKind::kFisheye)
    cv::fisheye::undistortPoints(pixels, rays, fit.K, fit.distortion);
  else
    cv::undistortPoints(pixels, rays, fit.K, fit.distortion);
  return rays;
}

/// The pose of a board seen through a known lens, least squares in pixels; the rms of what remains [px].
double pose_rms(const LensFit& fit, const Board& board, const Corners& seen) {
  const auto rays = rays_of(fit, {seen.begin(), seen.end()});
  cv::Vec3d r, t;
  const auto object = to_double(board);
  if (!cv::solvePnP(object, rays, cv::Matx33d::eye(), cv::noArray(), r, t))
    return std::numeric_limits<double>::infinity();
  double rms = 0;
  for (int i = 0; i < 10; ++i) {
    const Projection p = project(fit, object, r, t);
    const VectorXd error = difference(seen, p.points);
    rms = distance_rms(error);
    const VectorXd step = (p.by_pose.transpose() * p.by_pose).ldlt().solve(p.by_pose.transpose() * error);
    for (int k = 0; k < 3; ++k) r[k] += step[k], t[k] += step[3 + k];
  }
  return rms;
}

}  // namespace

VectorXd LensFit::parameters() const {
  VectorXd p(free_parameters(model));
  p.head<4>() << K(0, 0), K(1, 1), K(0, 2), K(1, 2);
  for (Eigen::Index i = 4; i < p.size(); ++i) p[i] = distortion[static_cast<std::size_t>(i - 4)];
  return p;
}

std::optional<LensFit> fit_lens(const Board& board, const Views& views, cv::Size image, const LensModel& model) {
  std::optional<LensFit> best;
  const double f0 = std::max(image.width, image.height) / std::numbers::pi;
  const std::vector<double> starts =
      model.kind == LensKind::kFisheye ? std::vector{f0, 1.5 * f0, 0.7 * f0, 2.2 * f0} : std::vector{f0};
  for (const double f_px : starts) {
    LensFit fit;
    fit.model = model;
    try {
      if (model.kind == LensKind::kFisheye)
        fisheye(board, views, image, f_px, fit);
      else
        pinhole(std::vector<Board>(views.size(), board), views, image, fit);
      complete(board, views, fit);
    } catch (const cv::Exception&) {
      continue;  // a start from which it diverges
    }
    if (!sane(fit, image) || (best && best->rms <= fit.rms)) continue;
    const bool again = !best || fit.rms < 0.98 * best->rms;
    best = std::move(fit);
    if (!again) break;
  }
  return best;
}

std::optional<double> cross_validate(const Board& board, const Views& views, cv::Size image, LensFit& fit) {
  const std::size_t folds = std::min(kFolds, views.size());
  std::vector<VectorXd> without;
  double sum = 0;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    const std::size_t first = fold * views.size() / folds, end = (fold + 1) * views.size() / folds;
    Views rest(views.begin(), views.begin() + static_cast<std::ptrdiff_t>(first));
    rest.insert(rest.end(), views.begin() + static_cast<std::ptrdiff_t>(end), views.end());
    if (rest.size() < kLeastViews) return std::nullopt;
    const auto trained = fit_lens(board, rest, image, fit.model);
    if (!trained) return std::nullopt;
    without.push_back(trained->parameters());
    for (std::size_t v = first; v < end; ++v) sum += std::pow(pose_rms(*trained, board, views[v]), 2);
  }
  VectorXd mean = VectorXd::Zero(without[0].size()), spread = mean;
  for (const auto& p : without) mean += p / static_cast<double>(folds);
  for (const auto& p : without) spread += (p - mean).cwiseAbs2();
  spread *= static_cast<double>(folds - 1) / static_cast<double>(folds);
  fit.sigma = fit.sigma.cwiseMax(spread.cwiseSqrt());
  return std::sqrt(sum / static_cast<double>(views.size()));
}

double projection_sigma(const LensFit& fit, cv::Point2d at) {
  const cv::Point2d ray = rays_of(fit, {at})[0];
  if (!std::isfinite(ray.x) || !std::isfinite(ray.y) || std::hypot(ray.x, ray.y) > 1e3)
    return std::numeric_limits<double>::quiet_NaN();
  const Projection p = project(fit, {{ray.x, ray.y, 1.0}}, {0, 0, 0}, {0, 0, 0});
  if (std::hypot(p.points[0].x - at.x, p.points[0].y - at.y) > 0.5) return std::numeric_limits<double>::quiet_NaN();
  // Correlations as scatter has them, sizes as `sigma` has them.
  const VectorXd stretch = fit.sigma.cwiseQuotient(fit.covariance.diagonal().cwiseSqrt().cwiseMax(1e-300));
  const MatrixXd J = p.by_lens * stretch.asDiagonal();
  return std::sqrt(0.5 * (J * fit.covariance * J.transpose()).trace());
}

double widest_tilt(const LensFit& fit) {
  std::vector<cv::Vec3d> normals;
  for (const auto& r : fit.rotation) {
    cv::Matx33d R;
    cv::Rodrigues(r, R);
    normals.emplace_back(R(0, 2), R(1, 2), R(2, 2));
  }
  double widest = 0;
  for (std::size_t i = 0; i < normals.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      widest = std::max(widest, std::acos(std::clamp(std::fabs(normals[i].dot(normals[j])), 0.0, 1.0)));
  return widest;
}

}  // namespace wasp::calibration
