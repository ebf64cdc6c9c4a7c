// Time to contact, in frames after the second frame of the flow: tau = r / (dr/dt) (5.10). Three ways to see it:
//  - rings (5.4.2, Camus): cells by their distance from the focus of expansion; on each ring the mean radial flow;
//  - log-polar: d rho / dt = M r' / (r + kappa), summed over phi; for kappa = 0 tau = M / (d rho / dt) everywhere;
//  - the scale of a similarity fit: a surface grown by s in one frame has tau = 1 / (s - 1). Over n frames,
//    tau = n / (s_n - 1) with s_n the product of the scales: the default, for it needs no focus of expansion.
// No estimate where growth is not significant against its own sigma: a still image has no time to contact.
#pragma once

#include <array>

#include "types/realtime.h"
#include "vision/kernels/flow_field.h"
#include "vision/kernels/log_polar.h"
#include "vision/kernels/similarity_fit.h"

namespace wasp::vision {

inline constexpr int kMaxContactRings = 16;
inline constexpr int kMaxContactWindow = 32;

struct TimeToContactParams {
  int rings = 8;                ///< 1 ... kMaxContactRings
  float min_radius_px = 10.f;   ///< closer to the focus the radial flow is noise
  float flow_sigma_px = 0.05f;  ///< least credible noise of one cell and axis
  float significance = 3.f;     ///< growth must exceed this many sigmas
  float max_frames = 1000.f;    ///< contact farther off (either way) is no contact
  int min_cells = 8;
};

struct TimeToContact {
  bool valid = false;
  float frames = 0;            ///< > 0: approaching; < 0: receding, frames since contact; 0 when invalid
  float growth_per_frame = 0;  ///< 1 / frames; small when invalid
  float growth_sigma = 0;      ///< 1 sigma of it
  int cells = 0;               ///< that took part
};

/// One ring of (5.10).
struct ContactRing {
  float radius = 0;       ///< mean of its cells: px, or columns of the map
  float radial_flow = 0;  ///< mean: px per frame, or columns per frame
  float frames = 0;       ///< its own time to contact; 0 without significance
  int cells = 0;
};
using ContactRings = std::array<ContactRing, kMaxContactRings>;

/// Rings about (foe_x, foe_y) in the image; the whole is the robustly weighted least squares of r' = r / tau over all
/// cells. `rings` may be null. Realtime-safe: yes.
TimeToContact contact_from_rings(const TimeToContactParams& params, const FlowField& flow, float foe_x_px,
                                 float foe_y_px, ContactRings* rings = nullptr) WASP_REALTIME;

/// The same cells as displacements in a log-polar map whose fovea is the focus of expansion; rings are bands of rho,
/// radius and flow in columns. The displacement is taken whole, rho(second) - rho(first), not its derivative, so large
/// flow costs nothing. Realtime-safe: yes.
TimeToContact contact_from_log_polar(const TimeToContactParams& params, const FlowField& flow,
                                     const LogPolarGeometry& map, ContactRings* rings = nullptr) WASP_REALTIME;

/// From the growth ln s over `frames` >= 1 frames and its sigma. Realtime-safe: yes.
TimeToContact contact_from_scale(const TimeToContactParams& params, float log_scale, float log_scale_sigma,
                                 int frames) WASP_REALTIME;

/// Growth over the last `window` frames, from one similarity fit a frame. A frame without a valid fit ends the history:
/// growth across a gap is unknown.
class ContactWindow {
 public:
  /// `window` 1 ... kMaxContactWindow (others are brought into range).
  explicit ContactWindow(int window, const TimeToContactParams& params = {}) WASP_REALTIME;

  /// Adds the fit of the newest pair of frames; estimates once `window` fits in a row are there. Realtime-safe: yes.
  TimeToContact add(const SimilarityFit& fit) WASP_REALTIME;
  void reset() WASP_REALTIME { count_ = 0; }

 private:
  struct Growth {
    float log_scale = 0, sigma = 0;
  };
  TimeToContactParams params_;
  int window_;
  std::array<Growth, kMaxContactWindow> history_{};  // oldest first
  int count_ = 0;
};

}  // namespace wasp::vision
