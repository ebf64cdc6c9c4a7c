// Whether a measured shift is the motion of the window's middle: where the images also turn or grow, the correlation
// peak follows the strongest texture instead. A Gauss-Newton fit of an affine motion, started at the shift, says so
// with its first step; only if that step is large are more made, and the middle's motion taken from the fit.
//
// Realtime-safe: yes, all.
#pragma once

#include "types/realtime.h"
#include "vision/kernels/image_shift_affine.h"

namespace wasp::vision::shift {

inline constexpr int kMostFits = 8;

struct CheckParams {
  float agree = 0.15f;      ///< first step of the middle [bins] up to which the shift is left as it is at once
  float differ = 0.3f;      ///< first step [bins] from which a shift that no fit can mend is wrong
  float settled = 0.03f;    ///< last step of the middle [bins] at which the fit has converged
  float explained = 0.7f;   ///< difference a fit must get below, as a share of what the shift leaves, to be believed
  float most_error = 0.1f;  ///< standard deviation of the middle's motion [bins] from noise that makes the difference
  float least_texture = 2;  ///< energy of the gradient in its weakest direction, over what noise alone would show
};

struct Check {
  Affine motion;           ///< of the first image's content to the second's [bins]
  float error = 0;         ///< as CheckParams::most_error
  float texture = 0;       ///< as CheckParams::least_texture
  int fits = 0;            ///< 0 (too little in common) ... kMostFits
  bool corrected = false;  ///< the images turn or grow: take the middle's motion from `motion`, not from the shift
  bool good = false;       ///< false: the shift is not to be relied on
};

/// windows: Hann windows of every length up to the images' longer side, length n at row n, `window_pitch` floats a row;
/// weights: room for two rows of it.
Check check_shift(const ImagePair& images, float dx, float dy, const CheckParams& params, const float* windows,
                  int window_pitch, float* weights) WASP_REALTIME;

}  // namespace wasp::vision::shift
