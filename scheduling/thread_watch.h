// What a real-time thread shows to the supervisor, an ordinary thread: its last timing events, its misses, what it is
// busy with. All of it is written wait-free; nothing comes back to the real-time thread.
#pragma once

#include <unistd.h>

#include <deque>
#include <string>

#include "rt/clock.h"
#include "rt/spsc_queue.h"
#include "rt/thread_usage.h"
#include "rt/trace_ring.h"

namespace wasp::scheduling {

enum class MissKind : std::uint32_t {
  kSkipped,     ///< releases fell due while the thread was busy or kept waiting, and were passed over
  kLate,        ///< last byte after the deadline
  kNotWritten,  ///< the serial line did not take the setpoint whole
  kOverBudget,  ///< a behaviour's step took longer than its budget
  kRefused,     ///< the command was too old when it was to go out
};

/// One miss, as its thread saw it. Times are CLOCK_MONOTONIC; 0: did not happen.
struct Miss {
  MissKind kind = MissKind::kLate;
  std::uint64_t number = 0;  ///< control tick, or frame sequence
  TimeNs due_at_ns = 0;      ///< intended release (of a frame: published)
  TimeNs released_at_ns = 0, computed_at_ns = 0, written_at_ns = 0;
  DurationNs late_ns = 0;     ///< what is held against limit_ns: since the intended release, or of the step
  DurationNs limit_ns = 0;    ///< deadline or budget
  std::uint64_t skipped = 0;  ///< releases passed over before this one
  rt::ThreadUsage usage;      ///< switches and faults since the thread's previous tick or frame ended
};

/// The thread table's word on it.
struct WatchedThread {
  std::string name;
  int core = -1, priority = 0;
  DurationNs budget_ns = 0;
  bool behaviour = false;  ///< may be demoted
};

/// One a real-time thread; made before arming.
class ThreadWatch {
 public:
  ThreadWatch(const WatchedThread& row, std::atomic<std::uint32_t>& frozen)
      : name(row.name),
        core(row.core),
        priority(row.priority),
        budget_ns(row.budget_ns),
        behaviour(row.behaviour),
        trace(frozen),
        frozen_(frozen) {}

  const std::string name;
  const int core, priority;
  const DurationNs budget_ns;
  const bool behaviour;
  std::atomic<int> tid{0};  ///< 0 until the thread runs
  rt::TraceRing trace;
  rt::SpscQueue<Miss, 16> misses;
  std::atomic<std::uint64_t> misses_unreported{0};  ///< found the queue full, or came after `quiet`
  std::atomic<TimeNs> busy_since_ns{0};             ///< start of the step under way; 0: none
  std::atomic<std::uint32_t> overruns_in_row{0};    ///< steps over budget, one after the other
  std::atomic<std::uint32_t> quiet{0};              ///< 1: no more reports wanted; written by the supervisor
  std::atomic<std::uint32_t> demoted{0};            ///< 1: no longer a real-time thread; written by the supervisor
  std::atomic<std::uint32_t> stolen{0};             ///< 1: policy, priority or cores are not the table's; likewise

  /// On the thread itself, first of all. Realtime-safe: no.
  void attach() {
    tid.store(gettid());
    usage_ = rt::thread_usage();
  }
  /// Freezes every thread's trace and leaves a note, unless the supervisor wants no more. Own thread only.
  /// Realtime-safe: yes.
  void report(const Miss& miss) WASP_REALTIME {
    if (quiet.load(std::memory_order_relaxed) != 0 || !misses.push(miss)) {
      misses_unreported.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    frozen_.store(1, std::memory_order_release);
  }
  /// Switches and faults since the last call. Own thread only. Realtime-safe: yes (getrusage).
  rt::ThreadUsage take_usage() WASP_REALTIME {
    const rt::ThreadUsage now = rt::thread_usage(), before = usage_;
    usage_ = now;
    return now - before;
  }
  /// True while the step under way has taken longer than the budget. Any thread. Realtime-safe: yes.
  [[nodiscard]] bool overdue(TimeNs now_ns) const WASP_REALTIME {
    const TimeNs since_ns = busy_since_ns.load(std::memory_order_relaxed);
    return since_ns != 0 && now_ns - since_ns > budget_ns;
  }

 private:
  std::atomic<std::uint32_t>& frozen_;
  rt::ThreadUsage usage_;
};

/// All watches of a flight and the word that freezes their traces together.
struct WatchBoard {
  std::atomic<std::uint32_t> frozen{0};
  std::deque<ThreadWatch> threads;

  ThreadWatch& add(const WatchedThread& row) { return threads.emplace_back(row, frozen); }
};

}  // namespace wasp::scheduling
