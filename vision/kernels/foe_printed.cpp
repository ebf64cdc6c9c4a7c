// (5.11, 5.12): sums of u^2 by column and of v^2 by row; the focus is where each is least.
#include <array>
#include <cmath>
#include <limits>

#include "vision/kernels/flow_points.h"
#include "vision/kernels/foe.h"

namespace wasp::vision {
namespace {

/// Sums of one axis over a line of cells.
struct LineMean {
  float sum = 0, position = 0;
  int count = 0;
};

/// Position of the line with the least mean square; lines without cells do not count.
template <class Lines>
float least_line(const Lines& lines, int n) noexcept {
  float best = std::numeric_limits<float>::infinity(), position = 0;
  for (int i = 0; i < n; ++i) {
    const LineMean& line = lines[static_cast<std::size_t>(i)];
    if (line.count == 0) continue;
    const float cells = static_cast<float>(line.count);
    if (line.sum / cells < best) best = line.sum / cells, position = line.position / cells;
  }
  return position;
}

}  // namespace

Foe printed_foe(const FoeParams& params, const FlowField& flow) noexcept {
  Foe foe;
  FlowPoints shape;
  collect_points(flow, 0.f, 0.f, shape);
  foe.cells = shape.count;
  if (foe.cells < params.min_cells || foe.cells == 0) return foe;
  std::array<LineMean, FlowField::kMaxColumns> columns{};
  std::array<LineMean, FlowField::kMaxRows> rows{};
  const auto add = [](LineMean& line, float square, float position) {
    line.sum += square, line.position += position, ++line.count;
  };
  for (int r = 0; r < flow.rows; ++r)
    for (int c = 0; c < flow.columns; ++c) {
      const FlowCell& cell = flow.at(c, r);
      if (cell.valid == 0 || !std::isfinite(cell.u_px + cell.v_px + cell.x_px + cell.y_px)) continue;
      add(columns[static_cast<std::size_t>(c)], cell.u_px * cell.u_px, cell.x_px);
      add(rows[static_cast<std::size_t>(r)], cell.v_px * cell.v_px, cell.y_px);
    }
  foe.x_px = least_line(columns, flow.columns), foe.y_px = least_line(rows, flow.rows);
  foe.valid = true;
  return foe;
}

}  // namespace wasp::vision
