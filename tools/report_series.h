// A curve, and how a long one is thinned for drawing: in each of n slices along the curve only its least and greatest
// value stay, in their order, so that no peak is lost. NaN in y breaks the curve and stays a break.
#pragma once

#include <cstddef>
#include <vector>

namespace wasp::tools {

struct Series {
  std::vector<double> x, y;  ///< same length

  void add(double px, double py) {
    x.push_back(px);
    y.push_back(py);
  }
  [[nodiscard]] std::size_t size() const { return x.size(); }
};

/// At most about 3 * slices points. Short curves come back unchanged.
Series thin_envelope(const Series& series, std::size_t slices);

/// Drops points nearer than `distance` (in both axes' common unit) to the last one kept; for paths. Keeps the last.
Series thin_path(const Series& series, double distance);

/// Smallest and greatest finite value over several vectors; {0, 1} if there is none.
struct Range {
  double low = 0, high = 1;
  [[nodiscard]] double span() const { return high - low; }
};
Range range_of(const std::vector<const std::vector<double>*>& values);

/// Round numbers that cover `range` with about `wanted` steps of 1, 2 or 5 times a power of ten.
std::vector<double> nice_ticks(Range range, int wanted);

}  // namespace wasp::tools
