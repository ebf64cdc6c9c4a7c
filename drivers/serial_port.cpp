#include "drivers/serial_port.h"

#include <fcntl.h>
#include <linux/serial.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "drivers/line_handover.h"
#include "rt/clock.h"

namespace wasp::drivers {
namespace {

struct BaudRow {
  unsigned baud;
  speed_t code;
};
constexpr std::array kBauds{BaudRow{1200, B1200},       BaudRow{2400, B2400},       BaudRow{4800, B4800},
                            BaudRow{9600, B9600},       BaudRow{19200, B19200},     BaudRow{38400, B38400},
                            BaudRow{57600, B57600},     BaudRow{115200, B115200},   BaudRow{230400, B230400},
                            BaudRow{460800, B460800},   BaudRow{500000, B500000},   BaudRow{576000, B576000},
                            BaudRow{921600, B921600},   BaudRow{1000000, B1000000}, BaudRow{1152000, B1152000},
                            BaudRow{1500000, B1500000}, BaudRow{2000000, B2000000}, BaudRow{2500000, B2500000},
                            BaudRow{3000000, B3000000}, BaudRow{3500000, B3500000}, BaudRow{4000000, B4000000}};

/// 0 (B0 hangs up, so it is never a wish) for a rate termios lacks.
speed_t baud_code(unsigned baud) noexcept {
  for (const BaudRow& row : kBauds)
    if (row.baud == baud) return row.code;
  return B0;
}

/// 8N1, no flow control, no translation, no DTR drop on close. False with errno set.
bool set_raw(int fd, unsigned baud) noexcept {
  termios line{};
  if (tcgetattr(fd, &line) != 0) return false;
  cfmakeraw(&line);
  line.c_cflag |= CLOCAL | CREAD;
  line.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS | HUPCL);
  line.c_cc[VMIN] = 0;
  line.c_cc[VTIME] = 0;
  return cfsetspeed(&line, baud_code(baud)) == 0 && tcsetattr(fd, TCSANOW, &line) == 0;
}

/// Asks the driver to pass bytes on at once (FTDI holds them back for 16 ms otherwise). Not every driver knows it.
void ask_low_latency(int fd) noexcept {
  serial_struct serial{};
  if (ioctl(fd, TIOCGSERIAL, &serial) != 0) return;
  serial.flags |= ASYNC_LOW_LATENCY;
  static_cast<void>(ioctl(fd, TIOCSSERIAL, &serial));
}

/// A pseudo-terminal's line end: a simulator is behind it.
bool is_pseudo_terminal(int fd) noexcept {
  constexpr unsigned kFirstMajor = 136, kLastMajor = 143;  // Unix98 slaves, Linux devices.txt
  struct stat info {};
  return fstat(fd, &info) == 0 && major(info.st_rdev) >= kFirstMajor && major(info.st_rdev) <= kLastMajor;
}

/// The lock keeps other instances out and dies with the process; TIOCEXCL keeps out programs that probe modems. A
/// pseudo-terminal goes without TIOCEXCL: nobody probes it, and where the simulator holds the line end open as well the
/// flag would outlive a killed process and shut out its successor.
bool take_exclusive(int fd) noexcept {
  return flock(fd, LOCK_EX | LOCK_NB) == 0 && (is_pseudo_terminal(fd) || ioctl(fd, TIOCEXCL) == 0);
}

IoStatus status_of_errno() noexcept {
  return errno == EAGAIN || errno == EINTR ? IoStatus::kWouldBlock : IoStatus::kGone;
}

[[noreturn]] void refuse(std::string_view text, const std::string& why) {
  throw std::runtime_error("serial endpoint \"" + std::string(text) + "\": " + why);
}

}  // namespace

SerialEndpoint SerialEndpoint::parse(std::string_view text) {
  constexpr std::string_view kScheme = "serial:";
  constexpr const char* kForm = "expected serial:<device>:<baud>, for example serial:/dev/ttyUSB0:921600";
  if (!text.starts_with(kScheme)) refuse(text, kForm);
  const std::string_view rest = text.substr(kScheme.size());
  const auto colon = rest.rfind(':');
  if (colon == std::string_view::npos || colon == 0) refuse(text, kForm);
  SerialEndpoint endpoint{std::string(rest.substr(0, colon)), 0};
  if (endpoint.path.front() != '/') refuse(text, "device \"" + endpoint.path + "\" is not an absolute path");
  const std::string_view baud = rest.substr(colon + 1);
  const auto [end, error] = std::from_chars(baud.begin(), baud.end(), endpoint.baud);
  if (error != std::errc{} || end != baud.end())
    refuse(text, "baud rate \"" + std::string(baud) + "\" is not a number");
  if (baud_code(endpoint.baud) == B0) refuse(text, "baud rate " + std::string(baud) + " is not one termios has");
  return endpoint;
}

SerialPort::SerialPort(SerialEndpoint endpoint) : endpoint_(std::move(endpoint)) {
  const int device = open_device();
  if (device < 0)
    throw std::runtime_error("serial device " + endpoint_.path + " at " + std::to_string(endpoint_.baud) +
                             " baud: " + std::generic_category().message(last_error_));
  nothing_fd_ = ::open("/", O_PATH | O_CLOEXEC);
  fd_ = device;
}

SerialPort::SerialPort(SerialEndpoint endpoint, LineGift gift)
    : endpoint_(std::move(endpoint)), socket_fd_(gift.socket_fd), nothing_fd_(::open("/", O_PATH | O_CLOEXEC)) {
  fd_ = gift.line_fd;
  for (const int fd : {fd_, socket_fd_}) fcntl(fd, F_SETFD, FD_CLOEXEC);
}

SerialPort::~SerialPort() {
  ::close(fd_);
  if (socket_fd_ >= 0) ::close(socket_fd_);
  if (nothing_fd_ >= 0) ::close(nothing_fd_);
}

/// A descriptor of the device, set up; -1 with last_error_ set.
int SerialPort::open_device() noexcept {
  last_error_ = 0;
  const int fd = ::open(endpoint_.path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd >= 0 && isatty(fd) == 1 && take_exclusive(fd) && set_raw(fd, endpoint_.baud)) {
    ask_low_latency(fd);
    tcflush(fd, TCIFLUSH);  // what waited in the buffer would be stamped as new
    return fd;
  }
  last_error_ = errno;
  if (fd >= 0) ::close(fd);
  return -1;
}

/// The device, from where this port has it.
int SerialPort::obtain_device() noexcept {
  if (socket_fd_ < 0) return open_device();
  const int device = take_descriptor(socket_fd_);
  last_error_ = device < 0 ? ENODEV : 0;
  return device;
}

void SerialPort::release() noexcept { dup3(nothing_fd_, fd_, O_CLOEXEC); }

bool SerialPort::try_reopen() noexcept {
  release();
  const int device = obtain_device();
  if (device < 0) return false;
  const bool swapped = dup3(device, fd_, O_CLOEXEC) == fd_;
  ::close(device);
  return swapped;
}

IoResult SerialPort::write(std::span<const std::uint8_t> bytes) WASP_REALTIME {
  if (bytes.empty()) return {IoStatus::kOk, 0};
  const ssize_t n = ::write(fd_, bytes.data(), bytes.size());
  if (n > 0) {
    written_total_.fetch_add(static_cast<std::uint64_t>(n), std::memory_order_relaxed);
    return {IoStatus::kOk, static_cast<std::size_t>(n)};
  }
  return {n == 0 ? IoStatus::kWouldBlock : status_of_errno(), 0};
}

IoResult SerialPort::read(std::span<std::uint8_t> bytes) WASP_REALTIME {
  if (bytes.empty()) return {IoStatus::kOk, 0};
  const ssize_t n = ::read(fd_, bytes.data(), bytes.size());
  if (n > 0) return {IoStatus::kOk, static_cast<std::size_t>(n)};
  if (n < 0) return {status_of_errno(), 0};
  pollfd state{fd_, POLLIN, 0};  // with VMIN 0 an empty line and a dead one both read as 0 bytes
  const bool dead = poll(&state, 1, 0) > 0 && (state.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0;
  return {dead ? IoStatus::kGone : IoStatus::kWouldBlock, 0};
}

bool SerialPort::wait_readable(TimeNs deadline_ns) WASP_REALTIME {
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

bool SerialPort::discard_output() WASP_REALTIME { return ioctl(fd_, TCFLSH, TCOFLUSH) == 0; }

long SerialPort::pending_output_bytes() const WASP_REALTIME {
  int pending = 0;
  return ioctl(fd_, TIOCOUTQ, &pending) == 0 ? pending : -1;
}

}  // namespace wasp::drivers
