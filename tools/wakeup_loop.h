// A timerlat-like loop of our own: absolute sleeps on a grid, every wake-up kept with its instant. It does nothing
// else, so what it sees is the kernel's and the host's.
#pragma once

#include <atomic>
#include <vector>

#include "rt/thread.h"
#include "tools/wakeups.h"

namespace wasp::tools {

struct WakeupSpec {
  int core = 0;
  int priority = 0;  ///< SCHED_FIFO; 0: SCHED_OTHER
  DurationNs period_ns = kMillisecond;
  TimeNs first_due_ns = 0;
  std::size_t capacity = 0;  ///< wake-ups it has room for; it ends when they are used up
};

class WakeupLoop {
 public:
  /// Throws std::system_error naming the missing right.
  explicit WakeupLoop(const WakeupSpec& spec);
  ~WakeupLoop();
  WakeupLoop(const WakeupLoop&) = delete;
  WakeupLoop& operator=(const WakeupLoop&) = delete;

  /// Ends the loop within a period and returns what it saw.
  std::vector<Wakeup> finish();

 private:
  void run(const WakeupSpec& spec);

  std::atomic<bool> stop_{false};
  std::vector<Wakeup> wakeups_;
  std::size_t count_ = 0;
  rt::Thread thread_;
};

/// Keeps this process' pages in memory if that is permitted; for measuring programs, before their loops start.
void lock_what_is_mapped();

}  // namespace wasp::tools
