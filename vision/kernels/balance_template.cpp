// The wedge of a cell: left or right where |dy| <= tan(half angle) |dx|, top or bottom where |dx| <= tan |dy|.
#include "vision/kernels/balance_template.h"

#include <algorithm>
#include <cmath>

namespace wasp::vision {
namespace {

enum Wedge : std::uint8_t { kLeft, kRight, kTop, kBottom, kNone };

struct Ray {
  float dx, dy, length;
};

Wedge wedge_of(const Ray& r, const BalanceParams& params, float tangent) noexcept {
  if (r.length < std::max(params.min_radius_px, 1e-3f)) return kNone;
  if (std::abs(r.dy) <= tangent * std::abs(r.dx)) return r.dx < 0.f ? kLeft : kRight;
  if (std::abs(r.dx) <= tangent * std::abs(r.dy)) return r.dy < 0.f ? kTop : kBottom;
  return kNone;
}

/// What the cell adds to its wedge's sum: x in the left and right wedge, y in the others.
float share_of(const FlowCell& cell, const Ray& r, BalanceForm form, bool sideways) noexcept {
  if (form == BalanceForm::kPrinted) return sideways ? cell.u_px : cell.v_px;
  const float radial = (cell.u_px * r.dx + cell.v_px * r.dy) / (r.length * r.length);
  return radial * (sideways ? r.dx : r.dy);
}

/// Minus the balance of two opposite wedges.
float opposing(const BalanceParams& params, float sum_a, int cells_a, float sum_b, int cells_b) noexcept {
  if (params.form == BalanceForm::kPrinted) return -(sum_a + sum_b);
  return -(sum_a / static_cast<float>(cells_a) + sum_b / static_cast<float>(cells_b));
}

bool sane(const BalanceParams& p, const FlowField& flow) noexcept {
  return p.wedge_half_angle_rad > 0.f && p.wedge_half_angle_rad < 0.79f && p.min_radius_px >= 0.f && p.min_cells >= 1 &&
         flow.columns >= 1 && flow.rows >= 1 && flow.columns <= FlowField::kMaxColumns &&
         flow.rows <= FlowField::kMaxRows;
}

/// Where the obstacle counts as being, from the focus.
ImageForce offset_of(const FineParams& params, ImageForce offset, const ImageForce& gross) noexcept {
  const float length = std::hypot(offset.x, offset.y);
  if (length >= params.min_offset_px) return offset;
  if (length >= 1e-3f) return {offset.x * params.min_offset_px / length, offset.y * params.min_offset_px / length};
  const float gross_length = std::hypot(gross.x, gross.y);
  if (gross_length > 0.f && std::isfinite(gross_length))
    return {-gross.x * params.min_offset_px / gross_length, -gross.y * params.min_offset_px / gross_length};
  return {-params.min_offset_px, 0.f};
}

}  // namespace

GrossForce gross_force(const BalanceParams& params, const FlowField& flow, float foe_x_px, float foe_y_px) noexcept {
  GrossForce out;
  if (!sane(params, flow) || !std::isfinite(foe_x_px + foe_y_px)) return out;
  const float tangent = std::tan(params.wedge_half_angle_rad);
  std::array<float, 4> sum{};
  for (int i = 0; i < flow.count(); ++i) {
    const FlowCell& cell = flow.cells[static_cast<std::size_t>(i)];
    if (cell.valid == 0 || !std::isfinite(cell.x_px + cell.y_px + cell.u_px + cell.v_px)) continue;
    const float dx = cell.x_px - foe_x_px, dy = cell.y_px - foe_y_px;
    const Ray ray{dx, dy, std::hypot(dx, dy)};
    const Wedge wedge = wedge_of(ray, params, tangent);
    if (wedge == kNone) continue;
    sum[wedge] += share_of(cell, ray, params.form, wedge == kLeft || wedge == kRight);
    ++out.cells[wedge];
  }
  const auto& n = out.cells;
  out.valid_x = std::min(n[kLeft], n[kRight]) >= params.min_cells;
  out.valid_y = std::min(n[kTop], n[kBottom]) >= params.min_cells;
  if (out.valid_x) out.force.x = opposing(params, sum[kLeft], n[kLeft], sum[kRight], n[kRight]);
  if (out.valid_y) out.force.y = opposing(params, sum[kTop], n[kTop], sum[kBottom], n[kBottom]);
  return out;
}

ImageForce ForceAverage::add(const ImageForce& force) noexcept {
  last[static_cast<std::size_t>(next)] = {std::isfinite(force.x) ? force.x : 0.f,
                                          std::isfinite(force.y) ? force.y : 0.f};
  next = (next + 1) % kLength;
  count = std::min(count + 1, kLength);
  ImageForce sum;
  for (int i = 0; i < count; ++i) {
    sum.x += last[static_cast<std::size_t>(i)].x;
    sum.y += last[static_cast<std::size_t>(i)].y;
  }
  return {sum.x / static_cast<float>(count), sum.y / static_cast<float>(count)};
}

Obstacles obstacles_of(const Clusters& clusters, std::span<const float> x_px, std::span<const float> y_px) noexcept {
  Obstacles out;
  std::size_t cells = 0;
  for (int c = 0; c < clusters.count; ++c)
    cells += static_cast<std::size_t>(clusters.cluster[static_cast<std::size_t>(c)].size);
  if (!clusters.valid || x_px.size() != cells || y_px.size() != cells) return out;
  std::array<Obstacle, kMaxClusters> all{};
  for (std::size_t i = 0; i < cells; ++i) {
    Obstacle& o = all[clusters.label[i]];
    o.x_px += x_px[i];
    o.y_px += y_px[i];
    ++o.cells;
  }
  for (std::size_t c = 0; c < all.size(); ++c) {
    if (all[c].cells == 0) continue;
    const auto n = static_cast<float>(all[c].cells);
    const float depth_m = 0.5f * (clusters.cluster[c].x + clusters.cluster[c].y);
    out.obstacle[static_cast<std::size_t>(out.count++)] = {all[c].x_px / n, all[c].y_px / n, all[c].cells, depth_m};
  }
  return out;
}

ImageForce fine_force(const FineParams& params, const Obstacles& obstacles, float foe_x_px, float foe_y_px,
                      const ImageForce& gross) noexcept {
  ImageForce force;
  for (int i = 0; i < std::min(obstacles.count, kMaxClusters); ++i) {
    const Obstacle& o = obstacles.obstacle[static_cast<std::size_t>(i)];
    const ImageForce offset{o.x_px - foe_x_px, o.y_px - foe_y_px};
    const bool counts = std::hypot(offset.x, offset.y) <= params.max_distance_px && o.cells >= params.min_cells &&
                        o.depth_m > 0.f && o.depth_m < params.max_depth_m;  // false for NaN
    if (!counts) continue;
    const float gain =
        static_cast<float>(o.cells) * params.size_gain * (params.max_depth_m - o.depth_m) * params.depth_gain;
    const ImageForce where = offset_of(params, offset, gross);
    force.x -= gain * where.x;
    force.y -= gain * where.y;
  }
  return force;
}

}  // namespace wasp::vision
