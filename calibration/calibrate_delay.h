// `wasp calibrate delay DIR ...`: the delay of a camera's stamps behind the sensors', from recordings with grey images
// and a gyro or true poses; short ones are fitted together. delay_fit.h has the method. Written as [camera] delay_ms,
// which whoever writes a live camera's frames takes off their stamps.
#pragma once

#include "calibration/calibration.h"
#include "calibration/delay_fit.h"

namespace wasp::calibration {

struct DelayOptions {
  std::vector<std::string> folders{};
  std::string against = "best";  ///< best | gyro | poses
  DelayParams fit{};
};

/// Throws Refusal, or std::runtime_error for a folder that is no good.
Solution solve_delay(const DelayOptions& options, ProgressBar& bar);
std::function<Solution(ProgressBar&)> prepare_delay(CLI::App& app);

/// The sensor of a recording to hold the images against; throws Refusal where it has none of the kind.
TurnSource turn_source_of(const drivers::Recording& recording, const std::string& against);

}  // namespace wasp::calibration
