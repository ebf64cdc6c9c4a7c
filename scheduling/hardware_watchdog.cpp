#include "scheduling/hardware_watchdog.h"

#include <fcntl.h>
#include <linux/watchdog.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace wasp::scheduling {

HardwareWatchdog::HardwareWatchdog(const std::string& path) {
  if (path.empty()) return;
  fd_ = open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (fd_ < 0) throw std::runtime_error("hardware watchdog " + path + ": " + std::strerror(errno));
  int seconds = kTimeout_s;
  if (ioctl(fd_, WDIOC_SETTIMEOUT, &seconds) == 0 && seconds <= kTimeout_s) return;
  const std::string why = seconds > kTimeout_s ? "it takes at least " + std::to_string(seconds) + " s"
                                               : "its time cannot be set: " + std::string(std::strerror(errno));
  HardwareWatchdog::~HardwareWatchdog();
  throw std::runtime_error("hardware watchdog " + path + ": " + why);
}

HardwareWatchdog::~HardwareWatchdog() {
  if (fd_ < 0) return;
  static_cast<void>(!write(fd_, "V", 1));  // "magic close": else the board restarts
  close(fd_);
  fd_ = -1;
}

void HardwareWatchdog::feed() const noexcept {
  if (fd_ >= 0) static_cast<void>(!write(fd_, "w", 1));
}

}  // namespace wasp::scheduling
