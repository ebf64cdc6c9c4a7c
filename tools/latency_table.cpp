#include "tools/latency_table.h"

#include <fmt/format.h>

namespace wasp::tools {

std::string latency_table(const std::vector<StageSummary>& stages, const std::string& host_line, bool real_time) {
  std::string text = fmt::format("latency: {}{}\n", host_line, real_time ? "" : "; NOT REAL TIME");
  text += fmt::format("  {:<18} {:<16} {:>8} {:>9} {:>9} {:>9} {:>9} {:>9} {:>7}\n", "owner", "stage", "count", "p50",
                      "p99", "p99.9", "max", "budget", "misses");
  for (const auto& s : stages)
    text += fmt::format("  {:<18} {:<16} {:>8} {:>9} {:>9} {:>9} {:>9} {:>9} {:>7}\n", s.owner, s.stage, s.count,
                        duration_text(s.p50_ns), duration_text(s.p99_ns), duration_text(s.p999_ns),
                        duration_text(s.max_ns), s.budget_ns > 0 ? duration_text(s.budget_ns) : "-",
                        s.budget_ns > 0 ? std::to_string(s.misses) : "-");
  return text;
}

}  // namespace wasp::tools
