// The autopilot's end as a datagram socket, in the habit of PX4: it speaks first, from a port of its own, to where the
// companion listens (udp://127.0.0.1:14540). One write is one datagram, or several where it is long; frames are never
// split over two.
#pragma once

#include <string>
#include <vector>

#include "drivers/line_port.h"
#include "sim/companion_line.h"

namespace wasp::sim {

class UdpLine : public CompanionLine {
 public:
  /// `there`: "127.0.0.1:14540". Throws std::runtime_error naming it.
  explicit UdpLine(const std::string& there);

  bool wait(TimeNs until_ns) override { return port_.wait_readable(until_ns); }
  std::span<const std::uint8_t> read() override;
  void write(std::span<const std::uint8_t> bytes) override;

 private:
  drivers::LinePort port_;
  std::vector<std::uint8_t> input_;
};

}  // namespace wasp::sim
