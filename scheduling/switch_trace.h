// The kernel's own trace of one core, while flying: an instance of tracefs of our own, with scheduler switches and
// interrupts in a small ring buffer, stopped and read after a miss. Tells what ran instead. Needs tracefs and root.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "types/time.h"

namespace wasp::scheduling {

/// One event on one core. For a switch `task` is what runs from now on; for an interrupt its name.
struct KernelEvent {
  TimeNs at_ns = 0;  ///< CLOCK_MONOTONIC, to the microsecond
  int core = 0;
  bool interrupt = false;
  std::string task;
  int pid = 0;
  int priority = 0;       ///< the kernel's: 99 - SCHED_FIFO priority; 100 and more: not real time
  int left_priority = 0;  ///< of what ran until now, as it left: it may have changed while it ran
};

/// Events of the text of a tracefs `trace` file, in its order; lines of other kinds are passed over.
std::vector<KernelEvent> parse_trace(std::string_view text);

/// How long a task had the core, and interrupts how often came.
struct CoreShare {
  std::string name;
  int pid = 0, priority = 0;
  DurationNs ran_ns = 0;
  std::uint64_t interrupts = 0;
};

/// Shares of `core` within [from, to], longest first, then interrupts by count. `events` must begin before `from` for
/// the first share to be known.
std::vector<CoreShare> shares_of(const std::vector<KernelEvent>& events, int core, TimeNs from_ns, TimeNs to_ns);

class SwitchTrace {
 public:
  /// `tracefs` empty: the usual mount points. Never throws: `why_not` says what is missing.
  SwitchTrace(const std::string& tracefs, int core);
  ~SwitchTrace();
  SwitchTrace(const SwitchTrace&) = delete;
  SwitchTrace& operator=(const SwitchTrace&) = delete;

  [[nodiscard]] bool available() const noexcept { return why_not_.empty(); }
  [[nodiscard]] const std::string& why_not() const noexcept { return why_not_; }
  [[nodiscard]] int core() const noexcept { return core_; }

  /// Stops, reads, empties and starts again. Supervisor only.
  std::vector<KernelEvent> take();

 private:
  void make_instance(const std::filesystem::path& instance);
  bool write(const std::string& file, const std::string& text);

  int core_;
  std::filesystem::path instance_;
  std::string why_not_;
};

}  // namespace wasp::scheduling
