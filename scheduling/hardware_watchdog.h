// The board's own watchdog (linux/watchdog.h): once opened it restarts the board when nobody feeds it for 2 s.
#pragma once

#include <string>

namespace wasp::scheduling {

class HardwareWatchdog {
 public:
  static constexpr int kTimeout_s = 2;

  /// Empty path: none. Throws std::runtime_error naming the device when it cannot be opened or set.
  explicit HardwareWatchdog(const std::string& path);
  ~HardwareWatchdog();  ///< disarms it, where the driver allows that
  HardwareWatchdog(const HardwareWatchdog&) = delete;
  HardwareWatchdog& operator=(const HardwareWatchdog&) = delete;

  [[nodiscard]] bool present() const noexcept { return fd_ >= 0; }
  void feed() const noexcept;

 private:
  int fd_ = -1;
};

}  // namespace wasp::scheduling
