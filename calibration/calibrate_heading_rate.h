// `wasp calibrate heading-rate DIR`: the scale of the heading rate behaviour from a turntable run (heading_scale.h).
// Written as [behaviour.heading_rate] scale.
#pragma once

#include <optional>

#include "calibration/calibration.h"
#include "calibration/heading_scale.h"

namespace wasp::calibration {

struct HeadingRateOptions {
  std::string folder{};
  std::string against = "best";      ///< best | gyro | poses
  std::optional<double> delay_ms{};  ///< of the camera; nullopt: found first, by the turns about the optical axis
  HeadingScaleParams fit{};
};

/// Throws Refusal, or std::runtime_error for a folder that is no good.
Solution solve_heading_rate(const HeadingRateOptions& options, ProgressBar& bar);
std::function<Solution(ProgressBar&)> prepare_heading_rate(CLI::App& app);

}  // namespace wasp::calibration
