// Child processes for tests that kill, stop and starve them. A child dies with its parent, and leaves by _exit, so that
// no GoogleTest state is torn down twice.
#pragma once

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <exception>
#include <string>
#include <thread>
#include <utility>

namespace wasp::test {

inline constexpr int kChildThrew = 99;

/// Runs `int body()` in a child; returns its process number.
template <class Body>
pid_t start_child(Body&& body) {
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid != 0) return pid;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kChildThrew);
  int result = kChildThrew;
  try {
    result = body();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "child: %s\n", e.what());
  }
  _exit(result);
}

/// Waits for the end of a child; the raw status.
inline int wait_for(pid_t pid) {
  int status = 0;
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

inline int kill_and_wait(pid_t pid, int signal = SIGKILL) {
  kill(pid, signal);
  return wait_for(pid);
}

/// Polls until `condition()`; gives up after a time no healthy machine needs.
template <class Condition>
bool eventually(Condition&& condition, int seconds = 60) {
  for (int i = 0; i < seconds * 1000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return condition();
}

/// A region name no other test uses.
inline std::string unique_name(const std::string& stem) {
  static int count = 0;
  return "wasp.test." + std::to_string(getpid()) + "." + std::to_string(++count) + "." + stem;
}

}  // namespace wasp::test
