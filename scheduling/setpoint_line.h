// The last step to the wire: a setpoint never waits behind an older one. Where the driver says that the last one has
// not left yet, or takes a new one only in part, the line is stalled: what is queued is thrown away, and the cut frame
// falls to the receiver's checksum.
#pragma once

#include "drivers/line_port.h"

namespace wasp::scheduling {

class SetpointLine {
 public:
  explicit SetpointLine(drivers::LinePort& port) : port_(port) {}

  struct Sent {
    bool setpoint_whole = false;  ///< its last byte was handed to the kernel
    bool flushed = false;         ///< something old was thrown away
  };

  /// Writes `bytes`, of which the first `setpoint_bytes` are the setpoint. Control thread only. Realtime-safe: yes (at
  /// most two ioctl and one write).
  Sent send(std::span<const std::uint8_t> bytes, std::size_t setpoint_bytes) WASP_REALTIME {
    Sent sent;
    if (old_setpoint_waits()) sent.flushed = port_.discard_output();
    const drivers::IoResult written = port_.write(bytes);
    sent.setpoint_whole = written.bytes >= setpoint_bytes;
    written_total_ = port_.written_total();
    setpoint_waits_ = written.bytes > 0 && setpoint_bytes > 0;
    if (sent.setpoint_whole || written.status == drivers::IoStatus::kGone) return sent;
    sent.flushed = port_.discard_output() || sent.flushed;
    setpoint_waits_ = false;
    return sent;
  }

 private:
  /// The kernel's queue is first in, first out: it holds more than what came after the setpoint, so the setpoint is in
  /// it. False where the driver does not say (a pseudo-terminal says 0 always).
  [[nodiscard]] bool old_setpoint_waits() const WASP_REALTIME {
    if (!setpoint_waits_) return false;
    const auto since = static_cast<long>(port_.written_total() - written_total_);
    return port_.pending_output_bytes() > since;
  }

  drivers::LinePort& port_;
  std::uint64_t written_total_ = 0;  ///< of the port, right after the last setpoint
  bool setpoint_waits_ = false;
};

}  // namespace wasp::scheduling
