#include "vision/kernels/ventral_flow.h"

#include <algorithm>
#include <cmath>

#include "vision/kernels/weighted_fit.h"

namespace wasp::vision {

VentralFlow ventral_flow(const VentralParams& params, const LevelFlow& flow) noexcept {
  VentralFlow out;
  if (!flow.valid || !(params.half_angle_rad > 0.f) || params.min_cells < 2) return out;
  const float least_z = std::cos(std::min(params.half_angle_rad, 1.2f));
  WeightedFit<3, 2 * kMaxFlowPoints> fit;
  for (const LevelCell& cell : flow.view()) {
    if (!cell.moved || !(cell.first.z() >= least_z) || !(cell.second.z() > 0.2f)) continue;
    const float X = cell.first.x() / cell.first.z(), Y = cell.first.y() / cell.first.z();
    fit.add({-1.f, 0.f, X}, (cell.second.x() / cell.second.z() - X) / flow.interval_s);
    fit.add({0.f, -1.f, Y}, (cell.second.y() / cell.second.z() - Y) / flow.interval_s);
  }
  out.cells = fit.count / 2;
  Vec3 x;
  if (out.cells < params.min_cells || !fit.solve(1e-3f, 1e-3f, x)) return out;
  out.forward_radps = x[0], out.right_radps = x[1], out.sinking_1ps = x[2];
  out.sigma_radps = 1.4826f * fit.residual / std::sqrt(static_cast<float>(out.cells));
  out.valid = out.sigma_radps <= params.max_sigma_radps;
  return out;
}

}  // namespace wasp::vision
