// A small plot writer: lines over shaded spans, axes with round ticks, units, a legend, as one inline SVG. Colours are
// classes (c0 ... c5, ink), set by the page's style sheet for light and dark.
#pragma once

#include <string>
#include <vector>

#include "tools/report_series.h"

namespace wasp::tools {

/// How a curve looks: a colour class and a stroke class ("thin", "thick", "dashed"; "dots": its points, unjoined).
struct CurveStyle {
  std::string colour = "c0";
  std::string stroke = "thin";
};

struct Curve {
  std::string name;  ///< empty: no entry in the legend
  CurveStyle style;
  Series series;
};

/// A shaded stretch of the x axis with a name on top.
struct Span {
  std::string name;
  double from = 0, to = 0;
};

/// What the numbers of an axis are. A logarithmic axis is given the decimal logarithms of its values.
enum class Scale { kLinear, kLog, kLogDuration };  ///< kLogDuration: of nanoseconds

struct Plot {
  std::string title;  ///< for screen readers; the page prints its own heading
  std::string x_label, y_label;
  int width = 1100, height = 330;
  bool equal_axes = false;  ///< one metre is as long in x as in y
  double least_y_span = 0;  ///< keeps a flat curve flat
  Scale x_scale = Scale::kLinear, y_scale = Scale::kLinear;
  std::vector<Span> spans;
  std::vector<Curve> curves;
  struct Mark {
    std::string name;
    double x = 0, y = 0;
  };
  std::vector<Mark> marks;  ///< named points

  /// The SVG element; a note instead of curves when there is nothing to draw.
  [[nodiscard]] std::string svg() const;
};

/// & < > " as entities.
std::string escape_html(std::string_view text);
/// A tick label: as many decimals as the step needs.
std::string tick_text(double value, double step);
/// "10 us" for 4, "1 s" for 9: a decade of nanoseconds.
std::string decade_text(int decade);
/// An SVG file of its own: the element with name space and style sheet.
std::string standalone_svg(const std::string& svg);
/// Width of a label of the style sheet's size, for spacing [px].
double text_width(std::string_view text);

}  // namespace wasp::tools
