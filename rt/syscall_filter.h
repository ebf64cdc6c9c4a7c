// The list of system calls a real-time thread may make after arming, enforced by the kernel (seccomp) when asked: any
// other call ends the process with SIGSYS. Proof, not protection: the tests run the flight with it.
#pragma once

namespace wasp::rt {

/// Restricts the calling thread, for good, to: futex, clock_nanosleep, clock_gettime, read, write, ppoll/poll,
/// ioctl, getrusage, openat/close/dup3 (reopening a lost serial line), what a
/// thread needs to end, and the mmap of one anonymous page in the place of another (shm/bus_guard.h). False if the
/// kernel refused.
bool restrict_thread_syscalls();

}  // namespace wasp::rt
