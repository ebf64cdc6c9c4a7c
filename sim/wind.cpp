#include "sim/wind.h"

#include <cmath>

namespace wasp::sim {

Wind::Wind(const WindParams& params, std::uint32_t seed)
    : params_(params),
      random_(seed),
      mean_(-params.mean_mps * std::cos(params.from_rad), -params.mean_mps * std::sin(params.from_rad), 0),
      deviation_(params.gust_mps, params.gust_mps, params.gust_mps / 2),
      velocity_(blows() ? mean_ : Eigen::Vector3d(0, 0, 0)) {}

void Wind::step(double dt_s) {
  if (params_.gust_mps <= 0) return;
  const double keep = std::exp(-dt_s / params_.gust_time_s), fresh = std::sqrt(1 - keep * keep);
  for (int i = 0; i < 3; ++i) gust_[i] = keep * gust_[i] + fresh * deviation_[i] * random_.normal();
  velocity_ = mean_ + gust_;
}

}  // namespace wasp::sim
