// The balance strategy (6.1): a gross force from the flow in four wedges about the focus of expansion, left against
// right and top against bottom, averaged over ten frames; a fine force away from near obstacles about that focus. Both
// forces point where the vehicle should go, in image axes: x right, y down.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "types/realtime.h"
#include "vision/kernels/cluster.h"
#include "vision/kernels/flow_field.h"

namespace wasp::vision {

struct ImageForce {
  float x = 0, y = 0;
};

/// kPrinted: minus the sum of the flow's x over the left and right wedges and of its y over the top and bottom ones
/// (6.1); roll cancels only where the valid cells lie symmetrically about the focus. kRadial (default, derived here):
/// only the flow's component along the ray from the focus, which roll about the optical axis does not have, whichever
/// cells are valid; and a mean for each wedge, so that a bare wall does not look like a far one.
enum class BalanceForm : std::uint8_t { kRadial, kPrinted };

struct BalanceParams {
  BalanceForm form = BalanceForm::kRadial;
  float wedge_half_angle_rad = 0.7853982f;  ///< of each wedge, (0, pi/4]: the drawing (fig. 6.4) did not survive
  float min_radius_px = 20.f;               ///< nearer cells belong to no wedge: their direction is noise
  int min_cells = 3;                        ///< valid cells each wedge of a pair must have
};

/// Gross force [px/frame], one frame.
struct GrossForce {
  bool valid_x = false, valid_y = false;  ///< false: too few cells on one side; the component is 0 then
  ImageForce force;
  std::array<int, 4> cells{};  ///< valid cells in the left, right, top and bottom wedge
};

/// Cells that are invalid or not finite do not count; a focus that is not finite, a field of impossible size or
/// parameters out of range give an invalid force. Realtime-safe: yes.
GrossForce gross_force(const BalanceParams& params, const FlowField& flow, float foe_x_px,
                       float foe_y_px) WASP_REALTIME;

/// The mean of the last ten forces (6.16), or of all while there are fewer. Summed anew each time: (6.16)'s running
/// form gathers rounding errors for as long as the flight lasts.
struct ForceAverage {
  static constexpr int kLength = 10;
  std::array<ImageForce, kLength> last{};
  int count = 0, next = 0;

  /// Adds `force` (0 for a component that is not finite) and returns the mean. Realtime-safe: yes.
  ImageForce add(const ImageForce& force) WASP_REALTIME;
};

/// One obstacle: the cells of one cluster.
struct Obstacle {
  float x_px = 0, y_px = 0;  ///< mean position of its cells
  int cells = 0;
  float depth_m = 0;
};

struct Obstacles {
  int count = 0;
  std::array<Obstacle, kMaxClusters> obstacle{};
};

/// Obstacles of `clusters` of the observations [X_u, X_v], whose cells lie at (x_px, y_px): centre of the cells, mean
/// of both depths. None if the clusters are invalid or the sizes differ. Realtime-safe: yes.
Obstacles obstacles_of(const Clusters& clusters, std::span<const float> x_px,
                       std::span<const float> y_px) WASP_REALTIME;

struct FineParams {
  float max_distance_px = 300.f;  ///< k_l: farther from the focus is the gross force's business
  int min_cells = 4;              ///< k_s = 0 for 3 cells or fewer
  float size_gain = 5.f;          ///< k_s
  float depth_gain = 10.f;        ///< k_d
  float max_depth_m = 5.f;        ///< D_max; obstacles at or beyond it do not count
  float min_offset_px = 20.f;     ///< an obstacle closer to the focus counts as this far off (tie break)
};

/// Fine force (6.13, 6.14): minus the sum of (S - FOE) size k_s (D_max - depth) k_d. For an obstacle at the focus,
/// where that vanishes, the tie is broken: at less than min_offset_px it counts as that far off in its own direction;
/// with no direction (under 0.001 px) as lying against `gross`, so that both forces agree; without a gross force, as
/// lying left, so that the vehicle goes right. Anything not finite counts as no obstacle. Realtime-safe: yes.
ImageForce fine_force(const FineParams& params, const Obstacles& obstacles, float foe_x_px, float foe_y_px,
                      const ImageForce& gross) WASP_REALTIME;

/// k_c F_c + k_f F_f (6.15).
constexpr ImageForce net_force(const ImageForce& gross, float gross_gain, const ImageForce& fine,
                               float fine_gain) WASP_REALTIME {
  return {gross_gain * gross.x + fine_gain * fine.x, gross_gain * gross.y + fine_gain * fine.y};
}

}  // namespace wasp::vision
