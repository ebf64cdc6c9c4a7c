// What an evaluation prints: named figures with units, some with a bar to pass.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace wasp::tools {

struct Bar {
  double value = 0;
  bool at_least = false;  ///< false: the figure may not exceed it
};

struct Figure {
  std::string name;
  double value = 0;
  std::string unit;
  std::optional<Bar> bar{};

  [[nodiscard]] bool ok() const;
};

/// Order statistics of a sample; all NaN when it is empty.
struct Spread {
  double mean, median, p95, max;
};
Spread spread(std::vector<double> values);

/// Adds <prefix>_mean, _median, _p95 and _max; the bar applies to the maximum.
void add_spread(std::vector<Figure>& figures, const std::string& prefix, const std::string& unit,
                const std::vector<double>& values, std::optional<Bar> bar = {});

/// Adds time_p50, time_p999 and time_max [us].
void add_times(std::vector<Figure>& figures, std::vector<double> times_us);

/// A table for people, or one JSON object a line. Returns true when every figure is ok.
bool print(const std::vector<Figure>& figures, bool json);

/// Spearman's rank correlation; NaN for fewer than two pairs.
double rank_correlation(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace wasp::tools
