// `wasp calibrate gyro`: bias from rest, and with a turntable the scale of each axis by a line through rest and two
// directions (thesis A.2.4.1).
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calibration/calibration.h"
#include "calibration/samples.h"

namespace wasp::calibration {

/// One recording on the turntable.
struct GyroTurn {
  int axis = 0;           ///< 0 x, 1 y, 2 z
  double rate_radps = 0;  ///< right-handed about that axis
  std::string file;
};
/// "z,33.33rpm,left.csv" or "x,-200degps,a.csv" or "y,3.49radps,b.csv". Throws std::runtime_error.
GyroTurn parse_turn(const std::string& text);

struct GyroOptions {
  SampleOptions samples;           ///< of the rest; its columns and unit hold for the turns too
  std::vector<std::string> turns;  ///< parse_turn
};

/// Throws Refusal.
Solution solve_gyro(const GyroOptions& options, ProgressBar& bar);

std::function<Solution(ProgressBar&)> prepare_gyro(CLI::App& app);

}  // namespace wasp::calibration
