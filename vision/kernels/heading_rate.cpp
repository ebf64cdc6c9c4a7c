// Signs and inverses only; the work is in the similarity fit.
#include "vision/kernels/heading_rate.h"

#include <cmath>

namespace wasp::vision {

HeadingRate heading_from_fit(const SimilarityFit& fit, float max_sigma) noexcept {
  HeadingRate rate;
  if (!fit.valid || !std::isfinite(fit.rotation_rad) || !std::isfinite(fit.log_scale)) return rate;
  rate.yaw_rad = -fit.rotation_rad;
  rate.height_ratio = std::exp(-fit.log_scale);
  rate.yaw_sigma_rad = fit.rotation_sigma_rad;
  rate.height_ratio_sigma = rate.height_ratio * fit.log_scale_sigma;
  rate.valid = rate.yaw_sigma_rad <= max_sigma && rate.height_ratio_sigma <= max_sigma;
  return rate;
}

float climb_rate_mps(const HeadingRate& rate, float height_m, float step_s) noexcept {
  return rate.valid && step_s > 0.f ? (rate.height_ratio - 1.f) * height_m / step_s : 0.f;
}

}  // namespace wasp::vision
