#include "scheduling/response_time.h"

#include <algorithm>

namespace wasp::scheduling {
namespace {

DurationNs ceil_div(DurationNs a, DurationNs b) { return (a + b - 1) / b; }

bool share_a_core(const AnalysedThread& a, const AnalysedThread& b) {
  return a.core == b.core || a.core < 0 || b.core < 0;
}

/// Releases of `j` that may fall into a window of `w_ns`, each at its full cost.
DurationNs demand(const AnalysedThread& j, DurationNs w_ns) {
  return ceil_div(w_ns + j.jitter_ns, j.period_ns) * j.cost_ns;
}

ResponseTime analyse(const std::vector<AnalysedThread>& threads, std::size_t i) {
  const AnalysedThread& self = threads[i];
  const DurationNs deadline_ns = std::min(self.deadline_ns, self.period_ns);
  ResponseTime r;
  for (std::size_t j = 0; j < threads.size(); ++j)
    if (j != i && share_a_core(self, threads[j]) && threads[j].priority >= self.priority) r.delayed_by.push_back(j);
  DurationNs w_ns = self.cost_ns + self.blocking_ns, before_ns = 0;
  while (w_ns != before_ns && w_ns + self.jitter_ns <= deadline_ns) {
    before_ns = w_ns;
    w_ns = self.cost_ns + self.blocking_ns;
    for (const std::size_t j : r.delayed_by) w_ns += demand(threads[j], before_ns);
  }
  r.response_ns = w_ns + self.jitter_ns;
  r.bounded = w_ns == before_ns;
  r.meets_deadline = r.bounded && r.response_ns <= deadline_ns;
  for (const std::size_t j : r.delayed_by) r.delay_ns.push_back(demand(threads[j], r.bounded ? w_ns : before_ns));
  return r;
}

}  // namespace

std::vector<ResponseTime> response_times(const std::vector<AnalysedThread>& threads) {
  std::vector<ResponseTime> results;
  for (std::size_t i = 0; i < threads.size(); ++i) results.push_back(analyse(threads, i));
  return results;
}

double utilisation(const std::vector<AnalysedThread>& threads, int core) {
  double sum = 0;
  for (const auto& t : threads)
    if (t.core == core || t.core < 0) sum += static_cast<double>(t.cost_ns) / static_cast<double>(t.period_ns);
  return sum;
}

}  // namespace wasp::scheduling
