// Counters that real-time threads raise, told to the log by the supervisor: a line at once when a burst begins, its
// totals when it is over, and nothing in between, so that a fault of minutes does not fill the log.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "scheduling/stage_table.h"

namespace wasp::scheduling {

/// One kind of what is counted.
struct BurstCounter {
  const std::atomic<std::uint64_t>* word;
  const char* kind;
};

/// Ordinary thread.
class BurstReport {
 public:
  /// A burst is over when nothing was counted for this long.
  static constexpr DurationNs kQuiet = 1 * kSecond;

  /// "frames refused", and its kinds. Counts from what the words hold now.
  BurstReport(std::string what, std::vector<BurstCounter> counters);
  void look(TimeNs now_ns, const std::function<void(const std::string&)>& log);

 private:
  /// "12 duplicate, 1 misdated" since `from`.
  [[nodiscard]] std::string counts_since(const std::vector<std::uint64_t>& from) const;
  [[nodiscard]] std::vector<std::uint64_t> read() const;

  std::string what_;
  std::vector<BurstCounter> counters_;
  std::vector<std::uint64_t> seen_, before_burst_, told_;
  TimeNs began_at_ns_ = 0, rose_at_ns_ = 0;
  bool burst_ = false;
};

}  // namespace wasp::scheduling
