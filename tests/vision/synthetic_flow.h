// Flow fields made from a known motion, for tests of everything that reads a flow grid.
#pragma once

#include <cmath>
#include <random>

#include "types/camera.h"
#include "vision/kernels/flow_field.h"

namespace wasp::vision::test {

/// Cells of the default grid over an image; `motion(x, y)` gives {u, v}, plus normal noise.
template <class Motion>
FlowField make_flow(Motion motion, float noise_px = 0.f, unsigned seed = 1, int width_px = 640, int height_px = 480) {
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0.f, 1.f);
  FlowField flow;
  for (int r = 0; r < flow.rows; ++r)
    for (int c = 0; c < flow.columns; ++c) {
      FlowCell& cell = flow.at(c, r);
      cell.x_px = (static_cast<float>(c) + 0.5f) * static_cast<float>(width_px) / static_cast<float>(flow.columns);
      cell.y_px = (static_cast<float>(r) + 0.5f) * static_cast<float>(height_px) / static_cast<float>(flow.rows);
      const auto [u, v] = motion(cell.x_px, cell.y_px);
      cell.u_px = u + noise_px * noise(random), cell.v_px = v + noise_px * noise(random);
      cell.quality = 1.f, cell.valid = 1;
    }
  return flow;
}

struct Uv {
  float u, v;
};

/// Rotation, scale about (cx, cy) and shift.
inline auto similarity(float angle_rad, float scale, float tu, float tv, float cx = 319.5f, float cy = 239.5f) {
  const float a = scale * std::cos(angle_rad) - 1.f, b = scale * std::sin(angle_rad);
  return [=](float x, float y) { return Uv{a * (x - cx) - b * (y - cy) + tu, b * (x - cx) + a * (y - cy) + tv}; };
}

/// Replaces a share of the cells by large random flow.
inline void spoil(FlowField& flow, float share, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> pick(0.f, 1.f), large(-20.f, 20.f);
  for (int i = 0; i < flow.count(); ++i)
    if (pick(random) < share) {
      flow.cells[static_cast<std::size_t>(i)].u_px = large(random);
      flow.cells[static_cast<std::size_t>(i)].v_px = large(random);
    }
}

}  // namespace wasp::vision::test
