// `wasp calibrate baro`: a straight line through readings at known heights (thesis A.2.4.1). Pressure is first turned
// into the standard atmosphere's altitude, in which a true sensor's line is straight and its slope one.
#pragma once

#include <string>
#include <vector>

#include "calibration/calibration.h"

namespace wasp::calibration {

/// What was read at one height, or one reading of a climb.
struct BaroLevel {
  double height_m = 0, reading = 0, sigma = 0;  ///< of the mean; 0: one reading
  double time_s = 0;
  std::size_t count = 1;
};

struct BaroOptions {
  std::string table;            ///< CSV with heights and readings
  std::vector<std::string> at;  ///< "HEIGHT,RECORDING": the pressure of a whole recording
  std::string height_column = "height_m";
  std::string reading_column;  ///< empty: known by name
  std::string unit;            ///< hPa | counts; empty: told by the name
};

/// Throws Refusal.
Solution solve_baro(const BaroOptions& options, ProgressBar& bar);

std::function<Solution(ProgressBar&)> prepare_baro(CLI::App& app);

}  // namespace wasp::calibration
