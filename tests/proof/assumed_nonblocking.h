// Where the proof ends: the functions without a visible body that real-time code may call, each with the reason why it
// is taken to be nonblocking. Included ahead of every source in the proof (tests/proof/CMakeLists.txt), and nowhere
// else: a redeclaration gives the compiler the effect, and the flight code needs no wrapper. docs/contract.md explains.
#pragma once

#include <fftw3.h>
#include <nettle/sha2.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#define WASP_ASSUMED [[clang::nonblocking]]

extern "C" {

// vDSO: reads a page the kernel keeps; no system call on any clock source wasp accepts.
int clock_gettime(clockid_t, timespec*) noexcept WASP_ASSUMED;
int sched_getcpu() noexcept WASP_ASSUMED;

// The thread's own address of errno.
int* __errno_location() noexcept WASP_ASSUMED;

// Waits, which are what a real-time loop is made of: each has a deadline, and is where the loop means to sleep.
int clock_nanosleep(clockid_t, int, const timespec*, timespec*) WASP_ASSUMED;
int ppoll(pollfd*, nfds_t, const timespec*, const sigset_t*) WASP_ASSUMED;

// Only SYS_futex and SYS_futex_waitv are called by it: a wait with a deadline, or a wake. The system-call filter keeps
// it so at run time.
long syscall(long, ...) noexcept WASP_ASSUMED;

// The serial line, opened O_NONBLOCK: these return EAGAIN instead of waiting; poll is called with no patience.
ssize_t read(int, void*, size_t) WASP_ASSUMED;
ssize_t write(int, const void*, size_t) WASP_ASSUMED;
int poll(pollfd*, nfds_t, int) WASP_ASSUMED;
int ioctl(int, unsigned long, ...) noexcept WASP_ASSUMED;

// The same line where it is a socket, non-blocking as well; connect is called on datagram sockets alone, where it sets
// an address and sends nothing.
ssize_t recvfrom(int, void*, size_t, int, sockaddr*, socklen_t*) WASP_ASSUMED;
ssize_t send(int, const void*, size_t, int) WASP_ASSUMED;
int connect(int, const sockaddr*, socklen_t) WASP_ASSUMED;

// A system call without waiting: page faults of this thread, once a loop.
int getrusage(int, rusage*) noexcept WASP_ASSUMED;

// FFTW executes a plan made at start-up, without the heap as long as it has no buffered part (vision/kernels/fft.cpp
// plans without; tests/vision/fft_test.cpp counts). The planner, which allocates and locks, is not in this list.
void fftwf_execute(const fftwf_plan) WASP_ASSUMED;
void fftwf_execute_dft(const fftwf_plan, fftwf_complex*, fftwf_complex*) WASP_ASSUMED;

// SHA-256 of a signed line: arithmetic on a context of the caller's, no heap (nettle's sha256.c).
void nettle_sha256_init(sha256_ctx*) WASP_ASSUMED;
void nettle_sha256_update(sha256_ctx*, size_t, const uint8_t*) WASP_ASSUMED;
void nettle_sha256_digest(sha256_ctx*, size_t, uint8_t*) WASP_ASSUMED;

}  // extern "C"
