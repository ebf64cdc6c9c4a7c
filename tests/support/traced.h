// A child that its parent steps through its work, instruction by instruction or system call by system call (ptrace).
#pragma once

#include <sys/ptrace.h>
#include <sys/user.h>

#include <cstdint>
#include <cstdio>
#include <string>

#include "tests/support/child.h"

namespace wasp::test {

/// A child that runs `prepare`, stops, and runs `work` under the eyes of its parent.
class Traced {
 public:
  template <class Prepare, class Work>
  Traced(Prepare&& prepare, Work&& work)
      : pid_(start_child([&] {
          auto kept = prepare();
          if (ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) != 0) return 1;
          raise(0);  // sends nothing, but is found: no step is the dynamic linker's
          trap();
          work(kept);
          raise(SIGUSR1);
          return 0;
        })),
        status_(wait_for(pid_)) {
    if (permitted()) ptrace(PTRACE_SETOPTIONS, pid_, nullptr, PTRACE_O_TRACESYSGOOD);
  }
  Traced(const Traced&) = delete;
  Traced& operator=(const Traced&) = delete;
  /// SIGKILL, wherever it stands.
  ~Traced() {
    kill(pid_, SIGKILL);
    while (!WIFSIGNALED(status_) && !WIFEXITED(status_)) status_ = wait_for(pid_);
  }

  [[nodiscard]] bool permitted() const { return WIFSTOPPED(status_); }
  [[nodiscard]] bool finished() const { return !WIFSTOPPED(status_) || WSTOPSIG(status_) == SIGUSR1; }
  void step_instructions(std::uint64_t n) {
    for (std::uint64_t i = 0; i < n && !finished(); ++i) go(PTRACE_SINGLESTEP);
  }
  /// Lets it run on its own until it sleeps in the kernel, or ends; false if it does neither in a long time.
  bool run_until_asleep() {
    ptrace(PTRACE_CONT, pid_, nullptr, nullptr);
    return eventually([this] {
      if (waitpid(pid_, &status_, WNOHANG) == pid_) return true;
      char state = 0;
      if (std::FILE* stat = std::fopen(("/proc/" + std::to_string(pid_) + "/stat").c_str(), "r")) {
        if (std::fscanf(stat, "%*d (%*[^)]) %c", &state) != 1) state = 0;
        std::fclose(stat);
      }
      return state == 'S';
    });
  }
  /// To the end of its work.
  void run_to_the_end() {
    while (!finished()) go(PTRACE_CONT);
  }
  /// Number of the system call that the next instruction makes; -1: it makes none.
  [[nodiscard]] long next_system_call() const {
#if defined(__x86_64__)
    user_regs_struct registers{};
    ptrace(PTRACE_GETREGS, pid_, nullptr, &registers);
    const bool enters = (ptrace(PTRACE_PEEKTEXT, pid_, registers.rip, nullptr) & 0xFFFF) == 0x050F;
    return enters ? static_cast<long>(registers.rax) : -1;
#else
    return -1;
#endif
  }
  /// To the n-th entry into or return from the kernel.
  void step_system_calls(std::uint64_t n) {
    for (std::uint64_t i = 0; i < n && !finished(); ++i) go(PTRACE_SYSCALL);
  }

 private:
  /// Stops here and not in some library: the first step is the first of the work.
  static void trap() {
#if defined(__x86_64__)
    asm volatile("int3");
#else
    raise(SIGTRAP);
#endif
  }
  void go(decltype(PTRACE_SINGLESTEP) how) {
    ptrace(how, pid_, nullptr, nullptr);
    status_ = wait_for(pid_);
  }
  pid_t pid_;
  int status_;
};

}  // namespace wasp::test
