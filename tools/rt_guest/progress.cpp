#include "tools/rt_guest/progress.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <iostream>
#include <stdexcept>

#include "rt/clock.h"

namespace wasp::tools::rt_guest {
namespace {

/// Virtual seconds flown so far: whole jobs before the one under way, and its own.
int done_s(const Plan& plan, const Console& console) {
  int sum = 0;
  for (const Job& job : plan.jobs) {
    if (job.name == console.running()) return sum + std::min(console.elapsed_s(), job.seconds());
    sum += job.seconds();
  }
  return 0;
}

}  // namespace

Progress::Progress(const Plan& plan)
    : plan_(plan), terminal_(isatty(STDERR_FILENO) != 0), start_ns_(rt::now()), shown_ns_(start_ns_) {}

void Progress::show(const Console& console) {
  const TimeNs now_ns = rt::now();
  if (now_ns - shown_ns_ < (terminal_ ? kSecond : 10 * kSecond)) return;
  shown_ns_ = now_ns;
  const double spent_s = to_seconds(now_ns - start_ns_);
  const int done = done_s(plan_, console), all = plan_.seconds();
  std::string text = console.up()
                         ? fmt::format("{}: {} of {} virtual seconds, {:.0f} s", console.running(), done, all, spent_s)
                         : fmt::format("booting, {:.0f} s", spent_s);
  if (done > 0) text += fmt::format(", about {:.0f} s left", spent_s / done * (all - done));
  std::cerr << (terminal_ ? "\r\033[K" : "") << text << (terminal_ ? "" : "\n") << std::flush;
}

void Progress::finish() const {
  std::cerr << (terminal_ ? "\r\033[K" : "")
            << fmt::format("guest ran for {:.0f} s\n", to_seconds(rt::now() - start_ns_));
}

RunLock::RunLock(const std::filesystem::path& file) : fd_(open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)) {
  if (fd_ < 0) throw std::runtime_error("cannot open " + file.string());
  flock(fd_, LOCK_EX);
}

RunLock::~RunLock() { close(fd_); }

}  // namespace wasp::tools::rt_guest
