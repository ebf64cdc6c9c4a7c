#include "scheduling/schedule_picture.h"

#include <fmt/format.h>

#include <algorithm>

namespace wasp::scheduling {
namespace {

/// One release that has not run to its end.
struct Job {
  std::size_t thread = 0;
  TimeNs released_ns = 0;
  DurationNs left_ns = 0;
};

/// The job that has the core: highest priority, then the one that came first.
std::vector<Job>::iterator chosen(std::vector<Job>& jobs, const std::vector<AnalysedThread>& threads) {
  return std::min_element(jobs.begin(), jobs.end(), [&](const Job& a, const Job& b) {
    const int pa = threads[a.thread].priority, pb = threads[b.thread].priority;
    return pa != pb ? pa > pb : a.released_ns < b.released_ns;
  });
}

DurationNs overlap(const Slice& s, DurationNs from_ns, DurationNs to_ns) {
  return std::max<DurationNs>(0, std::min(s.end_ns, to_ns) - std::max(s.start_ns, from_ns));
}

/// True if a release of `thread` is unfinished at some time within [from, to).
bool pending(const AnalysedThread& t, const std::vector<Slice>& slices, std::size_t thread, DurationNs from_ns,
             DurationNs to_ns) {
  DurationNs done_ns = 0;
  for (const auto& s : slices)
    if (s.thread == thread) done_ns += overlap(s, 0, from_ns);
  const DurationNs released = (to_ns + t.period_ns - 1) / t.period_ns;
  return done_ns < released * t.cost_ns;
}

}  // namespace

std::vector<Slice> play(const std::vector<AnalysedThread>& threads, DurationNs length_ns) {
  std::vector<Slice> slices;
  std::vector<Job> jobs;
  std::vector<TimeNs> due(threads.size(), 0);
  for (TimeNs now_ns = 0; now_ns < length_ns;) {
    TimeNs next_ns = length_ns;
    for (std::size_t i = 0; i < threads.size(); ++i) {
      if (due[i] <= now_ns) {
        jobs.push_back({i, due[i], threads[i].cost_ns});
        due[i] += threads[i].period_ns;
      }
      next_ns = std::min(next_ns, due[i]);
    }
    if (!jobs.empty()) {
      const auto job = chosen(jobs, threads);
      const DurationNs run_ns = std::min(job->left_ns, next_ns - now_ns);
      slices.push_back({job->thread, now_ns, now_ns + run_ns});
      next_ns = now_ns + run_ns;
      job->left_ns -= run_ns;
      if (job->left_ns == 0) jobs.erase(job);
    }
    now_ns = next_ns;
  }
  return slices;
}

std::string schedule_picture(const std::vector<AnalysedThread>& threads, DurationNs length_ns, int columns) {
  const auto slices = play(threads, length_ns);
  const DurationNs column_ns = std::max<DurationNs>(1, length_ns / columns);
  std::string text;
  for (std::size_t i = 0; i < threads.size(); ++i) {
    std::string line, releases;
    for (int c = 0; c < columns; ++c) {
      const DurationNs from_ns = c * column_ns, to_ns = from_ns + column_ns;
      DurationNs ran_ns = 0;
      for (const auto& s : slices)
        if (s.thread == i) ran_ns += overlap(s, from_ns, to_ns);
      line += ran_ns * 2 >= column_ns || (ran_ns > 0 && ran_ns == threads[i].cost_ns) ? '#'
              : pending(threads[i], slices, i, from_ns, to_ns)                        ? '-'
              : ran_ns > 0                                                            ? '#'
                                                                                      : '.';
      releases += from_ns % threads[i].period_ns < column_ns && (c == 0 || from_ns >= threads[i].period_ns) ? '^' : ' ';
    }
    releases.erase(releases.find_last_not_of(' ') + 1);
    text += fmt::format("  {:<16.16} {}\n  {:<16} {}\n", threads[i].name, line, "", releases);
  }
  return text + fmt::format("  {:<16} 0{:>{}}\n", "", fmt::format("{:.3f} ms", static_cast<double>(length_ns) / 1e6),
                            columns - 1);
}

}  // namespace wasp::scheduling
