#include "rt/syscall_filter.h"

#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>

namespace wasp::rt {
namespace {

constexpr long kAllowed[] = {
    SYS_futex,
    SYS_futex_waitv,
    SYS_clock_nanosleep,
    SYS_clock_gettime,
    SYS_read,
    SYS_write,
    SYS_ppoll,
    SYS_ioctl,
    // a line that is a socket
    SYS_recvfrom,
    SYS_sendto,
    SYS_connect,
    SYS_getrusage,
#ifdef SYS_poll
    SYS_poll,
#endif
#ifdef SYS_open
    SYS_open,
#endif
    // reopening a lost line, and leaving: the C library's own work at thread exit
    SYS_openat,
    SYS_close,
    SYS_dup3,
    SYS_fcntl,
    SYS_socket,
    SYS_bind,
    SYS_setsockopt,
    SYS_getsockopt,
    SYS_exit,
    SYS_exit_group,
    SYS_munmap,
    SYS_madvise,
    SYS_rt_sigprocmask,
    SYS_rt_sigreturn,
    SYS_set_robust_list,
    SYS_restart_syscall,
    SYS_gettid,
    SYS_tgkill,
    SYS_getpid,
};

/// The bus guard's only: a page of zeros in the place of one that was lost (shm/bus_guard.h).
constexpr std::uint32_t kGuardsMmap = MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED;

}  // namespace

bool restrict_thread_syscalls() {
  std::array<sock_filter, 2 * std::size(kAllowed) + 7> program;
  std::size_t n = 0;
  program[n++] = BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<unsigned>(offsetof(seccomp_data, nr)));
  for (const long number : kAllowed) {
    program[n++] = BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<unsigned>(number), 0, 1);
    program[n++] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
  }
  program[n++] = BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<unsigned>(SYS_mmap), 1, 0);
  program[n++] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS);
  program[n++] = BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<unsigned>(offsetof(seccomp_data, args[3])));
  program[n++] = BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kGuardsMmap, 0, 1);
  program[n++] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
  program[n++] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS);
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
}

}  // namespace wasp::rt
