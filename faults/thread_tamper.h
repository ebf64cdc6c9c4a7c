// What a stranger with rights can do to a thread of another process.
#pragma once

#include <sched.h>
#include <sys/types.h>

#include <atomic>
#include <thread>

#include "rt/thread.h"

namespace wasp::faults {

/// A thread stands still, as under a debugger, while this lives; its process goes on. If it is killed meanwhile, its
/// death is passed on at once. A tracer that dies lets it go.
class ThreadStop {
 public:
  explicit ThreadStop(pid_t tid);
  ~ThreadStop();
  ThreadStop(const ThreadStop&) = delete;
  ThreadStop& operator=(const ThreadStop&) = delete;
  [[nodiscard]] bool stopped() const { return state_.load() == 1; }

 private:
  void run(pid_t tid);
  std::atomic<int> state_{0};  ///< 1: it stands, -1: it could not be stopped
  std::atomic<bool> let_go_{false};
  std::thread tracer_;  ///< all ptrace calls must come from one thread
};

/// Policy, priority and core of a thread as they were, put back on destruction where the thread still lives.
class SchedulingTheft {
 public:
  explicit SchedulingTheft(pid_t tid);
  ~SchedulingTheft();
  SchedulingTheft(const SchedulingTheft&) = delete;
  SchedulingTheft& operator=(const SchedulingTheft&) = delete;
  bool policy(int policy, int priority) const;
  bool core(int core) const;

 private:
  pid_t tid_;
  int policy_ = 0;
  sched_param priority_{};
  cpu_set_t cores_{};
};

/// A SCHED_FIFO thread that does nothing else than run, for at most ten seconds.
class Hog {
 public:
  /// Throws std::system_error without the right.
  Hog(int priority, int core);
  ~Hog() { stop_ = true; }
  Hog(const Hog&) = delete;
  Hog& operator=(const Hog&) = delete;

 private:
  std::atomic<bool> stop_{false};
  rt::Thread thread_;  // joined first
};

}  // namespace wasp::faults
