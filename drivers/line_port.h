// The line to the autopilot, non-blocking, for one process: a serial device or a socket (endpoint.h). The file
// descriptor keeps its number for the life of the object: losing and reopening the device swaps what stands behind it
// (dup3), so a thread that writes while another reopens gets kGone, never somebody else's file.
//
// A datagram is written whole or not at all, so frames are never split over two. A port that listens (udp://) hears
// everybody and answers nobody until `adopt_peer`; a peer that is not there (ECONNREFUSED) is silence, not a lost line.
#pragma once

#include <netinet/in.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/endpoint.h"
#include "rt/contract.h"
#include "types/time.h"

namespace wasp::drivers {

enum class IoStatus : std::uint8_t {
  kOk,          ///< at least one byte moved
  kWouldBlock,  ///< nothing to read, or no room to write, or nobody to write to, now
  kGone,        ///< hung up, unplugged or never there: try_reopen
};

struct IoResult {
  IoStatus status = IoStatus::kGone;
  std::size_t bytes = 0;  ///< moved; for a write it may be fewer than offered
};

/// A line that another process (the guardian) has opened and set up.
struct LineGift {
  int line_fd = -1;    ///< the port's own from here on; may be dead already
  int socket_fd = -1;  ///< where a line opened again comes from (line_handover.h); the port's own as well
};

class LinePort {
 public:
  /// Opens, takes exclusive use and sets up the line. Throws std::runtime_error naming the device and the reason.
  explicit LinePort(Endpoint endpoint);
  /// Uses a line opened by another process, which also opens it again after a loss.
  LinePort(Endpoint endpoint, LineGift gift);
  ~LinePort();
  LinePort(const LinePort&) = delete;
  LinePort& operator=(const LinePort&) = delete;

  /// Hands bytes to the kernel; never waits. Realtime-safe: yes (one write).
  IoResult write(std::span<const std::uint8_t> bytes) WASP_REALTIME;
  /// Takes what has arrived, of datagrams one; never waits. Realtime-safe: yes (one read, and a poll when it was
  /// empty).
  IoResult read(std::span<std::uint8_t> bytes) WASP_REALTIME;
  /// Sleeps until there is something to read, the line is gone (true as well: read tells), or the deadline has passed
  /// (false). Realtime-safe: yes (ppoll).
  bool wait_readable(TimeNs deadline_ns) WASP_REALTIME;
  /// Bytes the kernel has not sent yet; -1 when the driver does not say, 0 for datagrams. Realtime-safe: yes (one
  /// ioctl).
  [[nodiscard]] long pending_output_bytes() const WASP_REALTIME;
  /// Throws away what the kernel has not sent yet; false when the driver refuses. Realtime-safe: yes (one ioctl).
  bool discard_output() WASP_REALTIME;
  /// Bytes written since construction, by all threads. Realtime-safe: yes.
  [[nodiscard]] std::uint64_t written_total() const WASP_REALTIME {
    return written_total_.load(std::memory_order_relaxed);
  }

  /// Whoever sent what was read last is the peer from now on. Nothing happens unless the port listens for datagrams
  /// and has none yet. Reading thread only. Realtime-safe: yes.
  void adopt_peer() WASP_REALTIME;
  /// Hears everybody again: a peer that has fallen silent may come back from elsewhere. Realtime-safe: yes.
  void forget_peer() WASP_REALTIME;

  /// What poll says of the descriptor means that the line is gone. Takes an error of a datagram socket away.
  [[nodiscard]] bool hung_up(short poll_events) noexcept;
  /// Lets the device go, so that it can come back under the same name, and looks for it once: opens it, or asks who
  /// gave it. False while it is absent or refused; `last_error` says why. One thread only. Realtime-safe: no (open).
  bool try_reopen() noexcept;
  /// Lets the device go; reads and writes return kGone until try_reopen succeeds.
  void release() noexcept;

  [[nodiscard]] int fd() const noexcept { return fd_; }
  [[nodiscard]] int last_error() const noexcept { return last_error_; }  ///< errno of the last failed try_reopen
  [[nodiscard]] const Endpoint& endpoint() const noexcept { return endpoint_; }

 private:
  int open_device() noexcept;
  int obtain_device() noexcept;
  ssize_t take(std::span<std::uint8_t> bytes) WASP_REALTIME;
  [[nodiscard]] IoStatus status_of_errno() const WASP_REALTIME;

  Endpoint endpoint_;
  int socket_fd_ = -1;   ///< of a gift; -1: the port opens the device itself
  int nothing_fd_ = -1;  ///< refuses reads and writes; stands in while the device is away
  int fd_ = -1;
  int last_error_ = 0;
  sockaddr_in heard_from_{};  ///< the datagram read last
  bool has_peer_ = false;
  std::atomic<std::uint64_t> written_total_{0};
};

}  // namespace wasp::drivers
