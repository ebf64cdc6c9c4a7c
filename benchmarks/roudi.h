// The iceoryx daemon, started with a configuration of our own and stopped again.
#pragma once

#include <sys/types.h>

#include <string>

namespace wasp::bench {

class Roudi {
 public:
  /// Starts iox-roudi and waits until it is ready; `trouble()` says why it is not.
  Roudi();
  /// Stops it (SIGTERM, after three seconds SIGKILL) and removes the files it did not.
  ~Roudi();
  Roudi(const Roudi&) = delete;
  Roudi& operator=(const Roudi&) = delete;
  [[nodiscard]] const std::string& trouble() const { return trouble_; }

 private:
  std::string await_ready(int fd);
  pid_t pid_ = -1;
  std::string config_path_;
  std::string trouble_;
};

}  // namespace wasp::bench
