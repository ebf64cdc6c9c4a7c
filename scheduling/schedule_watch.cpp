#include "scheduling/schedule_watch.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>

namespace wasp::scheduling {
namespace {

#ifndef SCHED_RESET_ON_FORK
constexpr int SCHED_RESET_ON_FORK = 0x40000000;
#endif

std::string name_of_policy(int policy) {
  switch (policy) {
    case SCHED_OTHER:
      return "SCHED_OTHER";
    case SCHED_FIFO:
      return "SCHED_FIFO";
    case SCHED_RR:
      return "SCHED_RR";
    case SCHED_BATCH:
      return "SCHED_BATCH";
    case SCHED_IDLE:
      return "SCHED_IDLE";
    default:
      return fmt::format("policy {}", policy);
  }
}

/// "0-1,3".
std::string list_of(const cpu_set_t& cores) {
  std::string text;
  for (int first = 0; first < CPU_SETSIZE; ++first) {
    if (!CPU_ISSET(first, &cores)) continue;
    int last = first;
    while (last + 1 < CPU_SETSIZE && CPU_ISSET(last + 1, &cores)) ++last;
    text += text.empty() ? "" : ",";
    text += first == last ? fmt::format("{}", first) : fmt::format("{}-{}", first, last);
    first = last;
  }
  return text;
}

}  // namespace

std::optional<Schedule> schedule_of(int tid) {
  Schedule s;
  sched_param param{};
  const int policy = sched_getscheduler(tid);
  if (policy < 0 || sched_getparam(tid, &param) != 0 || sched_getaffinity(tid, sizeof s.cores, &s.cores) != 0)
    return std::nullopt;
  s.policy = policy & ~SCHED_RESET_ON_FORK;
  s.priority = param.sched_priority;
  return s;
}

std::string describe(const Schedule& s) {
  return fmt::format("{}{} on core{} {}", name_of_policy(s.policy),
                     s.priority > 0 ? fmt::format(" {}", s.priority) : "", CPU_COUNT(&s.cores) == 1 ? "" : "s",
                     list_of(s.cores));
}

ScheduleWatch::ScheduleWatch(ThreadWatch& watch, bool real_time) : watch_(&watch), real_time_(real_time) {
  sched_getaffinity(0, sizeof anywhere_, &anywhere_);
}

Schedule ScheduleWatch::wanted() const {
  Schedule s;
  const bool fifo = real_time_ && watch_->demoted.load() == 0;
  s.policy = fifo ? SCHED_FIFO : SCHED_OTHER;
  s.priority = fifo ? watch_->priority : 0;
  s.cores = anywhere_;
  if (watch_->core < 0) return s;
  CPU_ZERO(&s.cores);
  CPU_SET(watch_->core, &s.cores);
  return s;
}

void ScheduleWatch::look(RunStatus& status, const std::function<void(const std::string&)>& log) {
  const int tid = watch_->tid.load();
  const auto now = tid == 0 ? std::nullopt : schedule_of(tid);
  const Schedule want = wanted();
  if (!now || *now == want) {
    watch_->stolen.store(0);
    told_.reset();
    return;
  }
  if (told_ == now) return;
  told_ = now;
  watch_->stolen.store(1);
  status.schedule_thefts.fetch_add(1, std::memory_order_relaxed);
  log(fmt::format("{}: {} is now {}; {}", watch_->name, describe(want), describe(*now), take_back(tid, want)));
}

std::string ScheduleWatch::take_back(int tid, const Schedule& want) {
  if (taken_back_ == kTakeBacks) return fmt::format("not taken back any more, after {} times", kTakeBacks);
  sched_param param{};
  param.sched_priority = want.priority;
  const bool done =
      sched_setaffinity(tid, sizeof want.cores, &want.cores) == 0 && sched_setscheduler(tid, want.policy, &param) == 0;
  if (!done) return fmt::format("cannot be taken back: {}", std::strerror(errno));
  ++taken_back_;
  told_.reset();  // the same again would be another theft
  return "taken back";
}

}  // namespace wasp::scheduling
