// A child process that never outlives its parent and is ended in order: SIGTERM or SIGINT first, SIGKILL when patience
// runs out. It has its own process group, so that a Ctrl-C at the terminal reaches only the launcher.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace wasp::tools {

class ChildProcess {
 public:
  /// Starts `arguments[0]`; `log_path` takes its standard output and error (empty: inherited).
  /// Throws std::runtime_error naming the program.
  ChildProcess(std::vector<std::string> arguments, const std::string& log_path = {});
  ~ChildProcess();
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;

  [[nodiscard]] pid_t pid() const noexcept { return pid_; }
  /// Exit code once it has ended (128 + signal if killed), without waiting.
  std::optional<int> poll();
  void signal(int number) const;
  /// Sends `number`, waits up to `patience_s`, then kills. Returns the exit code.
  int end(int number, double patience_s);
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

 private:
  pid_t pid_ = -1;
  std::optional<int> code_;
  std::string name_;
};

}  // namespace wasp::tools
