// A thread with a stated policy, priority, core and prefaulted stack. Where a right is missing it says which.
#pragma once

#include <pthread.h>

#include <functional>
#include <string>

#include "types/time.h"

namespace wasp::rt {

enum class Policy { kOther, kFifo, kDeadline };

struct ThreadSpec {
  std::string name;  ///< at most 15 characters reach the kernel
  Policy policy = Policy::kOther;
  int priority = 0;  ///< 1 ... 99 for kFifo
  int core = -1;     ///< -1: any
  std::size_t stack_bytes = 512 * 1024;
  DurationNs runtime_ns = 0, deadline_ns = 0, period_ns = 0;  ///< kDeadline only
};

/// Starts at once; joins on destruction. Throws std::system_error naming the thread, the right that is missing and how
/// to grant it. The body runs after the stack is prefaulted. Realtime-safe: no (start-up only).
class Thread {
 public:
  Thread() = default;
  Thread(ThreadSpec spec, std::function<void()> body);
  ~Thread();
  Thread(Thread&& other) noexcept;
  Thread& operator=(Thread&& other) noexcept;

  void join();
  [[nodiscard]] bool joinable() const noexcept { return running_; }

 private:
  pthread_t handle_{};
  bool running_ = false;
};

/// Number of cores this process may run on.
int usable_cores();
/// `core` if this process may run on it, else the last core it may (a one-core machine runs everything on core 0).
int nearest_usable_core(int core);

}  // namespace wasp::rt
