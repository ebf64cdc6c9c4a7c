#include "scheduling/process_faults.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

namespace wasp::scheduling {
namespace {

constexpr rlim_t kEnough = 4096;  // open files a flight never needs

}  // namespace

void end_process(FaultPoint point) {
  if (point == FaultPoint::kProcessAbort) std::abort();
  if (point != FaultPoint::kProcessSegv) return;
  volatile std::uintptr_t nowhere = 16;  // read at run time: the compiler must not know better
  *reinterpret_cast<volatile int*>(nowhere) = 1;
}

void DescriptorHoard::take_all_but(std::size_t left) {
  release();
  lowered_ = getrlimit(RLIMIT_NOFILE, &before_) == 0 && before_.rlim_cur > kEnough;
  if (lowered_) {
    const rlimit lower{kEnough, before_.rlim_max};
    lowered_ = setrlimit(RLIMIT_NOFILE, &lower) == 0;
  }
  held_.reserve(kEnough);
  for (int fd; held_.size() < kEnough && (fd = open("/dev/null", O_RDONLY | O_CLOEXEC)) >= 0;) held_.push_back(fd);
  for (std::size_t i = 0; i < left && !held_.empty(); ++i) {
    close(held_.back());
    held_.pop_back();
  }
}

void DescriptorHoard::release() {
  for (const int fd : held_) close(fd);
  held_.clear();
  if (lowered_) setrlimit(RLIMIT_NOFILE, &before_);
  lowered_ = false;
}

}  // namespace wasp::scheduling
