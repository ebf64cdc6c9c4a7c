// Rights, found out by using them: a thread with each policy, a locked heap in a child process, the sleep hold. Where
// this program is refused, the flight binary is asked: file capabilities may have been granted to it alone.
#include <fmt/format.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <fstream>
#include <system_error>

#include "rt/process.h"
#include "rt/thread.h"
#include "rt/thread_usage.h"
#include "tools/doctor_checks.h"
#include "tools/program_paths.h"

namespace wasp::tools {
namespace {

/// "" if a thread on `core` really runs as SCHED_FIFO `priority`, else why not.
std::string try_fifo(int priority, int core) {
  std::atomic<bool> as_asked{false};
  try {
    rt::Thread thread({.name = "doctor", .policy = rt::Policy::kFifo, .priority = priority, .core = core}, [&] {
      sched_param now{};
      as_asked = sched_getscheduler(0) == SCHED_FIFO && sched_getparam(0, &now) == 0 &&
                 now.sched_priority == priority && sched_getcpu() == core;
    });
    thread.join();
  } catch (const std::system_error& e) {
    return std::generic_category().message(e.code().value());
  }
  return as_asked ? "" : "granted, but the thread did not run as asked";
}

/// True if the flight binary says that it lacks nothing.
bool flight_binary_may() {
  const std::string command = "'" + program("wasp") + "' flight --check-rights >/dev/null 2>&1";
  const int status = std::system(command.c_str());
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

/// A control group of the first version with no real-time time refuses even root.
std::vector<std::string> cgroup_remedy(const SystemTree& tree) {
  for (const auto& line : words(tree.text("/proc/self/cgroup").value_or(""))) {
    const std::size_t name = line.find(":cpu");
    const std::size_t path = line.find(':', name == std::string::npos ? name : name + 1);
    if (name == std::string::npos || path == std::string::npos) continue;
    const std::string file = "/sys/fs/cgroup/cpu" + line.substr(path + 1) + "/cpu.rt_runtime_us";
    if (tree.number(file).value_or(1) == 0) return {"echo 900000 | sudo tee " + file};
  }
  return {};
}

/// What the child that locks memory found; plain bytes for a pipe.
struct LockOutcome {
  int error = 0;
  long long locked_kib = 0, faults = 0;
  std::array<char, 160> why{};
};

long long locked_kib() {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("VmLck:")) return std::stoll(line.substr(6));
  return 0;
}

/// In a child process: what it locks goes with it.
LockOutcome lock_in_child(int heap_mib) {
  LockOutcome outcome;
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) return {errno, 0, 0, {}};
  const pid_t pid = fork();
  if (pid == 0) {
    const std::string why = rt::lock_memory(static_cast<std::size_t>(heap_mib) << 20);
    outcome.error = why.empty() ? 0 : (errno != 0 ? errno : 1);
    fmt::format_to_n(outcome.why.data(), outcome.why.size() - 1, "{}", why);
    outcome.locked_kib = locked_kib();
    const auto before = rt::thread_usage();
    auto* heap = static_cast<volatile char*>(std::malloc(std::size_t{16} << 20));
    for (std::size_t i = 0; heap != nullptr && i < std::size_t{16} << 20; i += 4096) heap[i] = 1;
    outcome.faults = rt::thread_usage().minor_faults - before.minor_faults;
    const bool told = write(ends[1], &outcome, sizeof outcome) == sizeof outcome;
    _exit(told ? 0 : 1);
  }
  close(ends[1]);
  const bool heard = pid > 0 && read(ends[0], &outcome, sizeof outcome) == sizeof outcome;
  close(ends[0]);
  if (pid > 0) waitpid(pid, nullptr, 0);
  if (!heard) outcome.error = ECHILD;
  return outcome;
}

/// A right that this program lacks but the flight has is no fault of the machine.
void excuse(Check& c) {
  if (c.state != State::kFail || !flight_binary_may()) return;
  c.state = State::kOk;
  c.measured += "; but granted to the flight binary itself (file capabilities)";
  c.commands.clear();
}

}  // namespace

Check check_fifo(const DoctorPlan& plan) {
  Check c{"SCHED_FIFO", State::kOk, "", "without it any program may delay control for many milliseconds"};
  std::string refused, granted;
  for (const int priority : plan.priorities) {
    const std::string why = try_fifo(priority, plan.core);
    (why.empty() ? granted : refused) += fmt::format(" {}", priority);
    if (!why.empty()) c.measured = why;
  }
  c.figures = {{"core", plan.core}, {"refused", words(refused)}, {"granted", words(granted)}};
  if (refused.empty()) {
    c.measured = fmt::format("a thread on core {} ran at each of the flight's priorities:{}", plan.core, granted);
    return c;
  }
  c.state = State::kFail;
  c.measured = fmt::format("refused on core {} at priority{}: {}", plan.core, refused, c.measured);
  c.commands = cgroup_remedy(plan.tree);
  if (c.commands.empty()) c.commands = {setcap_command()};
  excuse(c);
  return c;
}

Check check_deadline_policy(const DoctorPlan&) {
  Check c{"SCHED_DEADLINE", State::kOk, "a thread ran with 1 ms in every 50 ms, deadline 10 ms",
          "the kernel's own guarantee of processor time; the flight does not need it"};
  try {
    rt::Thread thread({.name = "doctor",
                       .policy = rt::Policy::kDeadline,
                       .runtime_ns = kMillisecond,
                       .deadline_ns = 10 * kMillisecond,
                       .period_ns = 50 * kMillisecond},
                      [] {});
    thread.join();
  } catch (const std::system_error& e) {
    c.state = State::kWarn;
    c.measured = "refused: " + std::generic_category().message(e.code().value());
    if (e.code().value() == EPERM) c.commands = {setcap_command()};
  }
  return c;
}

Check check_locked_memory(const DoctorPlan& plan) {
  Check c{"locked memory", State::kOk, "",
          "a page that was swapped out or never touched costs a fault in the middle of a step"};
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  const std::string allowed =
      limit.rlim_cur == RLIM_INFINITY ? "unlimited" : fmt::format("{} KiB", limit.rlim_cur >> 10);
  const LockOutcome outcome = lock_in_child(plan.heap_mib);
  c.figures = {{"locked_kib", outcome.locked_kib}, {"faults_after", outcome.faults}, {"heap_mib", plan.heap_mib}};
  if (outcome.error == 0) {
    c.measured =
        fmt::format("{} MiB locked by a child (heap {} MiB); {} page faults when 16 MiB were then used; limit {}",
                    outcome.locked_kib >> 10, plan.heap_mib, outcome.faults, allowed);
    if (outcome.faults > 0) c.state = State::kWarn;
    return c;
  }
  c.state = State::kFail;
  c.measured = fmt::format("{} (limit {}, heap {} MiB)", outcome.why.data(), allowed, plan.heap_mib);
  c.commands = {setcap_command(),
                "echo '* - memlock unlimited' | sudo tee /etc/security/limits.d/wasp.conf  # then log in anew"};
  excuse(c);
  return c;
}

Check check_idle_hold(const DoctorPlan&) {
  Check c{"sleep hold", State::kOk, "/dev/cpu_dma_latency was held at 0 us and let go again",
          "while the flight holds it the processor does not sleep deeply"};
  const rt::CpuLatencyHold hold;
  if (hold.held()) return c;
  const bool there = access("/dev/cpu_dma_latency", F_OK) == 0;
  c.state = there ? State::kWarn : State::kOk;
  c.measured = there ? "/dev/cpu_dma_latency may not be written" : "this kernel has no /dev/cpu_dma_latency";
  if (there)
    c.commands = {
        "echo 'KERNEL==\"cpu_dma_latency\", GROUP=\"dialout\", MODE=\"0660\"' | "
        "sudo tee /etc/udev/rules.d/99-wasp.rules && sudo udevadm trigger --name-match=cpu_dma_latency"};
  return c;
}

}  // namespace wasp::tools
