// iceoryx's daemon for benchmarks and tests: started with a configuration of our own, killed, stopped and started again
// at will. Only one daemon can run on a machine: users of this class in other processes are waited for.
#pragma once

#include <sys/types.h>

#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace wasp::tools {

class RoudiProcess {
 public:
  struct Options {
    bool monitoring = false;  ///< the daemon forgets clients it has not heard of for 1.5 s
    double patience_s = 300;  ///< for another user of this class to finish
    std::function<bool()> interrupted = [] { return false; };
  };
  /// Starts iox-roudi and waits until it is ready; `trouble()` says why it is not.
  explicit RoudiProcess(Options options);
  RoudiProcess() : RoudiProcess(Options{}) {}
  /// Stops it (SIGTERM, after three seconds SIGKILL) and removes what it left behind.
  ~RoudiProcess();
  RoudiProcess(const RoudiProcess&) = delete;
  RoudiProcess& operator=(const RoudiProcess&) = delete;

  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  [[nodiscard]] pid_t pid() const { return pid_; }
  void signal(int number) const;
  /// SIGKILL, and another daemon in its place. False, with trouble(), if that one does not come up.
  bool replace();
  /// What the daemon has written so far.
  [[nodiscard]] std::string said() const;

 private:
  bool take_turn();
  void start();
  void end(int signal);
  std::string await_ready();
  void listen(int fd);

  Options options_;
  int turn_fd_ = -1;  ///< locked while this daemon is ours
  pid_t pid_ = -1;
  std::string config_path_, trouble_, said_;
  mutable std::mutex said_mutex_;
  std::thread listener_;
};

}  // namespace wasp::tools
