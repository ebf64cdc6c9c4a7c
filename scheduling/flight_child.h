// The flying process as its guardian holds it: started with the guard page and the serial line as inherited
// descriptors (guard_page.h), watched through a pidfd. It reads its configuration and waits until it is told to go. It
// is told to land (SIGTERM) should the guardian die.
#pragma once

#include <sched.h>
#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "drivers/line_handover.h"

namespace wasp::scheduling {

/// How a process ended.
struct ProcessEnd {
  int code = 0;    ///< exit code, if signal is 0
  int signal = 0;  ///< that ended it
};

class FlightChild {
 public:
  /// Starts `command[0]` on the cores of `cores`, without the guardian's priority. Throws std::runtime_error or
  /// std::system_error.
  /// `hurried`: ahead of ordinary processes, for an armed vehicle waits for it.
  FlightChild(const std::vector<std::string>& command, int page, int line, const cpu_set_t& cores, bool hurried);
  ~FlightChild();  ///< kills it, if it still runs
  FlightChild(const FlightChild&) = delete;
  FlightChild& operator=(const FlightChild&) = delete;

  [[nodiscard]] pid_t pid() const noexcept { return pid_; }
  [[nodiscard]] int pid_fd() const noexcept { return pid_fd_; }  ///< readable once it has ended
  void signal(int number) const noexcept;
  /// SIGKILL, and its end ahead of ordinary processes: its memory takes a while to be taken apart.
  void kill_at_once() const noexcept;
  /// It may begin.
  void go() noexcept;
  /// The line was opened again.
  void give_line(int line) noexcept;
  /// Its end once it has come, without waiting.
  const std::optional<ProcessEnd>& poll() noexcept;

 private:
  pid_t pid_ = -1;
  int pid_fd_ = -1, go_fd_ = -1;
  drivers::HandoverSockets sockets_;
  std::optional<ProcessEnd> end_;
};

}  // namespace wasp::scheduling
