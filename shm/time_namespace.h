// CLOCK_MONOTONIC across processes: one in another time namespace (`unshare --time`, some containers) reads another
// number at the same instant, so its stamps mean nothing here.
#pragma once

#include <sys/types.h>

#include <string>

namespace wasp::shm {

/// Empty when process `pid` reads the same CLOCK_MONOTONIC as this one, or nobody can tell (it is gone, or the kernel
/// has no time namespaces); else by how much it differs.
std::string foreign_clock(pid_t pid);

}  // namespace wasp::shm
