// Faults of the process itself, done for real. Ordinary thread.
#pragma once

#include <sys/resource.h>

#include <vector>

#include "scheduling/fault_points.h"

namespace wasp::scheduling {

/// SIGABRT or SIGSEGV, by what raises them in life. Does not return for kProcessAbort and kProcessSegv.
void end_process(FaultPoint point);

/// Holds all file descriptors of the process but a few. The soft limit comes down first, so that a process that may
/// have a million of them need not open a million.
class DescriptorHoard {
 public:
  DescriptorHoard() = default;
  ~DescriptorHoard() { release(); }
  DescriptorHoard(const DescriptorHoard&) = delete;
  DescriptorHoard& operator=(const DescriptorHoard&) = delete;

  void take_all_but(std::size_t left);
  void release();

 private:
  std::vector<int> held_;
  rlimit before_{};
  bool lowered_ = false;
};

}  // namespace wasp::scheduling
