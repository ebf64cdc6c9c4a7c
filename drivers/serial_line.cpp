#include "drivers/serial_line.h"

#include <fcntl.h>
#include <linux/serial.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>

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

}  // namespace

bool has_baud_rate(unsigned baud) noexcept { return baud_code(baud) != B0; }

int open_serial_line(const Endpoint& endpoint) noexcept {
  const int fd = ::open(endpoint.path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd >= 0 && isatty(fd) == 1 && take_exclusive(fd) && set_raw(fd, endpoint.baud)) {
    ask_low_latency(fd);
    tcflush(fd, TCIFLUSH);  // what waited in the buffer would be stamped as new
    return fd;
  }
  const int error = errno;
  if (fd >= 0) ::close(fd);
  errno = error;
  return -1;
}

}  // namespace wasp::drivers
