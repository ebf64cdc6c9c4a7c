// What every calibration is: it declares its options, runs on recorded data, and either hands back a solution with its
// evidence or refuses. Writing, drawing and exit codes are the program's (calibrate_main.cpp).
#pragma once

#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/progress_bar.h"
#include "calibration/toml_section.h"

namespace CLI {
class App;
}

namespace wasp::calibration {

/// Thrown where the data do not determine the answer. what() is the reason, with the figure that shows it and what to
/// record instead.
class Refusal : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A picture of the residuals, a whole SVG file (tools::standalone_svg).
struct Picture {
  std::string name;  ///< ends its file's name: OUT_name.svg
  std::string svg;
};

struct Solution {
  std::vector<TomlSection> flight;  ///< sections and keys of config/wasp.toml; none if a flight has no use for it
  TomlSection evidence;             ///< written as [calibration.NAME]: values, units, standard deviations, tests passed
  std::string source;               ///< where the samples came from
  std::size_t samples = 0;          ///< that the fit rests on
  double residual_rms = 0;
  std::string residual_unit;
  std::vector<std::string> notes;  ///< what a person should know: printed, and written as comments
  std::vector<Picture> pictures;
};

/// One row of the table of calibrations.
struct Calibration {
  std::string_view name;
  std::string_view what;
  /// Declares options on `app`; the function it returns is called once they are parsed. That throws Refusal, or
  /// std::runtime_error naming the file that is no good.
  std::function<Solution(ProgressBar&)> (*prepare)(CLI::App& app);
};

}  // namespace wasp::calibration
