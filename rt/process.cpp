#include "rt/process.h"

#include <fcntl.h>
#include <malloc.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>

namespace wasp::rt {
namespace {

bool fifo_permitted(int priority) {
  rlimit limit{};
  getrlimit(RLIMIT_RTPRIO, &limit);
  if (limit.rlim_cur >= static_cast<rlim_t>(priority)) return true;
  sched_param before{}, wanted{};
  const int policy = sched_getscheduler(0);
  sched_getparam(0, &before);
  wanted.sched_priority = priority;
  if (sched_setscheduler(0, SCHED_FIFO, &wanted) != 0) return false;
  sched_setscheduler(0, policy, &before);
  return true;
}

/// What a locked process will need: all it has mapped (mlockall counts every page) and room to grow.
std::size_t memlock_needed_bytes() {
  constexpr std::size_t kRoom = std::size_t{64} << 20;
  std::ifstream file("/proc/self/statm");
  std::size_t pages = 0;
  file >> pages;
  return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) + kRoom;
}

/// Locks a mapping of its own that is never touched. mlockall and munlockall would prove the same, and leave a process
/// that was locked before unlocked.
bool memlock_permitted(std::size_t bytes) {
  void* p = mmap(nullptr, bytes, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (p == MAP_FAILED) return false;
  const bool permitted = mlock2(p, bytes, MLOCK_ONFAULT) == 0;
  munmap(p, bytes);
  return permitted;
}

bool memory_is_locked = false;  // what may be locked has been; trying once more would fill a mapping with pages

constexpr double kLeastRealTimeShare = 0.5;  // of every period: less, and the kernel stops threads in mid-flight

/// What the kernel grants all SCHED_FIFO threads of a core, "1000 of every 1000000 us", if that is too little for a
/// flight; sched(7), sched_rt_runtime_us.
std::string real_time_budget_short() {
  long runtime_us = 0, period_us = 0;
  if (!(std::ifstream("/proc/sys/kernel/sched_rt_runtime_us") >> runtime_us) ||
      !(std::ifstream("/proc/sys/kernel/sched_rt_period_us") >> period_us))
    return {};
  if (runtime_us < 0 || static_cast<double>(runtime_us) >= kLeastRealTimeShare * static_cast<double>(period_us))
    return {};
  return std::to_string(runtime_us) + " of every " + std::to_string(period_us) + " us";
}

}  // namespace

std::string grant_command() {
  std::array<char, 4096> path{};
  const ssize_t n = readlink("/proc/self/exe", path.data(), path.size() - 1);
  return std::string("sudo setcap cap_sys_nice,cap_ipc_lock=ep ") + (n > 0 ? path.data() : "the program");
}

std::vector<MissingRight> missing_rights(int priority) {
  std::vector<MissingRight> missing;
  if (!fifo_permitted(priority))
    missing.push_back(
        {"SCHED_FIFO priority " + std::to_string(priority) + " (CAP_SYS_NICE or rtprio limit)", grant_command()});
  if (const std::string budget = real_time_budget_short(); !budget.empty())
    missing.push_back({"real-time budget (the kernel grants SCHED_FIFO threads " + budget + ")",
                       "sudo sysctl kernel.sched_rt_runtime_us=950000"});
  const std::size_t needed_bytes = memlock_needed_bytes();
  if (!memory_is_locked && !memlock_permitted(needed_bytes))
    missing.push_back(
        {"locked memory (CAP_IPC_LOCK or memlock limit, " + std::to_string(needed_bytes >> 20) + " MiB needed)",
         grant_command() + ", or 'ulimit -l unlimited'"});
  return missing;
}

std::string lock_memory(std::size_t heap_bytes) {
  mallopt(M_TRIM_THRESHOLD, -1);  // never give memory back
  mallopt(M_MMAP_MAX, 0);         // never mmap single allocations
  mallopt(M_ARENA_MAX, 1);        // one arena, prefaulted below
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) return std::string("mlockall: ") + std::strerror(errno);
  memory_is_locked = true;
  auto* heap = static_cast<volatile char*>(std::malloc(heap_bytes));
  if (heap == nullptr) return "prefault: heap of " + std::to_string(heap_bytes) + " bytes not available";
  for (std::size_t i = 0; i < heap_bytes; i += 4096) heap[i] = 0;
  std::free(const_cast<char*>(heap));
  return {};
}

CpuLatencyHold::CpuLatencyHold() : fd_(open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC)) {
  const std::int32_t zero_us = 0;
  if (fd_ >= 0 && write(fd_, &zero_us, sizeof zero_us) != sizeof zero_us) {
    close(fd_);
    fd_ = -1;
  }
}

CpuLatencyHold::~CpuLatencyHold() {
  if (fd_ >= 0) close(fd_);
}

bool kernel_is_preempt_rt() {
  std::ifstream file("/sys/kernel/realtime");
  int flag = 0;
  if (file >> flag) return flag == 1;
  utsname u{};
  return uname(&u) == 0 && std::strstr(u.version, "PREEMPT_RT") != nullptr;
}

std::string kernel_description() {
  utsname u{};
  uname(&u);
  const char* model = kernel_is_preempt_rt()                      ? "PREEMPT_RT"
                      : std::strstr(u.version, "PREEMPT_DYNAMIC") ? "PREEMPT_DYNAMIC"
                      : std::strstr(u.version, "PREEMPT")         ? "PREEMPT"
                                                                  : "no kernel preemption";
  return std::string(u.release) + " " + u.machine + " " + model;
}

std::string host_description() {
  std::ifstream file("/proc/cpuinfo");
  std::string line, model = "unknown processor";
  while (std::getline(file, line))
    if (line.starts_with("model name")) {
      model = line.substr(line.find(':') + 2);
      break;
    }
  return model + ", " + std::to_string(sysconf(_SC_NPROCESSORS_ONLN)) + " cores";
}

}  // namespace wasp::rt
