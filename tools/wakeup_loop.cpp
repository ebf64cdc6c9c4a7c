#include "tools/wakeup_loop.h"

#include <sys/mman.h>

#include "rt/clock.h"
#include "rt/periodic.h"

namespace wasp::tools {

WakeupLoop::WakeupLoop(const WakeupSpec& spec)
    : wakeups_(spec.capacity),
      thread_({.name = "reference",
               .policy = spec.priority > 0 ? rt::Policy::kFifo : rt::Policy::kOther,
               .priority = spec.priority,
               .core = spec.core},
              [this, spec] { run(spec); }) {}

WakeupLoop::~WakeupLoop() { stop_ = true; }

std::vector<Wakeup> WakeupLoop::finish() {
  stop_ = true;
  thread_.join();
  wakeups_.resize(count_);
  return std::move(wakeups_);
}

void WakeupLoop::run(const WakeupSpec& spec) {
  rt::PeriodicGrid grid(spec.first_due_ns, spec.period_ns);
  while (!stop_.load(std::memory_order_relaxed) && count_ < wakeups_.size()) {
    const rt::Release r = rt::wait_next(grid);
    wakeups_[count_++] = {r.due_at_ns, r.released_at_ns - r.due_at_ns, kNever};
  }
}

void lock_what_is_mapped() { mlockall(MCL_CURRENT); }

}  // namespace wasp::tools
