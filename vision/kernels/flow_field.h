// Optical flow on a grid: one output type for every engine.
#pragma once

#include <array>
#include <cstdint>

#include "types/realtime.h"

namespace wasp::vision {

/// One cell: image motion of its centre from the first frame to the second.
struct FlowCell {
  float x_px = 0, y_px = 0;  ///< cell centre in the first image
  float u_px = 0, v_px = 0;  ///< motion, right and down [px/frame]
  float quality = 0;         ///< 0 ... 1
  float residual = 0;        ///< mean absolute intensity difference after alignment [grey levels]
  std::uint8_t valid = 0;    ///< 0: too little texture, no convergence, or inconsistent
};

/// Up to 12 x 9 cells over 640 x 480 (section 5.2), row-major, rows from the top. No heap.
struct FlowField {
  static constexpr int kMaxColumns = 16, kMaxRows = 12;
  int columns = 12, rows = 9;
  std::array<FlowCell, kMaxColumns * kMaxRows> cells{};

  [[nodiscard]] int count() const WASP_REALTIME { return columns * rows; }
  FlowCell& at(int column, int row) WASP_REALTIME { return cells[static_cast<std::size_t>(row * columns + column)]; }
  [[nodiscard]] const FlowCell& at(int column, int row) const WASP_REALTIME {
    return cells[static_cast<std::size_t>(row * columns + column)];
  }
};

}  // namespace wasp::vision
