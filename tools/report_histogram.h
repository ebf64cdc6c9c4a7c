// Latency of one stage as a histogram: time on a logarithmic x axis, counts on a logarithmic y axis so that a single
// outlier is seen beside a million ordinary samples.
#pragma once

#include <string>

#include "tools/latency_summary.h"

namespace wasp::tools {

/// Decades shown by every histogram of a page [ns], so that panels compare.
struct LogRange {
  double low_ns = 1e3, high_ns = 1e9;
};
/// Whole decades that hold every sample and budget.
LogRange log_range_of(const std::vector<StageSummary>& stages);

/// SVG of 520 x 210: bars, p50, p99, p99.9 and max marked, the budget as a line of its own.
std::string histogram_svg(const StageSummary& stage, const LogRange& range);

}  // namespace wasp::tools
