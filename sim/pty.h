// The autopilot's end of a serial line: a raw pseudo-terminal whose slave a symbolic link names. The simulator keeps
// the slave open itself, so that the line survives a companion that closes and reopens it. Never blocks: when nobody
// reads, new output is dropped in whole pieces, as a wire without a listener does.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sim/companion_line.h"

namespace wasp::sim {

class Pty : public CompanionLine {
 public:
  /// Throws std::runtime_error naming the path and the reason. An old symbolic link at `link_path` is replaced,
  /// anything else there is not touched.
  explicit Pty(std::string link_path);
  ~Pty() override;  ///< removes the link
  Pty(const Pty&) = delete;
  Pty& operator=(const Pty&) = delete;

  bool wait(TimeNs until_ns) override;
  std::span<const std::uint8_t> read() override;
  /// Sends `bytes`, or drops all of them while earlier ones still wait. Split messages never reach the line.
  void write(std::span<const std::uint8_t> bytes) override;

  /// To poll.
  [[nodiscard]] int fd() const { return master_; }
  [[nodiscard]] const std::string& slave_path() const { return slave_path_; }
  [[nodiscard]] std::uint64_t dropped_bytes() const { return dropped_bytes_; }

 private:
  void flush_backlog();

  std::string link_path_, slave_path_;
  int master_ = -1, slave_ = -1;
  std::vector<std::uint8_t> input_, backlog_;
  std::uint64_t dropped_bytes_ = 0;
};

}  // namespace wasp::sim
