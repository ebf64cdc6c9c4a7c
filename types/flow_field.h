// Optical flow on a grid: one output type for every engine, and the message that carries it to the behaviours.
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "types/realtime.h"
#include "types/time.h"

namespace wasp {

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

/// One flow field on its way through a ring: what the camera saw move from one frame to the next, and the camera's own
/// turn in that time. Every behaviour that needs flow reads this one field.
struct FlowMessage {
  TimeNs exposed_at_ns = 0;        ///< of the second frame
  TimeNs first_exposed_at_ns = 0;  ///< of the first frame, earlier
  std::uint32_t frame_sequence = 0;
  std::uint32_t derotated = 0;  ///< 1: the turn was known and is taken out of `still`
  /// Row-major R: a point at infinity seen along d in the first frame is seen along R d in the second; camera axes.
  std::array<float, 9> R_second_first{1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::array<float, 4> q_ned_body{1, 0, 0, 0};  ///< attitude at the second frame, level when unknown
  FlowField seen;                               ///< as seen
  FlowField still;                              ///< without the camera's own turn; equal to `seen` when that is unknown
  /// Depth along the optical axis at each cell's centre in the first frame [m]; 0: unknown.
  std::array<float, FlowField::kMaxColumns * FlowField::kMaxRows> depth_m{};

  /// Time between the frames [s]. Realtime-safe: yes.
  [[nodiscard]] float interval_s() const WASP_REALTIME {
    return static_cast<float>(to_seconds(exposed_at_ns - first_exposed_at_ns));
  }
};
static_assert(std::is_trivially_copyable_v<FlowMessage> && sizeof(FlowMessage) % 8 == 0);

}  // namespace wasp
