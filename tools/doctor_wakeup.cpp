// Wake-up latency by measurement: our own loop of absolute sleeps and cyclictest beside it, on every usable core at
// once, 1 ms period, half a period apart, so that a figure of ours can be told from one of the machine.
#include <fmt/format.h>

#include <memory>
#include <system_error>

#include "rt/clock.h"
#include "rt/process.h"
#include "tools/cyclictest.h"
#include "tools/doctor_checks.h"
#include "tools/latency_summary.h"
#include "tools/piped_child.h"
#include "tools/quantiles.h"
#include "tools/wakeup_loop.h"

namespace wasp::tools {
namespace {

constexpr DurationNs kPeriod = kMillisecond;

struct CoreFigures {
  Quantiles ours, theirs;
  std::size_t skipped = 0;
};

nlohmann::json json_of(const Quantiles& q) {
  return {{"count", q.count}, {"p50_ns", q.p50}, {"p99_ns", q.p99}, {"p999_ns", q.p999}, {"max_ns", q.max}};
}

std::string text_of(const Quantiles& q) {
  const auto t = [](double ns) { return duration_text(static_cast<std::int64_t>(ns)); };
  return fmt::format("p50 {}, p99 {}, p99.9 {}, max {} (n {})", t(q.p50), t(q.p99), t(q.p999), t(q.max), q.count);
}

/// Loops on every core, SCHED_FIFO `priority` or ordinary if 0.
std::vector<std::unique_ptr<WakeupLoop>> start_loops(const DoctorPlan& plan, int priority, TimeNs first_due_ns) {
  std::vector<std::unique_ptr<WakeupLoop>> loops;
  const auto room = static_cast<std::size_t>(plan.seconds * 1000) + 3000;
  for (const int core : plan.usable_cores)
    loops.push_back(std::make_unique<WakeupLoop>(WakeupSpec{core, priority, kPeriod, first_due_ns, room}));
  return loops;
}

std::map<int, std::vector<Wakeup>> run_cyclictest(const DoctorPlan& plan, int priority) {
  const auto path = find_cyclictest();
  CyclictestSpec spec;
  spec.cores.assign(plan.usable_cores.begin(), plan.usable_cores.end());
  spec.priority = priority;
  spec.period_ns = kPeriod;
  spec.phase_ns = 0;
  spec.seconds = plan.seconds;
  CyclictestReader reader(spec);
  if (path && priority > 0) {
    PipedChild child(cyclictest_arguments(*path, spec));
    const TimeNs give_up_ns = rt::now() + from_seconds(plan.seconds + 10);
    while (rt::now() < give_up_ns && child.read(reader, 100 * kMillisecond)) {
    }
  } else {
    rt::sleep_until(rt::now() + from_seconds(plan.seconds));
  }
  return reader.wakeups();
}

Check judge(const DoctorPlan& plan, int core, const CoreFigures& f, bool fifo, bool peer) {
  Check c{fmt::format("wake-up on core {}", core), State::kOk, "",
          "the flight's threads are released by this mechanism"};
  c.measured = fmt::format("{}: {}; cyclictest beside it: {}", fifo ? "SCHED_FIFO" : "SCHED_OTHER", text_of(f.ours),
                           f.theirs.count > 0 ? text_of(f.theirs)
                           : peer             ? "no result"
                                              : "not run");
  c.figures = {{"core", core},
               {"fifo", fifo},
               {"ours", json_of(f.ours)},
               {"cyclictest", json_of(f.theirs)},
               {"skipped", f.skipped}};
  if (f.theirs.count > 0 && f.theirs.p99 > 0) c.figures["p99_ratio"] = f.ours.p99 / f.theirs.p99;
  const auto slack = static_cast<double>(plan.control_deadline_ns - plan.control_budget_ns);
  if (!fifo) {
    c.state = State::kUnknown;
    c.commands = {as_root_command()};
  } else if (plan.flight_cores.contains(core)) {
    if (f.ours.p999 > slack / 8 || f.ours.max > slack / 2) c.state = State::kWarn;
    if (f.ours.max > slack) {
      c.state = State::kFail;
      c.measured += fmt::format("; the control deadline leaves {}", duration_text(static_cast<std::int64_t>(slack)));
    }
  }
  return c;
}

}  // namespace

std::vector<Check> check_wakeups(const DoctorPlan& plan) {
  if (!plan.flight_under_way.empty())
    return {{"wake-up", State::kUnknown, fmt::format("not measured: a flight is under way ({})", plan.flight_under_way),
             "run the doctor when it has landed"}};
  lock_what_is_mapped();
  const rt::CpuLatencyHold awake;
  int priority = plan.priorities.empty() ? 80 : *plan.priorities.rbegin();
  std::vector<std::unique_ptr<WakeupLoop>> loops;
  const TimeNs first_due_ns = (rt::now() / kSecond + 1) * kSecond + kPeriod / 2;
  try {
    loops = start_loops(plan, priority, first_due_ns);
  } catch (const std::system_error&) {
    priority = 0;
    loops.clear();
    loops = start_loops(plan, 0, first_due_ns);
  }
  const auto theirs = run_cyclictest(plan, priority);
  std::vector<Check> checks;
  int index = 0;
  for (const int core : plan.usable_cores) {
    const Population ours = whole_population(loops[static_cast<std::size_t>(index)]->finish(), kPeriod);
    CoreFigures f{quantiles(ours.late_ns), {}, ours.skipped};
    if (const auto it = theirs.find(index); it != theirs.end())
      f.theirs = quantiles(whole_population(it->second, kPeriod).late_ns);
    checks.push_back(judge(plan, core, f, priority > 0, find_cyclictest().has_value()));
    ++index;
  }
  return checks;
}

}  // namespace wasp::tools
