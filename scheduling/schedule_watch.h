// Holds a thread's policy, priority and cores against the thread table. Whoever has the rights can change them from
// outside (chrt, taskset, a cpuset, a core taken offline), and no call of the thread's own would fail.
#pragma once

#include <sched.h>

#include <functional>
#include <optional>
#include <string>

#include "scheduling/stage_table.h"
#include "scheduling/thread_watch.h"

namespace wasp::scheduling {

/// What the kernel says a thread runs under.
struct Schedule {
  int policy = SCHED_OTHER, priority = 0;
  cpu_set_t cores{};

  friend bool operator==(const Schedule& a, const Schedule& b) noexcept {
    return a.policy == b.policy && a.priority == b.priority && CPU_EQUAL(&a.cores, &b.cores);
  }
};

/// Empty if the thread is gone.
std::optional<Schedule> schedule_of(int tid);
/// "SCHED_FIFO 80 on core 1", "SCHED_OTHER on cores 0-3,6".
std::string describe(const Schedule& schedule);

/// One thread, watched by the supervisor. Ordinary thread.
class ScheduleWatch {
 public:
  /// A change is taken back this often; whoever insists wins, and is reported.
  static constexpr int kTakeBacks = 3;

  /// `real_time`: the table's policies are in force.
  ScheduleWatch(ThreadWatch& watch, bool real_time);
  /// Says, counts and takes back what has changed since the last look; notes in the watch whether all is as it must be.
  void look(RunStatus& status, const std::function<void(const std::string&)>& log);

 private:
  [[nodiscard]] Schedule wanted() const;
  std::string take_back(int tid, const Schedule& wanted);

  ThreadWatch* watch_;
  bool real_time_;
  cpu_set_t anywhere_{};  ///< the process' cores at the start: those of a thread without a core of its own
  std::optional<Schedule> told_;
  int taken_back_ = 0;
};

}  // namespace wasp::scheduling
