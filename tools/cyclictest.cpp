#include "tools/cyclictest.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

namespace wasp::tools {

std::optional<std::string> find_cyclictest() {
  std::string path = "/usr/sbin:/usr/local/bin";
  if (const char* p = std::getenv("PATH")) path = std::string(p) + ":" + path;
  for (std::size_t from = 0; from <= path.size();) {
    const std::size_t to = std::min(path.find(':', from), path.size());
    const std::string candidate = path.substr(from, to - from) + "/cyclictest";
    if (access(candidate.c_str(), X_OK) == 0) return candidate;
    from = to + 1;
  }
  return std::nullopt;
}

std::vector<std::string> cyclictest_arguments(const std::string& program, const CyclictestSpec& spec) {
  std::string cores;
  for (const int c : spec.cores) cores += fmt::format("{}{}", cores.empty() ? "" : ",", c);
  const auto loops =
      static_cast<long long>(spec.seconds * static_cast<double>(kSecond) / static_cast<double>(spec.period_ns));
  std::vector<std::string> a{program,
                             "--affinity=" + cores,
                             fmt::format("--threads={}", spec.cores.size()),
                             fmt::format("--mainaffinity={}", spec.main_core),
                             "--policy=fifo",
                             fmt::format("--priority={}", spec.priority),
                             fmt::format("--interval={}", spec.period_ns / kMicrosecond),
                             "--distance=0",
                             fmt::format("--secaligned={}", spec.phase_ns / kMicrosecond),
                             fmt::format("--loops={}", std::max(1LL, loops)),
                             "--mlockall",
                             "--nsecs",
                             "--verbose",
                             "--unbuffered"};
  return a;
}

std::optional<CyclictestReader::Row> CyclictestReader::parse(std::string_view line) {
  Row row;
  const std::string text(line);
  int end = 0;
  if (std::sscanf(text.c_str(), " %d : %lld : %lld%n", &row.thread, &row.cycle, &row.late_ns, &end) != 3) return {};
  return static_cast<std::size_t>(end) == text.size() ? std::optional(row) : std::nullopt;
}

void CyclictestReader::line(std::string_view text, TimeNs now_ns) {
  if (const auto row = parse(text)) {
    auto& late = late_ns_[row->thread];
    late.push_back(row->late_ns);
    const TimeNs bound = now_ns - static_cast<DurationNs>(late.size()) * spec_.period_ns;
    if (origin_bound_ns_ == 0 || bound < origin_bound_ns_) origin_bound_ns_ = bound;
    return;
  }
  if (text.empty() || text.starts_with("#") || text.starts_with("T:") || text.starts_with("Max CPUs") ||
      text.starts_with("Online CPUs") || text.starts_with("Using") || text.starts_with("Thread"))
    return;
  if (complaints_.size() < 2000) complaints_.append(text).append("\n");
}

void CyclictestReader::take(std::string_view text, TimeNs now_ns) {
  pending_.append(text);
  std::size_t from = 0;
  for (std::size_t to = pending_.find('\n'); to != std::string::npos; to = pending_.find('\n', from)) {
    line(std::string_view(pending_).substr(from, to - from), now_ns);
    from = to + 1;
  }
  pending_.erase(0, from);
}

/// Cycle 0 is due one period after full second + phase; after an overrun the grid advances past "now".
std::map<int, std::vector<Wakeup>> CyclictestReader::wakeups() const {
  std::map<int, std::vector<Wakeup>> all;
  const TimeNs second = (origin_bound_ns_ - spec_.phase_ns) / kSecond * kSecond;
  for (const auto& [thread, late] : late_ns_) {
    TimeNs due = second + spec_.phase_ns + spec_.period_ns;
    for (const DurationNs l : late) {
      all[thread].push_back({due, l, kNever});
      const TimeNs now = due + l;
      due += spec_.period_ns;
      while (now > due) due += spec_.period_ns;
    }
  }
  return all;
}

}  // namespace wasp::tools
