#include "rt/thread.h"

#include "rt/process.h"

#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <future>
#include <memory>
#include <system_error>
#include <utility>

namespace wasp::rt {
namespace {

struct SchedAttr {  // linux/sched/types.h clashes with glibc 2.36
  std::uint32_t size, policy;
  std::uint64_t flags;
  std::int32_t nice;
  std::uint32_t priority;
  std::uint64_t runtime, deadline, period;
};
constexpr std::uint32_t kSchedDeadline = 6;

struct Start {
  ThreadSpec spec;
  std::function<void()> body;
  std::promise<int> started;  ///< errno of the set-up the thread does for itself
};

/// Touches every page of this thread's stack below the present frame. The kernel's word on where it ends, not the size
/// that was asked for: thread-local storage takes its share from the same memory.
[[gnu::noinline]] void prefault_stack() {
  pthread_attr_t attr;
  void* low = nullptr;
  std::size_t bytes = 0;
  if (pthread_getattr_np(pthread_self(), &attr) != 0) return;
  pthread_attr_getstack(&attr, &low, &bytes);
  pthread_attr_destroy(&attr);
  volatile char* const here = static_cast<char*>(__builtin_frame_address(0));
  for (volatile char* page = static_cast<char*>(low); page + 4096 < here; page += 4096) *page = 0;
}

/// 0, or the errno of sched_setattr.
int become_deadline(const ThreadSpec& s) {
  SchedAttr attr{sizeof(SchedAttr),
                 kSchedDeadline,
                 0,
                 0,
                 0,
                 static_cast<std::uint64_t>(s.runtime_ns),
                 static_cast<std::uint64_t>(s.deadline_ns),
                 static_cast<std::uint64_t>(s.period_ns)};
  return syscall(SYS_sched_setattr, 0, &attr, 0) == 0 ? 0 : errno;
}

void* run(void* argument) {
  const std::unique_ptr<Start> start(static_cast<Start*>(argument));
  pthread_setname_np(pthread_self(), start->spec.name.substr(0, 15).c_str());
  prefault_stack();
  const int error = start->spec.policy == Policy::kDeadline ? become_deadline(start->spec) : 0;
  start->started.set_value(error);
  if (error == 0) start->body();
  return nullptr;
}

/// Puts the spec into pthread attributes; returns an error number. The policy is always explicit: a thread that asks
/// for kOther must not inherit its creator's SCHED_FIFO.
int describe(const ThreadSpec& spec, pthread_attr_t& attr) {
  if (const int error = pthread_attr_setstacksize(&attr, spec.stack_bytes); error != 0) return error;
  if (spec.core >= 0) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(spec.core, &set);
    pthread_attr_setaffinity_np(&attr, sizeof set, &set);
  }
  const bool fifo = spec.policy == Policy::kFifo;
  sched_param param{};
  param.sched_priority = fifo ? spec.priority : 0;
  pthread_attr_setinheritsched(&attr, PTHREAD_EXPLICIT_SCHED);
  pthread_attr_setschedpolicy(&attr, fifo ? SCHED_FIFO : SCHED_OTHER);
  return pthread_attr_setschedparam(&attr, &param);
}

[[noreturn]] void fail(int error, const ThreadSpec& spec) {
  std::string what = "thread '" + spec.name + "': ";
  if (spec.policy == Policy::kDeadline && error != EAGAIN) {
    what += "SCHED_DEADLINE with runtime " + std::to_string(spec.runtime_ns) + " ns, deadline " +
            std::to_string(spec.deadline_ns) + " ns, period " + std::to_string(spec.period_ns) + " ns, core " +
            std::to_string(spec.core) +
            (error == EPERM ? " is not permitted; it needs CAP_SYS_NICE and core -1 (it admits no pinning)"
                            : " is not admitted (runtime <= deadline <= period, and the cores' capacity)");
  } else if (error == EPERM) {
    what += "SCHED_FIFO priority " + std::to_string(spec.priority) +
            " is not permitted; grant CAP_SYS_NICE (" + grant_command() + ") or an rtprio "
            "limit (/etc/security/limits.d: '@realtime - rtprio 95')";
  } else if (error == EINVAL) {
    what += "core " + std::to_string(spec.core) + ", priority " + std::to_string(spec.priority) + " or a stack of " +
            std::to_string(spec.stack_bytes) + " bytes does not exist";
  } else {
    what += "cannot start";
  }
  throw std::system_error(error, std::generic_category(), what);
}

}  // namespace

Thread::Thread(ThreadSpec spec, std::function<void()> body) {
  auto start = std::make_unique<Start>(Start{spec, std::move(body), {}});
  std::future<int> started = start->started.get_future();
  pthread_attr_t attr;
  pthread_attr_init(&attr);
  int error = describe(spec, attr);
  if (error == 0) error = pthread_create(&handle_, &attr, run, start.get());
  pthread_attr_destroy(&attr);
  if (error != 0) fail(error, spec);
  static_cast<void>(start.release());  // now owned by the thread
  running_ = true;
  error = started.get();
  if (error == 0) return;
  join();
  fail(error, spec);
}

Thread::~Thread() { join(); }

Thread::Thread(Thread&& other) noexcept : handle_(other.handle_), running_(std::exchange(other.running_, false)) {}

Thread& Thread::operator=(Thread&& other) noexcept {
  if (this != &other) {
    join();
    handle_ = other.handle_;
    running_ = std::exchange(other.running_, false);
  }
  return *this;
}

void Thread::join() {
  if (running_) pthread_join(handle_, nullptr);
  running_ = false;
}

int usable_cores() {
  cpu_set_t set;
  CPU_ZERO(&set);
  return sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
}

int nearest_usable_core(int core) {
  cpu_set_t set;
  CPU_ZERO(&set);
  if (core < 0 || sched_getaffinity(0, sizeof set, &set) != 0) return core;
  if (core < CPU_SETSIZE && CPU_ISSET(core, &set)) return core;
  for (int c = CPU_SETSIZE - 1; c >= 0; --c)
    if (CPU_ISSET(c, &set)) return c;
  return core;
}

}  // namespace wasp::rt
