// Positions are taken relative to the middle of the cells; e leaves in image pixels again.
#include "vision/kernels/foe.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

#include "vision/kernels/flow_points.h"
#include "vision/kernels/pseudo_random.h"

namespace wasp::vision {
namespace {

using Vec5 = Eigen::Matrix<double, 5, 1>;
using Mat5 = Eigen::Matrix<double, 5, 5>;

constexpr float kMinDistance_px = 2.f;  // closer cells have no direction from e
constexpr float kSolvedInlier_px = 0.75f;
constexpr float kFarthest = 4.f;  // e beyond this many half extents of the grid is no focus

/// Flow of a point at infinity per unit of camera turn (small angles; x right, y down, z forward, normalised by f).
struct TurnFlow {
  Vec3 u, v;
};

/// What all candidates share: the cells, what a turn does to them, the sign of expansion.
struct Scene {
  FlowPoints points;
  std::array<TurnFlow, kMaxFlowPoints> turn;  ///< used with rotation only
  float centre_x = 0, centre_y = 0, half_extent = 1;
  bool with_rotation = false;
};

struct Candidate {
  float x = 0, y = 0, sign = 1;
  Vec3 rotation = Vec3::Zero();
};

/// Flow of a cell along and across its direction from e.
struct Split {
  float along = 0, across = 0, distance = 1;
  float nx = 0, ny = 0;  ///< unit vector across
};

Split split(const Scene& scene, std::size_t i, const Candidate& e) noexcept {
  const FlowPoint& p = scene.points.points[i];
  float u = p.u, v = p.v;
  if (scene.with_rotation) u -= scene.turn[i].u.dot(e.rotation), v -= scene.turn[i].v.dot(e.rotation);
  const float dx = p.x - e.x, dy = p.y - e.y, distance = std::hypot(dx, dy);
  if (distance < kMinDistance_px) return {0.f, 0.f, kMinDistance_px, 0.f, 0.f};
  const float cx = dx / distance, cy = dy / distance;
  return {u * cx + v * cy, -u * cy + v * cx, distance, -cy, cx};
}

/// Flow towards e in an expanding scene counts against it as well.
float misfit_squared(const Split& s, float sign) noexcept {
  const float wrong_way = std::min(sign * s.along, 0.f);
  return s.across * s.across + wrong_way * wrong_way;
}

/// Sum of misfits, each at most 1 in units of `limit`. Linear, so that slow flow, all of it below the limit, still
/// tells candidates apart by its majority.
float cost_of(const Scene& scene, const Candidate& e, float limit) noexcept {
  float cost = 0;
  for (int i = 0; i < scene.points.count; ++i)
    cost += std::min(std::sqrt(misfit_squared(split(scene, static_cast<std::size_t>(i), e), e.sign)) / limit, 1.f);
  return cost;
}

bool crossing(const FlowPoint& p, const FlowPoint& q, float farthest, Candidate& out) noexcept {
  const float det = p.u * q.v - p.v * q.u;
  if (!(std::abs(det) > 1e-6f)) return false;
  const float t = ((q.x - p.x) * q.v - (q.y - p.y) * q.u) / det;
  out.x = p.x + t * p.u, out.y = p.y + t * p.v;
  out.sign = t < 0.f ? 1.f : -1.f;
  return std::abs(out.x) < farthest && std::abs(out.y) < farthest;
}

Candidate pair_consensus(const Scene& scene, float limit, float& best_cost) noexcept {
  PseudoRandom random{1};
  Candidate best, trial;
  best_cost = std::numeric_limits<float>::infinity();
  for (int k = 0; k < kFoeTrials; ++k) {
    const auto i = static_cast<std::size_t>(random.below(scene.points.count));
    const auto j = static_cast<std::size_t>(random.below(scene.points.count));
    if (!crossing(scene.points.points[i], scene.points.points[j], kFarthest * scene.half_extent, trial)) continue;
    if (const float cost = cost_of(scene, trial, limit); cost < best_cost) best = trial, best_cost = cost;
  }
  return best;
}

/// Least-squares turn for a given e: the flow across must come from it. Two rounds, the second one reweighted.
Vec3 turn_for(const Scene& scene, const Candidate& e, float limit) noexcept {
  Vec3 turn = Vec3::Zero();
  for (int round = 0; round < 3; ++round) {
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    Candidate zero = e;
    zero.rotation = Vec3::Zero();
    for (int k = 0; k < scene.points.count; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const Split s = split(scene, i, zero);
      const Vec3 row = s.nx * scene.turn[i].u + s.ny * scene.turn[i].v;
      const float left = s.across - row.dot(turn);
      const float weight = round == 0 ? 1.f : 1.f / (1.f + left * left / (limit * limit));
      const Eigen::Vector3d r = row.cast<double>();
      a += static_cast<double>(weight) * r * r.transpose();
      b += static_cast<double>(weight * s.across) * r;
    }
    a.diagonal().array() += 1e-6 * a.trace() + 1e-12;
    turn = a.ldlt().solve(b).cast<float>();
  }
  return turn;
}

Candidate grid_consensus(const Scene& scene, float limit, float& best_cost) noexcept {
  constexpr int kHalf = 5;
  Candidate best;
  best_cost = std::numeric_limits<float>::infinity();
  for (int row = -kHalf; row <= kHalf; ++row)
    for (int column = -kHalf; column <= kHalf; ++column) {
      const float step = 1.2f * scene.half_extent / kHalf;
      Candidate e{static_cast<float>(column) * step, static_cast<float>(row) * step, 1.f, Vec3::Zero()};
      e.rotation = turn_for(scene, e, limit);
      for (const float sign : {1.f, -1.f}) {
        e.sign = sign;
        if (const float cost = cost_of(scene, e, limit); cost < best_cost) best = e, best_cost = cost;
      }
    }
  return best;
}

struct Normal {
  Mat5 a = Mat5::Zero();
  Vec5 b = Vec5::Zero();
  double weight = 0, squares = 0;
};

/// Normal equations of Gauss-Newton about `e`: d across / d e = along / distance n, d across / d turn = -n . turn flow.
Normal normal_equations(const Scene& scene, const Candidate& e, float limit) noexcept {
  Normal sums;
  for (int k = 0; k < scene.points.count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Split s = split(scene, i, e);
    const auto w = static_cast<double>(biweight(misfit_squared(s, e.sign), limit));
    if (!(w > 0)) continue;
    Vec5 row = Vec5::Zero();
    row[0] = static_cast<double>(s.along / s.distance * s.nx),
    row[1] = static_cast<double>(s.along / s.distance * s.ny);
    if (scene.with_rotation) row.tail<3>() = -(s.nx * scene.turn[i].u + s.ny * scene.turn[i].v).cast<double>();
    sums.a += w * row * row.transpose();
    sums.b += w * static_cast<double>(s.across) * row;
    sums.weight += w;
    sums.squares += w * static_cast<double>(s.across) * static_cast<double>(s.across);
  }
  return sums;
}

bool step(const Scene& scene, const Normal& sums, Candidate& e) noexcept {
  Vec5 change = Vec5::Zero();
  if (scene.with_rotation) {
    Mat5 a = sums.a;
    a.diagonal() *= 1.0 + 1e-6;
    change = -a.ldlt().solve(sums.b);
  } else {
    const Eigen::Matrix2d a = sums.a.topLeftCorner<2, 2>();
    const double det = a.determinant();
    if (!(det > 1e-18)) return false;
    change.head<2>() = -(a.inverse() * sums.b.head<2>());
  }
  const double longest = 0.5 * static_cast<double>(scene.half_extent), length = change.head<2>().norm();
  if (!change.allFinite()) return false;
  if (length > longest) change *= longest / length;
  e.x += static_cast<float>(change[0]), e.y += static_cast<float>(change[1]);
  e.rotation += change.tail<3>().cast<float>();
  return true;
}

float robust_sigma(const Scene& scene, const Candidate& e) noexcept {
  std::array<float, kMaxFlowPoints> size;
  for (int i = 0; i < scene.points.count; ++i)
    size[static_cast<std::size_t>(i)] = std::sqrt(misfit_squared(split(scene, static_cast<std::size_t>(i), e), e.sign));
  return 1.4826f * median_in_place({size.data(), static_cast<std::size_t>(scene.points.count)});
}

/// Larger semi-axis of e's ellipse for residuals of 1 px.
double ellipse(const Scene& scene, const Normal& sums) noexcept {
  Eigen::Matrix2d a = sums.a.topLeftCorner<2, 2>();
  if (scene.with_rotation) {  // information on e with the turn unknown: the Schur complement
    const Eigen::Matrix3d turn = sums.a.bottomRightCorner<3, 3>() + 1e-9 * Eigen::Matrix3d::Identity();
    const Eigen::LDLT<Eigen::Matrix3d> factors(turn);
    for (int column = 0; column < 2; ++column) {  // one at a time: a matrix on the right would go through the heap
      const Eigen::Vector3d right = sums.a.block<3, 1>(2, column);
      a.col(column) -= sums.a.topRightCorner<2, 3>() * factors.solve(right);
    }
  }
  const double half = 0.5 * a.trace();
  const double least = half - std::sqrt(std::max(half * half - a.determinant(), 0.0));
  return least > 0 ? 1.0 / std::sqrt(least) : std::numeric_limits<double>::infinity();
}

bool sane(const FoeParams& p) noexcept { return p.flow_sigma_px > 0.f && p.inlier_px > 0.f && p.max_sigma_px > 0.f; }

Foe refine(const FoeParams& params, const Scene& scene, Candidate e) noexcept {
  Foe foe;
  foe.cells = scene.points.count;
  float limit = params.inlier_px;
  Normal sums;
  for (int round = 0; round < kFoeRounds; ++round) {
    sums = normal_equations(scene, e, limit);
    if (!step(scene, sums, e)) return foe;
    limit = std::min(kBiweightSigmas * std::max(robust_sigma(scene, e), params.flow_sigma_px), params.inlier_px);
  }
  double squares = 0;
  for (int k = 0; k < scene.points.count; ++k) {
    const float m = misfit_squared(split(scene, static_cast<std::size_t>(k), e), e.sign);
    if (m >= limit * limit) continue;
    ++foe.inliers;
    squares += static_cast<double>(m);
  }
  const int freedom = foe.inliers - (scene.with_rotation ? 5 : 2);
  if (freedom <= 0) return foe;
  foe.residual_px = static_cast<float>(std::sqrt(squares / freedom));
  foe.sigma_px = static_cast<float>(ellipse(scene, sums)) * std::max(foe.residual_px, params.flow_sigma_px);
  foe.x_px = e.x + scene.centre_x, foe.y_px = e.y + scene.centre_y;
  foe.expanding = e.sign > 0.f;
  foe.rotation_rad = e.rotation;
  foe.valid = std::isfinite(foe.x_px) && std::isfinite(foe.y_px) && foe.sigma_px <= params.max_sigma_px &&
              std::abs(e.x) <= kFarthest * scene.half_extent && std::abs(e.y) <= kFarthest * scene.half_extent &&
              foe.inliers >= params.min_cells &&
              static_cast<float>(foe.inliers) >= params.min_inlier_share * static_cast<float>(foe.cells);
  return foe;
}

void prepare(const FlowField& flow, Scene& scene) noexcept {
  collect_points(flow, 0.f, 0.f, scene.points);
  float left = std::numeric_limits<float>::infinity(), right = -left, top = left, bottom = -left;
  for (const FlowPoint& p : scene.points.view()) {
    left = std::min(left, p.x), right = std::max(right, p.x);
    top = std::min(top, p.y), bottom = std::max(bottom, p.y);
  }
  if (scene.points.count == 0) return;
  scene.centre_x = 0.5f * (left + right), scene.centre_y = 0.5f * (top + bottom);
  scene.half_extent = std::max({0.5f * (right - left), 0.5f * (bottom - top), 1.f});
  for (int i = 0; i < scene.points.count; ++i) {
    scene.points.points[static_cast<std::size_t>(i)].x -= scene.centre_x;
    scene.points.points[static_cast<std::size_t>(i)].y -= scene.centre_y;
  }
}

/// Flow per radian of camera turn: (u, v) = f/Z (Z-free part), u = f (x y wx - (1 + x^2) wy + y wz) and so on.
void add_turn_flow(const Intrinsics& k, Scene& scene) noexcept {
  for (int i = 0; i < scene.points.count; ++i) {
    const FlowPoint& p = scene.points.points[static_cast<std::size_t>(i)];
    const float x = (p.x + scene.centre_x - k.cx_px) / k.fx_px, y = (p.y + scene.centre_y - k.cy_px) / k.fy_px;
    scene.turn[static_cast<std::size_t>(i)] = {k.fx_px * Vec3(x * y, -(1.f + x * x), y),
                                               k.fy_px * Vec3(1.f + y * y, -x * y, -x)};
  }
  scene.with_rotation = true;
}

}  // namespace

Foe find_foe(const FoeParams& params, const FlowField& flow) noexcept {
  Scene scene;
  prepare(flow, scene);
  float cost = 0;
  if (!sane(params) || scene.points.count < std::max(params.min_cells, 4)) return Foe{.cells = scene.points.count};
  const Candidate start = pair_consensus(scene, params.inlier_px, cost);
  return std::isfinite(cost) ? refine(params, scene, start) : Foe{.cells = scene.points.count};
}

Foe find_foe_and_rotation(const FoeParams& params, const FlowField& flow, const Intrinsics& intrinsics) noexcept {
  Scene scene;
  prepare(flow, scene);
  float cost = 0;
  if (!sane(params) || scene.points.count < std::max(params.min_cells, 8) || !(intrinsics.fx_px > 0.f) ||
      !(intrinsics.fy_px > 0.f))
    return Foe{.cells = scene.points.count};
  add_turn_flow(intrinsics, scene);
  FoeParams tight = params;  // no remainder of a gyro to leave room for
  tight.inlier_px = std::min(params.inlier_px, kSolvedInlier_px);
  return refine(tight, scene, grid_consensus(scene, tight.inlier_px, cost));
}

}  // namespace wasp::vision
