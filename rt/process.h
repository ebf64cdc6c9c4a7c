// What a process does once, before arming, to deserve real time: lock its memory, prefault its heap, keep the processor
// out of deep sleep. Each step reports what was refused and how to grant it instead of going on in silence.
#pragma once

#include <string>
#include <vector>

namespace wasp::rt {

/// A right the process lacks, and the command that grants it.
struct MissingRight {
  std::string right;
  std::string remedy;
};

/// The command that grants this program SCHED_FIFO and locked memory.
std::string grant_command();

/// Checks, without changing anything that lasts: SCHED_FIFO at `priority`, a budget for it (sched_rt_runtime_us), and
/// enough memlock for a locked process.
std::vector<MissingRight> missing_rights(int priority);

/// mlockall(current and future), malloc tuned to keep what it has, and a prefaulted heap. Empty on success, else why.
std::string lock_memory(std::size_t heap_bytes);

/// Holds /dev/cpu_dma_latency at 0 us while alive. `held()` is false where the file is absent or refused.
class CpuLatencyHold {
 public:
  CpuLatencyHold();
  ~CpuLatencyHold();
  CpuLatencyHold(const CpuLatencyHold&) = delete;
  CpuLatencyHold& operator=(const CpuLatencyHold&) = delete;
  [[nodiscard]] bool held() const noexcept { return fd_ >= 0; }

 private:
  int fd_ = -1;
};

/// Kernel release and preemption model, from uname and what the kernel says of itself:
/// "6.1.0-rt amd64 PREEMPT_RT". For reports.
std::string kernel_description();
bool kernel_is_preempt_rt();
/// Processor model and core count, for reports.
std::string host_description();

}  // namespace wasp::rt
