// Rotation, scale and shift of the image from a flow grid: f = (z - 1)(p - c) + t with z = s e^(i theta), one complex
// number for rotation and scale. Consensus over pairs of cells finds the motion most cells share; reweighted least
// squares (Tukey's biweight, closed form) polishes it. Fixed trip counts: kSimilarityTrials pairs, kSimilarityRounds
// rounds. The default for heading rate and height ratio (algorithms page, section 4) and for the scale behind
// time-to-contact.
#pragma once

#include <cstdint>

#include "types/realtime.h"
#include "vision/kernels/flow_field.h"

namespace wasp::vision {

inline constexpr int kSimilarityTrials = 96;
inline constexpr int kSimilarityRounds = 8;

struct SimilarityFitParams {
  float centre_x_px = 319.5f, centre_y_px = 239.5f;  ///< c, where the shift is stated; elsewhere it only adds to it
  float inlier_px = 2.f;          ///< a cell this far off does not follow the motion: room for lens distortion, tilt
                                  ///< and relief that a similarity cannot follow; noise has its own, robust scale
  float flow_sigma_px = 0.03f;    ///< least credible noise of one cell and axis; floors the robust scale and the sigmas
  int min_cells = 8;              ///< fewer cells in agreement: invalid
  float min_inlier_share = 0.4f;  ///< of the valid cells
};

struct SimilarityFit {
  bool valid = false;
  float rotation_rad = 0;                             ///< of the image, x towards y (clockwise as seen)
  float log_scale = 0;                                ///< ln s; > 0: the image grows
  float shift_u_px = 0, shift_v_px = 0;               ///< t, motion at the centre
  float rotation_sigma_rad = 0, log_scale_sigma = 0;  ///< 1 sigma from the residuals, independent cells assumed
  float residual_px = 0;                              ///< rms per axis over the inliers
  int cells = 0, inliers = 0;                         ///< valid cells, and those that follow the motion
};

/// Invalid for a field of bad shape, too few cells, cells in one spot, or no agreement. Cells that are not finite are
/// left out. Deterministic. Realtime-safe: yes.
SimilarityFit fit_similarity(const SimilarityFitParams& params, const FlowField& flow) WASP_REALTIME;

}  // namespace wasp::vision
