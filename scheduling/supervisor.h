// The ordinary thread's eye on the real-time threads: writes an incident for a miss, takes a behaviour that does not
// keep to its budget out of SCHED_FIFO before it can starve the others, sees whose schedule was changed from outside,
// and tells the log what was refused or lost. It never waits for a real-time thread, and none waits for it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "scheduling/burst_report.h"
#include "scheduling/incident_folder.h"
#include "scheduling/schedule_watch.h"
#include "scheduling/stage_table.h"
#include "scheduling/switch_trace.h"
#include "scheduling/thread_watch.h"

namespace wasp::scheduling {

struct SupervisorOptions {
  std::string instance;
  bool real_time = true;
  int demote_after = 10;  ///< steps over budget in a row, or one step that takes as long as so many budgets; 0: never
  int incidents = 8;
  std::string incident_dir = "incidents";
  bool trace_switches = true;
  std::string tracefs;
};

class Supervisor {
 public:
  /// A look this often is enough: a runaway behaviour must be demoted before the kernel throttles all real-time threads
  /// of its core (950 ms by default).
  static constexpr DurationNs kPeriod = 50 * kMillisecond;

  /// Misses of a thread that follow its incident within this time belong to it: one stall, one file.
  static constexpr DurationNs kSameIncident = 500 * kMillisecond;

  /// `board` holds all threads, the control thread by the name "control". `log` is called by look() only.
  Supervisor(WatchBoard& board, RunStatus& status, SupervisorOptions options,
             std::function<void(const std::string&)> log);
  /// Once every kPeriod. Ordinary thread.
  void look();

 private:
  /// A thread under watch.
  struct Subject {
    ThreadWatch* watch = nullptr;
    std::optional<ThreadCounts> before = {}, within = {};  ///< at the last look; since then
    TimeNs busy_since_ns = 0;                              ///< at the last look
    bool missed = false;
    Miss miss = {};                  ///< the first one since the last look
    std::uint64_t more = 0;          ///< after it, since the last look
    TimeNs incident_at_ns = kNever;  ///< of its last file
    std::uint64_t followed = 0;      ///< misses that belong to that file
    std::optional<ScheduleWatch> schedule = {};
  };
  void count();
  static bool take_misses(Subject& subject);
  void report();
  void write(Subject& subject);
  [[nodiscard]] Incident gather(const Subject& subject) const;
  void hush();
  void demote_if_runaway(Subject& subject);
  void look_for_lost_pages();

  WatchBoard& board_;
  RunStatus& status_;
  SupervisorOptions options_;
  std::function<void(const std::string&)> log_;
  IncidentFolder folder_;
  std::unique_ptr<SwitchTrace> trace_;
  std::string trace_why_not_;
  std::vector<Subject> subjects_;
  std::vector<BurstReport> bursts_;
  std::uint64_t lost_pages_ = 0;
  std::vector<KernelEvent> kernel_events_;
  std::optional<CoreCounts> core_before_, core_within_;
  int core_ = -1;
  TimeNs looked_at_ns_ = 0;
  DurationNs window_ns_ = 0;
};

}  // namespace wasp::scheduling
