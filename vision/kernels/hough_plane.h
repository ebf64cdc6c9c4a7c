// The thesis' randomized Hough transform for the dominant plane (section 6.2, algorithm 1), as printed apart from its
// misprints: three depth pixels span a plane (6.28-6.30), theta = atan2(n_y, n_x) (the arcsine of (6.32) loses the
// quadrant), one vote for its cell, done when a cell reaches T_A or the draws run out.
// A reference for figures and comparisons; vision/kernels/depth_plane.h is what flies. It finds the DOMINANT plane,
// be it floor or wall, and its angle bins degenerate at phi = 0, a level floor seen straight down.
#pragma once

#include <array>
#include <cstdint>

#include "types/camera.h"
#include "types/image_view.h"
#include "types/realtime.h"
#include "vision/kernels/depth_samples.h"
#include "vision/kernels/hough_samplers.h"

namespace wasp::vision {

struct HoughParams {
  HoughSamplerParams sampling;
  DepthRange range;
  int bins = 200;                ///< per axis, 8 ... 255
  int accept_votes = 10;         ///< T_A, 2 ... 1000
  int max_draws = kHoughTuples;  ///< T_I, at most kHoughTuples
  float max_distance_m = 4.f;    ///< d_max of local (Cartesian), between any two of the three points
  float max_rho_m = 10.f;        ///< upper end of the rho axis
  bool mean_of_cell = true;      ///< answer with the mean of the winning cell's votes instead of its centre
};

struct HoughPlane {
  bool valid = false;
  Vec3 normal_cam = Vec3::Zero();  ///< unit, towards the camera's side: n . X = -height
  float height_m = 0;              ///< rho
  int votes = 0;                   ///< in the winning cell
  int draws = 0;                   ///< tuples looked at
  int planes = 0;                  ///< of which were valid, not degenerate and voted
};

/// The thesis' tree theta -> phi -> rho would allocate: here the accumulator is a hash of fixed capacity, twice as many
/// slots as there can be votes, so it never fills.
class RandomizedHough {
 public:
  /// Draws the tuples. Not for the flight loop.
  RandomizedHough(const HoughParams& params, const Intrinsics& intrinsics) WASP_REALTIME;

  /// One frame; invalid when no cell reaches T_A, or the view does not fit the intrinsics. Realtime-safe: yes.
  HoughPlane detect(const DepthView& depth) WASP_REALTIME;

 private:
  struct Cell {
    std::uint32_t key, votes;
    Vec3 normal_sum;
    float rho_sum;
  };
  static constexpr std::uint32_t kSlots = 2 * kHoughTuples;
  static constexpr std::uint32_t kEmpty = 0xffffffffu;

  [[nodiscard]] bool span(const DepthView& depth, const PixelTuple& tuple, Vec3& normal,
                          float& rho_m) const WASP_REALTIME;
  [[nodiscard]] bool point(const DepthView& depth, int u, int v, Vec3& out) const WASP_REALTIME;
  [[nodiscard]] std::uint32_t key_of(const Vec3& normal, float rho_m) const WASP_REALTIME;
  Cell& vote(std::uint32_t key, const Vec3& normal, float rho_m) WASP_REALTIME;
  [[nodiscard]] HoughPlane answer(const Cell& cell) const WASP_REALTIME;

  HoughParams params_;
  Intrinsics intrinsics_;
  bool usable_;
  std::array<PixelTuple, kHoughTuples> tuples_;
  std::array<Cell, kSlots> cells_;
};

}  // namespace wasp::vision
