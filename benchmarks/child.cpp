#include "benchmarks/child.h"

#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "rt/clock.h"
#include "rt/process.h"
#include "rt/thread.h"

namespace wasp::bench {
namespace {

constexpr int kPriority = 80;
std::atomic<bool> stop_requested{false};

bool fifo_permitted() {
  for (const auto& missing : rt::missing_rights(kPriority))
    if (missing.right.find("SCHED_FIFO") != std::string::npos) return false;
  return true;
}

void become(int core, bool fifo) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(core, &set);
  sched_setaffinity(0, sizeof set, &set);
  sched_param param{};
  param.sched_priority = kPriority;
  if (fifo) sched_setscheduler(0, SCHED_FIFO, &param);
  if (fifo) mlockall(MCL_CURRENT | MCL_FUTURE);
}

}  // namespace

std::string Placement::description() const {
  return "writer on core " + std::to_string(writer_core) + ", reader on core " + std::to_string(reader_core) +
         (two_cores ? "" : " (one core: the figures show time slices)") +
         (fifo ? ", SCHED_FIFO 80, memory locked" : ", SCHED_OTHER (no SCHED_FIFO)");
}

Placement choose_placement() {
  Placement p;
  p.writer_core = rt::nearest_usable_core(0);
  p.reader_core = rt::nearest_usable_core(CPU_SETSIZE);  // the last one
  p.two_cores = p.writer_core != p.reader_core;
  p.fifo = p.two_cores && fifo_permitted();
  return p;
}

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = [](int) { stop_requested = true; };
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaction(signal, &action, nullptr);
}
bool interrupted() { return stop_requested; }

pid_t start(int core, bool fifo, const std::function<int()>& body) {
  std::fflush(stdout);
  const pid_t parent = getpid(), pid = fork();
  if (pid != 0) return pid;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) ::signal(signal, SIG_DFL);
  int result = 1;
  try {
    become(core, fifo);
    result = body();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "wasp-bench: %s\n", e.what());
  }
  std::exit(result);
}

bool finish(pid_t pid, double seconds) {
  const TimeNs deadline = rt::now() + from_seconds(seconds);
  int status = 0;
  while (waitpid(pid, &status, WNOHANG) == 0) {
    if (interrupted() || rt::now() > deadline) kill(pid, SIGKILL);
    rt::sleep_until(rt::now() + 2 * kMillisecond);
  }
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace wasp::bench
