#include "drivers/line_port.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "drivers/line_advice.h"
#include "drivers/line_handover.h"
#include "drivers/serial_line.h"
#include "drivers/socket_line.h"
#include "rt/clock.h"

namespace wasp::drivers {
namespace {

std::string name_of(const Endpoint& endpoint) {
  return endpoint.kind == EndpointKind::kSerial
             ? "serial device " + endpoint.path + " at " + std::to_string(endpoint.baud) + " baud"
             : "endpoint " + endpoint.path;
}

}  // namespace

LinePort::LinePort(Endpoint endpoint) : endpoint_(std::move(endpoint)) {
  const int device = open_device();
  if (device < 0)
    throw std::runtime_error(name_of(endpoint_) + ": " + std::generic_category().message(last_error_) +
                             line_advice(endpoint_, last_error_));
  nothing_fd_ = ::open("/", O_PATH | O_CLOEXEC);
  fd_ = device;
}

LinePort::LinePort(Endpoint endpoint, LineGift gift)
    : endpoint_(std::move(endpoint)), socket_fd_(gift.socket_fd), nothing_fd_(::open("/", O_PATH | O_CLOEXEC)) {
  fd_ = gift.line_fd;
  for (const int fd : {fd_, socket_fd_}) fcntl(fd, F_SETFD, FD_CLOEXEC);
}

LinePort::~LinePort() {
  ::close(fd_);
  if (socket_fd_ >= 0) ::close(socket_fd_);
  if (nothing_fd_ >= 0) ::close(nothing_fd_);
}

/// A descriptor of the device, set up; -1 with last_error_ set.
int LinePort::open_device() noexcept {
  const bool serial = endpoint_.kind == EndpointKind::kSerial;
  const int fd = serial ? open_serial_line(endpoint_) : open_socket_line(endpoint_);
  last_error_ = fd < 0 ? errno : 0;
  return fd;
}

/// The device, from where this port has it.
int LinePort::obtain_device() noexcept {
  if (socket_fd_ < 0) return open_device();
  const int device = take_descriptor(socket_fd_);
  last_error_ = device < 0 ? ENODEV : 0;
  return device;
}

void LinePort::release() noexcept { dup3(nothing_fd_, fd_, O_CLOEXEC); }

bool LinePort::try_reopen() noexcept {
  release();
  const int device = obtain_device();
  if (device < 0) return false;
  const bool swapped = dup3(device, fd_, O_CLOEXEC) == fd_;
  has_peer_ = false;
  ::close(device);
  return swapped;
}

/// Of a datagram socket an error says something of the peer, never of the line.
IoStatus LinePort::status_of_errno() const WASP_REALTIME {
  const bool later = errno == EAGAIN || errno == EINTR;
  const bool nobody = endpoint_.datagrams() && errno != EBADF && errno != ENOTSOCK;
  return later || nobody ? IoStatus::kWouldBlock : IoStatus::kGone;
}

IoResult LinePort::write(std::span<const std::uint8_t> bytes) WASP_REALTIME {
  if (bytes.empty()) return {IoStatus::kOk, 0};
  const ssize_t n = endpoint_.kind == EndpointKind::kSerial ? ::write(fd_, bytes.data(), bytes.size())
                                                            : ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (n > 0) {
    written_total_.fetch_add(static_cast<std::uint64_t>(n), std::memory_order_relaxed);
    return {IoStatus::kOk, static_cast<std::size_t>(n)};
  }
  return {n == 0 ? IoStatus::kWouldBlock : status_of_errno(), 0};
}

/// One read; of a datagram the sender as well.
ssize_t LinePort::take(std::span<std::uint8_t> bytes) WASP_REALTIME {
  if (!endpoint_.datagrams()) return ::read(fd_, bytes.data(), bytes.size());
  socklen_t size = sizeof heard_from_;
  return ::recvfrom(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&heard_from_), &size);
}

IoResult LinePort::read(std::span<std::uint8_t> bytes) WASP_REALTIME {
  if (bytes.empty()) return {IoStatus::kOk, 0};
  const ssize_t n = take(bytes);
  if (n > 0) return {IoStatus::kOk, static_cast<std::size_t>(n)};
  if (n < 0) return {status_of_errno(), 0};
  if (endpoint_.datagrams()) return {IoStatus::kWouldBlock, 0};  // an empty one
  if (endpoint_.kind == EndpointKind::kTcp) return {IoStatus::kGone, 0};
  pollfd state{fd_, POLLIN, 0};  // with VMIN 0 an empty line and a dead one both read as 0 bytes
  const bool dead = poll(&state, 1, 0) > 0 && (state.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0;
  return {dead ? IoStatus::kGone : IoStatus::kWouldBlock, 0};
}

void LinePort::adopt_peer() WASP_REALTIME {
  if (has_peer_ || endpoint_.kind != EndpointKind::kUdpListen) return;
  set_peer(fd_, heard_from_);
  has_peer_ = true;
}

void LinePort::forget_peer() WASP_REALTIME {
  if (!has_peer_) return;
  has_peer_ = false;
  sockaddr_in nobody{};
  nobody.sin_family = AF_UNSPEC;
  set_peer(fd_, nobody);
}

bool LinePort::hung_up(short poll_events) noexcept {
  if (!endpoint_.datagrams()) return (poll_events & (POLLHUP | POLLERR | POLLNVAL)) != 0;
  int error = 0;
  socklen_t size = sizeof error;
  if ((poll_events & POLLERR) != 0) getsockopt(fd_, SOL_SOCKET, SO_ERROR, &error, &size);
  return (poll_events & POLLNVAL) != 0;
}

bool LinePort::wait_readable(TimeNs deadline_ns) WASP_REALTIME {
  pollfd state{fd_, POLLIN, 0};
  for (int interruptions = 0; interruptions < 100; ++interruptions) {
    const DurationNs left = deadline_ns - rt::now();
    const timespec timeout = rt::to_timespec(left > 0 ? left : 0);
    const int ready = ppoll(&state, 1, &timeout, nullptr);
    if (ready >= 0) return ready > 0;
    if (errno != EINTR) return true;
  }
  return false;
}

bool LinePort::discard_output() WASP_REALTIME { return ioctl(fd_, TCFLSH, TCOFLUSH) == 0; }

long LinePort::pending_output_bytes() const WASP_REALTIME {
  int pending = 0;
  return endpoint_.datagrams() || ioctl(fd_, TIOCOUTQ, &pending) == 0 ? pending : -1;
}

}  // namespace wasp::drivers
