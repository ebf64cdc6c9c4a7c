// The 6 x 6 system of one Gauss-Newton step of flow_grid, solved by its 3 x 3 blocks: u's and v's three unknowns have
// the same basis (1, x, y), so the matrix is [A B; B C] with symmetric blocks; the Schur complement needs two inverses
// of symmetric 3 x 3 matrices and no square root.
#pragma once

#include <array>

#include "types/realtime.h"
#include "vision/kernels/flow_grid_tiles.h"

namespace wasp::vision {

/// Corrections of (shift, per 16 px right, per 16 px down) for u and v [px].
struct AffineStep {
  std::array<float, 3> u{}, v{};
};

/// `off` is the shift's distance from its prior; the affine terms' prior is zero. `shift` and `affine` are the priors'
/// information [grey^2]. False when the matrix is not positive. Realtime-safe: yes.
bool solve_affine_step(const BlockSums& sums, const std::array<float, 2>& off, const CellMotion& motion, float shift,
                       float affine, AffineStep& out) WASP_REALTIME;

}  // namespace wasp::vision
