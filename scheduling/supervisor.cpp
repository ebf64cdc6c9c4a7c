#include "scheduling/supervisor.h"

#include <fmt/format.h>
#include <sched.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "rt/clock.h"
#include "shm/bus_guard.h"

namespace wasp::scheduling {
namespace {

constexpr const char* kControl = "control";
constexpr DurationNs kBeforeRelease = 2 * kMillisecond;  // shown of the core's history ahead of the intended release

std::optional<ThreadCounts> between(const std::optional<ThreadCounts>& before, const std::optional<ThreadCounts>& now) {
  if (!before || !now) return now;
  return ThreadCounts{now->ran_ns - before->ran_ns, now->run_delay_ns - before->run_delay_ns,
                      now->slices - before->slices};
}

std::optional<CoreCounts> between(const std::optional<CoreCounts>& before, const std::optional<CoreCounts>& now) {
  if (!before || !now) return std::nullopt;
  CoreCounts c;
  for (std::size_t i = 0; i < c.ticks.size(); ++i) c.ticks[i] = now->ticks[i] - before->ticks[i];
  return c;
}

}  // namespace

Supervisor::Supervisor(WatchBoard& board, RunStatus& status, SupervisorOptions options,
                       std::function<void(const std::string&)> log)
    : board_(board),
      status_(status),
      options_(std::move(options)),
      log_(std::move(log)),
      folder_(options_.incident_dir, options_.incidents),
      bursts_{{"camera frozen, the same image again and again", {{&status.frames_stuck, "times seen"}}},
              {"frames refused",
               {{&status.frames_duplicate, "duplicate"},
                {&status.frames_disordered, "out of order"},
                {&status.frames_malformed, "malformed"},
                {&status.frames_misdated, "misdated"}}}},
      lost_pages_(shm::lost_pages()) {
  for (auto& watch : board.threads) {
    if (watch.name == kControl) core_ = watch.core;
    subjects_.push_back({&watch});
    subjects_.back().schedule.emplace(watch, options_.real_time);
  }
  // Control first: its misses have the first claim on the files.
  std::stable_partition(subjects_.begin(), subjects_.end(), [](const Subject& s) { return s.watch->name == kControl; });
  if (!folder_.has_room()) {
    hush();
  } else if (options_.trace_switches) {
    trace_ = std::make_unique<SwitchTrace>(options_.tracefs, core_);
    trace_why_not_ = trace_->why_not();
  } else {
    trace_why_not_ = "switched off ([run] trace_switches = false)";
  }
}

void Supervisor::look() {
  count();
  bool missed = false;
  for (auto& s : subjects_) missed = take_misses(s) || missed;
  if (missed) report();
  board_.frozen.store(0, std::memory_order_relaxed);  // a miss since then is taken at the next look, unfrozen
  for (auto& s : subjects_) demote_if_runaway(s);
  for (auto& s : subjects_) s.schedule->look(status_, log_);
  look_for_lost_pages();
  for (auto& b : bursts_) b.look(looked_at_ns_, log_);
}

/// What the kernel has counted since the last look.
void Supervisor::count() {
  const TimeNs now_ns = rt::now();
  window_ns_ = looked_at_ns_ == 0 ? 0 : now_ns - looked_at_ns_;
  looked_at_ns_ = now_ns;
  for (auto& s : subjects_) {
    const auto now = thread_counts(s.watch->tid.load());
    s.within = between(s.before, now);
    s.before = now;
  }
  const auto core_now = core_counts(core_);
  core_within_ = between(core_before_, core_now);
  core_before_ = core_now;
}

/// The first miss since the last look, and how many others; false if there is none.
bool Supervisor::take_misses(Subject& s) {
  s.more = s.watch->misses_unreported.exchange(0);
  s.missed = s.watch->misses.pop(s.miss);
  for (Miss other; s.missed && s.watch->misses.pop(other);) ++s.more;
  return s.missed;
}

/// A file for the first miss of each thread that has one; those that follow soon are counted with it.
void Supervisor::report() {
  if (trace_ && trace_->available()) kernel_events_ = trace_->take();
  for (auto& s : subjects_) {
    if (!s.missed) continue;
    if (s.incident_at_ns != kNever && s.miss.due_at_ns - s.incident_at_ns < kSameIncident) {
      s.followed += s.more + 1;
      continue;
    }
    if (folder_.has_room()) write(s);
    if (s.watch->behaviour) s.watch->quiet.store(1);  // one file each: they must not take the room of control
  }
}

void Supervisor::write(Subject& s) {
  Incident incident = gather(s);
  if (s.followed > 0) log_(fmt::format("{}: {} more misses followed the last incident", incident.thread, s.followed));
  s.followed = 0;
  s.incident_at_ns = std::max({s.miss.released_at_ns, s.miss.computed_at_ns, s.miss.written_at_ns});
  status_.incidents.fetch_add(1, std::memory_order_relaxed);
  log_(fmt::format("incident {}: {}; {}", incident.number, incident_headline(incident), folder_.write(incident)));
  if (folder_.has_room()) return;
  if (folder_.next_number() > folder_.limit())
    log_(
        fmt::format("{} incident files are the limit of this flight ([run] incidents); further misses are only counted",
                    folder_.limit()));
  hush();
}

Incident Supervisor::gather(const Subject& subject) const {
  const Miss& miss = subject.miss;
  Incident i;
  i.more = subject.more;
  i.number = folder_.next_number();
  i.limit = folder_.limit();
  i.instance = options_.instance;
  i.wall_time = wall_time();
  i.thread = subject.watch->name;
  i.core = subject.watch->core;
  i.priority = subject.watch->priority;
  i.real_time = options_.real_time;
  i.miss = miss;
  i.window_ns = window_ns_;
  i.core_counts = core_within_;
  i.trace_why_not = trace_why_not_;
  if (trace_why_not_.empty() && subject.watch->core != core_)
    i.trace_why_not = fmt::format("only control's core {} is traced", core_);
  if (i.trace_why_not.empty()) {
    const TimeNs end_ns = std::max({miss.released_at_ns, miss.computed_at_ns, miss.written_at_ns});
    i.shares_from_ns = std::min(miss.due_at_ns, end_ns - miss.late_ns) - kBeforeRelease;
    i.shares_to_ns = end_ns;
    i.shares = shares_of(kernel_events_, core_, i.shares_from_ns, i.shares_to_ns);
  }
  for (const auto& s : subjects_) {
    const ThreadWatch& w = *s.watch;
    i.threads.push_back({w.name, w.core, w.priority, w.tid.load(), w.demoted.load() != 0, s.within, w.trace.copy()});
  }
  return i;
}

/// Zeros stand where a file was cut short; what was read from there is old by now, and will be refused as such.
void Supervisor::look_for_lost_pages() {
  const std::uint64_t now = shm::lost_pages();
  if (now == lost_pages_) return;
  status_.pages_lost.fetch_add(now - lost_pages_, std::memory_order_relaxed);
  log_(fmt::format("shared memory lost: {} pages of {}, whose file was cut short", now - lost_pages_,
                   shm::lost_names(lost_pages_)));
  lost_pages_ = now;
}

void Supervisor::hush() {
  for (auto& s : subjects_) s.watch->quiet.store(1);
  trace_.reset();
}

/// Steps over budget in a row, or one that does not end: the same one at two looks, longer than all of them together.
void Supervisor::demote_if_runaway(Subject& s) {
  ThreadWatch& w = *s.watch;
  const TimeNs busy_since_ns = w.busy_since_ns.load(std::memory_order_relaxed);
  const bool same_step = busy_since_ns != 0 && busy_since_ns == s.busy_since_ns;
  s.busy_since_ns = busy_since_ns;
  if (!options_.real_time || options_.demote_after == 0 || !w.behaviour || w.demoted.load() != 0) return;
  const auto limit = static_cast<std::uint32_t>(options_.demote_after);
  const bool endless = same_step && looked_at_ns_ - busy_since_ns > w.budget_ns * options_.demote_after &&
                       (!s.within || s.within->ran_ns > window_ns_ / 2);
  const bool often = w.overruns_in_row.load(std::memory_order_relaxed) >= limit;
  if (!endless && !often) return;
  const sched_param ordinary{};
  const bool done = sched_setscheduler(w.tid.load(), SCHED_OTHER, &ordinary) == 0;
  w.demoted.store(1);  // tried once
  log_(fmt::format("behaviour {} {}: {}", w.name,
                   endless ? fmt::format("has been in one step for {} ms (budget {} us)",
                                         (looked_at_ns_ - busy_since_ns) / kMillisecond, w.budget_ns / kMicrosecond)
                           : fmt::format("was over its budget {} times in a row", limit),
                   done ? std::string("demoted to SCHED_OTHER for this flight")
                        : std::string("cannot be demoted: ") + std::strerror(errno)));
}

}  // namespace wasp::scheduling
