// What the kernel takes away from a busy SCHED_FIFO thread: throttling, and the fair server that feeds starved ordinary
// threads. A thread spins for 1.2 s (bounded by its own clock) at priority 1, below every other real-time thread of the
// machine, and notes each gap between two looks at the clock.
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <system_error>

#include "rt/clock.h"
#include "rt/thread.h"
#include "tools/doctor_checks.h"
#include "tools/latency_summary.h"

namespace wasp::tools {
namespace {

constexpr DurationNs kSpin = 1200 * kMillisecond;
constexpr DurationNs kGap = 100 * kMicrosecond;   // shorter ones are interrupts
constexpr DurationNs kStall = 10 * kMillisecond;  // a gap this long is policy, or a host that stood still

struct SpinFigures {
  std::string refused;      ///< why it could not be done
  DurationNs taken_ns = 0;  ///< sum of gaps above kGap
  DurationNs longest_ns = 0;
  DurationNs other_ns = 0;  ///< processor time the ordinary thread beside it got
  int gaps = 0;
};

DurationNs own_cpu_time() {
  timespec ts{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &ts);
  return static_cast<DurationNs>(ts.tv_sec) * kSecond + ts.tv_nsec;
}

void spin(SpinFigures& f) {
  const TimeNs end = rt::now() + kSpin;
  for (TimeNs last = rt::now(), now = last; now < end; last = now) {
    now = rt::now();
    const DurationNs gap = now - last;
    if (gap <= kGap) continue;
    ++f.gaps;
    f.taken_ns += gap;
    f.longest_ns = std::max(f.longest_ns, gap);
  }
}

/// Spins on `core`; `beside` starts an ordinary busy thread there first.
SpinFigures spin_on(int core, bool beside) {
  SpinFigures f;
  std::atomic<bool> started{false}, stop{false};
  rt::Thread ordinary;
  if (beside) {
    ordinary = rt::Thread({.name = "ordinary", .core = core}, [&] {
      started = true;
      const TimeNs end = rt::now() + 4 * kSpin;
      while (!stop.load(std::memory_order_relaxed) && rt::now() < end) {
      }
      f.other_ns = own_cpu_time();
    });
    while (!started) rt::sleep_until(rt::now() + kMillisecond);
  }
  try {
    rt::Thread spinner({.name = "spinner", .policy = rt::Policy::kFifo, .priority = 1, .core = core}, [&] {
      spin(f);
      stop = true;
    });
    spinner.join();
  } catch (const std::system_error& e) {
    f.refused = std::generic_category().message(e.code().value());
  }
  stop = true;
  ordinary.join();
  return f;
}

std::string ms(DurationNs ns) { return fmt::format("{:.1f} ms", static_cast<double>(ns) * 1e-6); }

Check unknown(Check c, const std::string& why, std::vector<std::string> commands) {
  c.state = State::kUnknown;
  c.measured = why;
  c.commands = std::move(commands);
  return c;
}

std::string limit_text(const SystemTree& tree) {
  return fmt::format("sched_rt_runtime_us {}, sched_rt_period_us {}",
                     tree.text("/proc/sys/kernel/sched_rt_runtime_us").value_or("?"),
                     tree.text("/proc/sys/kernel/sched_rt_period_us").value_or("?"));
}

std::string fair_server_text(const SystemTree& tree, int core) {
  const std::string folder = fmt::format("/sys/kernel/debug/sched/fair_server/cpu{}", core);
  const auto runtime = tree.text(folder + "/runtime"), period = tree.text(folder + "/period");
  if (runtime) return fmt::format("fair_server runtime {} ns of {} ns", *runtime, period.value_or("?"));
  return "fair_server settings not visible (debugfs not mounted, or an older kernel)";
}

}  // namespace

Check check_throttling(const DoctorPlan& plan) {
  Check c{"real-time throttling", State::kOk, "",
          "a real-time thread that is busy for a second is stopped for 50 ms: a whole control period"};
  if (!plan.flight_under_way.empty())
    return unknown(c, fmt::format("not tried: a flight is under way ({})", plan.flight_under_way), {});
  const SpinFigures f = spin_on(plan.core, false);
  if (!f.refused.empty())
    return unknown(c, "a spinning SCHED_FIFO thread was refused: " + f.refused, {as_root_command()});
  c.measured = fmt::format("{} of a {} spin on core {} taken away in {} gaps, the longest {}; {}", ms(f.taken_ns),
                           ms(kSpin), plan.core, f.gaps, ms(f.longest_ns), limit_text(plan.tree));
  c.figures = {{"spin_ns", kSpin}, {"taken_ns", f.taken_ns}, {"longest_ns", f.longest_ns}, {"gaps", f.gaps}};
  if (f.longest_ns < kStall) return c;
  c.state = State::kWarn;
  c.commands = {"sudo sysctl -w kernel.sched_rt_runtime_us=-1"};
  return c;
}

Check check_fair_server(const DoctorPlan& plan) {
  Check c{"fair-server stall", State::kOk, "",
          "an ordinary thread starved by a busy real-time one gets 50 ms a second in its place"};
  if (!plan.flight_under_way.empty())
    return unknown(c, fmt::format("not tried: a flight is under way ({})", plan.flight_under_way), {});
  const SpinFigures f = spin_on(plan.core, true);
  if (!f.refused.empty())
    return unknown(c, "a spinning SCHED_FIFO thread was refused: " + f.refused, {as_root_command()});
  c.measured = fmt::format(
      "beside a busy SCHED_OTHER thread {} of {} taken away, the longest {} (it ran {} meanwhile and after); {}",
      ms(f.taken_ns), ms(kSpin), ms(f.longest_ns), ms(f.other_ns), fair_server_text(plan.tree, plan.core));
  c.figures = {{"spin_ns", kSpin}, {"taken_ns", f.taken_ns}, {"longest_ns", f.longest_ns}, {"gaps", f.gaps}};
  if (f.longest_ns < kStall) return c;
  c.state = State::kWarn;
  c.commands = {
      fmt::format("sudo mount -t debugfs none /sys/kernel/debug 2>/dev/null; "
                  "echo 0 | sudo tee /sys/kernel/debug/sched/fair_server/cpu{}/runtime",
                  plan.core)};
  if (!plan.tree.exists(fmt::format("/sys/kernel/debug/sched/fair_server/cpu{}", plan.core)))
    c.commands.push_back("sudo sysctl -w kernel.sched_rt_runtime_us=-1  # where the kernel has no fair_server");
  return c;
}

}  // namespace wasp::tools
