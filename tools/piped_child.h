// A child process whose standard output is read as it comes, each piece with the instant it arrived.
#pragma once

#include <poll.h>
#include <unistd.h>

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "rt/clock.h"
#include "tools/child_process.h"

namespace wasp::tools {

class PipedChild {
 public:
  /// Starts `arguments[0]`. Throws std::runtime_error naming the program.
  explicit PipedChild(std::vector<std::string> arguments);
  ~PipedChild();
  PipedChild(const PipedChild&) = delete;
  PipedChild& operator=(const PipedChild&) = delete;

  /// Waits up to `patience_ns` for output and hands it to `reader.take(text, now_ns)`; false once the output has ended.
  template <class Reader>
  bool read(Reader& reader, DurationNs patience_ns) {
    pollfd wanted{fd_, POLLIN, 0};
    if (::poll(&wanted, 1, static_cast<int>(patience_ns / kMillisecond)) <= 0) return true;
    const ssize_t n = ::read(fd_, chunk_.data(), chunk_.size());
    if (n > 0) reader.take(std::string_view(chunk_.data(), static_cast<std::size_t>(n)), rt::now());
    return n > 0;
  }
  ChildProcess& process() { return child_; }

 private:
  struct Pipe {
    int read_end = -1, write_end = -1;
  };
  PipedChild(std::vector<std::string> arguments, Pipe pipe);
  static Pipe open_pipe();

  int fd_;
  std::array<char, 8192> chunk_{};
  ChildProcess child_;
};

}  // namespace wasp::tools
