// cyclictest (Debian rt-tests), the field's reference for wake-up latency, run so that every single wake-up comes out
// with its instant: -v prints them all, --secaligned puts the grid where we want it. What it skips after an overrun is
// worked out the way it does it itself, so that both sides of a comparison count alike.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/wakeups.h"

namespace wasp::tools {

struct CyclictestSpec {
  std::vector<int> cores;  ///< one measuring thread each, thread i on cores[i]
  int main_core = 0;       ///< of its printing thread
  int priority = 80;       ///< SCHED_FIFO
  DurationNs period_ns = 50 * kMillisecond;
  DurationNs phase_ns = 0;  ///< of its grid behind a full second of CLOCK_MONOTONIC, 0 ... 1 s, whole microseconds
  double seconds = 10;
};

/// Path of the program, nullopt where it is not installed.
std::optional<std::string> find_cyclictest();
std::vector<std::string> cyclictest_arguments(const std::string& program, const CyclictestSpec& spec);

/// Reads its output as it comes.
class CyclictestReader {
 public:
  explicit CyclictestReader(const CyclictestSpec& spec) : spec_(spec) {}
  /// Takes what was read from the pipe at `now_ns`: any part of a line, or many.
  void take(std::string_view text, TimeNs now_ns);
  /// Wake-ups by thread number. Instants are right to the second as long as one line arrived within a second.
  [[nodiscard]] std::map<int, std::vector<Wakeup>> wakeups() const;
  /// Lines that are neither samples nor the program's own messages we know, for the error report.
  [[nodiscard]] const std::string& complaints() const { return complaints_; }

 private:
  struct Row {
    int thread = 0;
    long long cycle = 0, late_ns = 0;
  };
  static std::optional<Row> parse(std::string_view line);
  void line(std::string_view text, TimeNs now_ns);

  CyclictestSpec spec_;
  std::string pending_, complaints_;
  std::map<int, std::vector<DurationNs>> late_ns_;
  TimeNs origin_bound_ns_ = 0;  ///< no later than this the grid's cycle 0 was due; 0: none yet
};

}  // namespace wasp::tools
