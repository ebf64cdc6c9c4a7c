// Everything is in units of each cell's expected error: noise of the flow, and flow times relative error of the depth.
#include "vision/kernels/flow_motion.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "vision/kernels/camera_model.h"
#include "vision/kernels/derotate.h"
#include "vision/kernels/flow_points.h"
#include "vision/kernels/pseudo_random.h"

namespace wasp::vision {
namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

constexpr float kMinForward = 0.2f;  // rays farther from the axis (78 degrees) have no useful depth along it

/// One cell: u = row_u . (t, w), v = row_v . (t, w), over the expected error.
struct Equations {
  Ray first, second;
  float inverse_depth = 0, inverse_sigma = 0;

  [[nodiscard]] Vec3 row_u() const noexcept { return Vec3(-1.f, 0.f, second.x) * (inverse_depth * inverse_sigma); }
  [[nodiscard]] Vec3 row_v() const noexcept { return Vec3(0.f, -1.f, second.y) * (inverse_depth * inverse_sigma); }
  [[nodiscard]] float u() const noexcept { return (second.x - first.x) * inverse_sigma; }
  [[nodiscard]] float v() const noexcept { return (second.y - first.y) * inverse_sigma; }
};

struct Cells {
  std::array<Equations, kMaxFlowPoints> all;
  int count = 0;
};

bool ray_of(const Lens& lens, Pixel pixel, Ray& ray) noexcept {
  Vec3 d;
  if (!direction_of(lens, pixel, d) || !(d.z() > kMinForward)) return false;
  ray = {d.x() / d.z(), d.y() / d.z()};
  return true;
}

void collect(const FlowMotionParams& p, const Lens& lens, const FlowField& still, const CellDepths& depth_m,
             Cells& cells) noexcept {
  const float focal = std::sqrt(lens.intrinsics.fx_px * lens.intrinsics.fy_px);
  for (std::size_t i = 0; i < static_cast<std::size_t>(still.count()); ++i) {
    const FlowCell& cell = still.cells[i];
    const float depth = depth_m[i];
    Equations e;
    if (cell.valid == 0 || !(depth >= p.min_depth_m && depth <= p.max_depth_m) ||
        !ray_of(lens, {cell.x_px, cell.y_px}, e.first) ||
        !ray_of(lens, {cell.x_px + cell.u_px, cell.y_px + cell.v_px}, e.second))
      continue;
    const float du = e.second.x - e.first.x, dv = e.second.y - e.first.y;
    const float of_depth = std::sqrt(du * du + dv * dv) * (p.depth_sigma + p.depth_sigma_1pm * depth);
    const float of_flow = p.flow_sigma_px / focal;
    e.inverse_depth = 1.f / depth;
    e.inverse_sigma = 1.f / std::sqrt(of_flow * of_flow + of_depth * of_depth);
    cells.all[static_cast<std::size_t>(cells.count++)] = e;
  }
}

struct Motion {
  Vec3 t = Vec3::Zero(), w = Vec3::Zero();
};

/// Flow of a camera turn w: a still direction turns by -w in the camera's axes, as rotational_flow() has it.
struct TurnRows {
  Vec3 u, v;
};
TurnRows turn_rows(const Equations& e) noexcept {
  const Ray r = e.first;
  return {Vec3(r.x * r.y, -(1.f + r.x * r.x), r.y) * e.inverse_sigma,
          Vec3(1.f + r.y * r.y, -r.x * r.y, -r.x) * e.inverse_sigma};
}

float misfit_squared(const Equations& e, const Motion& m) noexcept {
  const TurnRows turn = turn_rows(e);
  const float ru = e.u() - e.row_u().dot(m.t) - turn.u.dot(m.w), rv = e.v() - e.row_v().dot(m.t) - turn.v.dot(m.w);
  return ru * ru + rv * rv;
}

bool motion_of_pair(const Equations& a, const Equations& b, Vec3& t) noexcept {
  Mat3 normal = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  for (const Equations* e : {&a, &b}) {
    const Vec3 u = e->row_u(), v = e->row_v();
    normal += u * u.transpose() + v * v.transpose();
    right += u * e->u() + v * e->v();
  }
  const float scale = normal.trace();
  if (!(normal.determinant() > 1e-7f * scale * scale * scale)) return false;
  t = normal.ldlt().solve(right);
  return t.allFinite();
}

Motion consensus(const Cells& cells, float limit) noexcept {
  PseudoRandom random{1};
  Motion best, trial;
  float best_cost = std::numeric_limits<float>::infinity();
  for (int k = 0; k <= kMotionTrials; ++k) {
    const auto i = static_cast<std::size_t>(random.below(cells.count));
    const auto j = static_cast<std::size_t>(random.below(cells.count));
    if (k > 0 && (i == j || !motion_of_pair(cells.all[i], cells.all[j], trial.t))) continue;  // k = 0: no motion
    float cost = 0;
    for (std::size_t c = 0; c < static_cast<std::size_t>(cells.count); ++c)
      cost += std::min(misfit_squared(cells.all[c], trial), limit * limit);
    if (cost < best_cost) best = trial, best_cost = cost;
  }
  return best;
}

struct Normal {
  Mat6 a = Mat6::Zero();
  Vec6 b = Vec6::Zero();
};

Normal normal_equations(const FlowMotionParams& p, const Cells& cells, const Motion& from, float limit,
                        float scale) noexcept {
  Normal n;
  for (std::size_t i = 0; i < static_cast<std::size_t>(cells.count); ++i) {
    const Equations& e = cells.all[i];
    const auto weight = static_cast<double>(biweight(misfit_squared(e, from), limit));
    if (!(weight > 0)) continue;
    const TurnRows turn = turn_rows(e);
    Vec6 u, v;
    u << e.row_u().cast<double>(), turn.u.cast<double>();
    v << e.row_v().cast<double>(), turn.v.cast<double>();
    n.a += weight * (u * u.transpose() + v * v.transpose());
    n.b += weight * (u * static_cast<double>(e.u()) + v * static_cast<double>(e.v()));
  }
  // The prior is in rad; the equations in units of the expected error, of which the real one is `scale`.
  const auto sigma = static_cast<double>(std::max(p.turn_sigma_rad, 1e-7f));
  n.a.diagonal().tail<3>().array() += static_cast<double>(scale * scale) / (sigma * sigma);
  return n;
}

/// Robust error of one axis, in units of the expected one: the median of a Rayleigh variable is 1.1774 sigma.
float scale_of(const Cells& cells, const Motion& m) noexcept {
  std::array<float, kMaxFlowPoints> size;
  const auto count = static_cast<std::size_t>(cells.count);
  for (std::size_t i = 0; i < count; ++i) size[i] = std::sqrt(misfit_squared(cells.all[i], m));
  return std::max(median_in_place({size.data(), count}) / 1.1774f, 1.f);
}

void report(const FlowMotionParams& p, const Cells& cells, const Motion& m, const Normal& n, float limit,
            FlowMotion& out) noexcept {
  double squares = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(cells.count); ++i) {
    const float r2 = misfit_squared(cells.all[i], m);
    if (r2 >= limit * limit) continue;
    ++out.inliers;
    squares += static_cast<double>(r2);
  }
  const int freedom = 2 * out.inliers - 3;
  if (freedom <= 0) return;
  out.residual = static_cast<float>(std::sqrt(squares / freedom));
  out.moved_m = m.t, out.turn_left_rad = m.w;
  const double error = std::max(static_cast<double>(out.residual), 1.0);
  const Eigen::LDLT<Mat6> factors(n.a);
  for (int axis = 0; axis < 3; ++axis) {  // one at a time: a matrix on the right would go through the heap
    const Vec6 unit = Vec6::Unit(axis);
    const Vec6 column = factors.solve(unit);
    out.covariance_m2.col(axis) = (error * error * column.head<3>()).cast<float>();
  }
  const Mat3& c = out.covariance_m2;
  const bool positive = c(0, 0) > 0.f && c(1, 1) > 0.f && c(2, 2) > 0.f;
  out.valid = out.moved_m.allFinite() && out.covariance_m2.allFinite() && positive &&
              out.inliers >= std::max(p.min_inliers, 4) &&
              static_cast<float>(out.inliers) >= p.min_inlier_share * static_cast<float>(out.cells);
}

}  // namespace

FlowMotion flow_motion(const FlowMotionParams& params, const Lens& lens, const FlowField& still,
                       const CellDepths& depth_m) noexcept {
  FlowMotion out;
  Cells cells;
  if (still.columns < 1 || still.rows < 1 || still.columns > FlowField::kMaxColumns ||
      still.rows > FlowField::kMaxRows || !usable(lens.intrinsics) || !(params.flow_sigma_px > 0.f) ||
      !(params.inlier_sigmas > 0.f) || !(params.min_depth_m > 0.f))
    return out;
  collect(params, lens, still, depth_m, cells);
  out.cells = cells.count;
  if (cells.count < std::max(params.min_inliers, 4)) return out;
  float limit = params.inlier_sigmas, scale = 1.f;
  Motion m = consensus(cells, limit);
  Normal n;
  for (int round = 0; round < kMotionRounds; ++round) {
    n = normal_equations(params, cells, m, limit, scale);
    const Vec6 solved = n.a.ldlt().solve(n.b);
    if (!solved.allFinite()) return out;
    m = {solved.head<3>().cast<float>(), solved.tail<3>().cast<float>()};
    scale = scale_of(cells, m);
    limit = std::min(kBiweightSigmas * scale, params.inlier_sigmas);
  }
  report(params, cells, m, n, limit, out);
  return out;
}

}  // namespace wasp::vision
