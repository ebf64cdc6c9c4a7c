// Pictures of residuals from the report's plots.
#pragma once

#include <string>

#include "calibration/calibration.h"
#include "tools/report_plot.h"

namespace wasp::calibration {

/// An empty plot; `title` is for screen readers.
inline tools::Plot labelled_plot(std::string title, std::string x_label, std::string y_label) {
  tools::Plot plot;
  plot.title = std::move(title), plot.x_label = std::move(x_label), plot.y_label = std::move(y_label);
  return plot;
}

inline Picture picture(std::string name, const tools::Plot& plot) {
  return {std::move(name), tools::standalone_svg(plot.svg())};
}

}  // namespace wasp::calibration
