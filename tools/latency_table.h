// The latency table on a terminal: one row per stage, no outlier removed.
#pragma once

#include <string>
#include <vector>

#include "tools/latency_summary.h"

namespace wasp::tools {

/// Lines of text, the first a header. `host_line` names kernel, scheduler and host; `real_time` false marks every row.
std::string latency_table(const std::vector<StageSummary>& stages, const std::string& host_line, bool real_time);

}  // namespace wasp::tools
