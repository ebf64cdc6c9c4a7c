#include "scheduling/burst_report.h"

#include <fmt/format.h>

#include <utility>

namespace wasp::scheduling {

BurstReport::BurstReport(std::string what, std::vector<BurstCounter> counters)
    : what_(std::move(what)), counters_(std::move(counters)), seen_(read()) {}

std::vector<std::uint64_t> BurstReport::read() const {
  std::vector<std::uint64_t> now;
  for (const auto& c : counters_) now.push_back(c.word->load(std::memory_order_relaxed));
  return now;
}

std::string BurstReport::counts_since(const std::vector<std::uint64_t>& from) const {
  std::string text;
  for (std::size_t i = 0; i < counters_.size(); ++i)
    if (seen_[i] > from[i])  // a word that fell lies in memory that was lost
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", seen_[i] - from[i], counters_[i].kind);
  return text;
}

void BurstReport::look(TimeNs now_ns, const std::function<void(const std::string&)>& log) {
  const std::vector<std::uint64_t> before = std::exchange(seen_, read());
  if (seen_ != before) {
    rose_at_ns_ = now_ns;
    if (burst_) return;
    burst_ = true;
    began_at_ns_ = now_ns;
    before_burst_ = before;
    told_ = seen_;
    if (const std::string counts = counts_since(before); !counts.empty()) log(what_ + ": " + counts);
    return;
  }
  if (!burst_ || now_ns - rose_at_ns_ < kQuiet) return;
  burst_ = false;
  if (seen_ != told_)
    log(fmt::format("{}: {} in {:.1f} s, over now", what_, counts_since(before_burst_),
                    to_seconds(rose_at_ns_ - began_at_ns_)));
}

}  // namespace wasp::scheduling
