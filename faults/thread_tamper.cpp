#include "faults/thread_tamper.h"

#include <sys/ptrace.h>
#include <sys/wait.h>

#include "rt/clock.h"

namespace wasp::faults {

ThreadStop::ThreadStop(pid_t tid) : tracer_([this, tid] { run(tid); }) {
  while (state_.load() == 0) rt::sleep_until(rt::now() + 100 * kMicrosecond);
}

ThreadStop::~ThreadStop() {
  let_go_ = true;
  tracer_.join();
}

void ThreadStop::run(pid_t tid) {
  int status = 0;
  const bool seized = tid > 0 && ptrace(PTRACE_SEIZE, tid, nullptr, nullptr) == 0 &&
                      ptrace(PTRACE_INTERRUPT, tid, nullptr, nullptr) == 0 && waitpid(tid, &status, __WALL) == tid &&
                      WIFSTOPPED(status);
  state_ = seized ? 1 : -1;
  while (seized && !let_go_.load()) {
    const pid_t changed = waitpid(tid, &status, __WALL | WNOHANG);
    if (changed == tid && (WIFEXITED(status) || WIFSIGNALED(status))) return;
    if (changed < 0) return;
    rt::sleep_until(rt::now() + kMillisecond);
  }
  if (seized) ptrace(PTRACE_DETACH, tid, nullptr, nullptr);
}

SchedulingTheft::SchedulingTheft(pid_t tid) : tid_(tid), policy_(sched_getscheduler(tid)) {
  sched_getparam(tid, &priority_);
  sched_getaffinity(tid, sizeof cores_, &cores_);
}

SchedulingTheft::~SchedulingTheft() {
  sched_setaffinity(tid_, sizeof cores_, &cores_);
  sched_setscheduler(tid_, policy_, &priority_);
}

bool SchedulingTheft::policy(int policy, int priority) const {
  const sched_param p{.sched_priority = priority};
  return sched_setscheduler(tid_, policy, &p) == 0;
}

bool SchedulingTheft::core(int core) const {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(static_cast<std::size_t>(core), &set);
  return sched_setaffinity(tid_, sizeof set, &set) == 0;
}

Hog::Hog(int priority, int core)
    : thread_({.name = "hog", .policy = rt::Policy::kFifo, .priority = priority, .core = core}, [this] {
        const TimeNs end_ns = rt::now() + 10 * kSecond;
        while (!stop_.load(std::memory_order_relaxed) && rt::now() < end_ns) {
        }
      }) {}

}  // namespace wasp::faults
