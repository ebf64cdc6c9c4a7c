// The usable cells of a flow field as plain arrays, for fits that go over them many times.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "types/realtime.h"
#include "vision/kernels/flow_field.h"

namespace wasp::vision {

inline constexpr int kMaxFlowPoints = FlowField::kMaxColumns * FlowField::kMaxRows;

struct FlowPoint {
  float x = 0, y = 0, u = 0, v = 0;
};

struct FlowPoints {
  std::array<FlowPoint, kMaxFlowPoints> points{};
  int count = 0;

  [[nodiscard]] std::span<const FlowPoint> view() const WASP_REALTIME {
    return {points.data(), static_cast<std::size_t>(count)};
  }
};

/// Valid, finite cells, positions relative to (centre_x, centre_y); none for a field of impossible shape.
/// Realtime-safe: yes.
inline void collect_points(const FlowField& flow, float centre_x_px, float centre_y_px, FlowPoints& out) WASP_REALTIME {
  out.count = 0;
  if (flow.columns < 1 || flow.rows < 1 || flow.columns > FlowField::kMaxColumns || flow.rows > FlowField::kMaxRows)
    return;
  for (int i = 0; i < flow.count(); ++i) {
    const FlowCell& cell = flow.cells[static_cast<std::size_t>(i)];
    const float sum = cell.x_px + cell.y_px + cell.u_px + cell.v_px;
    if (cell.valid == 0 || !std::isfinite(sum)) continue;
    out.points[static_cast<std::size_t>(out.count++)] = {cell.x_px - centre_x_px, cell.y_px - centre_y_px, cell.u_px,
                                                         cell.v_px};
  }
}

/// Upper median of `values`, which are reordered; 0 when empty. Realtime-safe: yes.
inline float median_in_place(std::span<float> values) WASP_REALTIME {
  if (values.empty()) return 0.f;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Tukey's biweight: 1 at 0, 0 from `limit` on. Realtime-safe: yes.
inline float biweight(float residual_squared, float limit) WASP_REALTIME {
  const float t = 1.f - residual_squared / (limit * limit);
  return t > 0.f ? t * t : 0.f;
}
inline constexpr float kBiweightSigmas = 4.685f;  ///< 95 % efficiency on normal noise

}  // namespace wasp::vision
