// How the companion computer is: load of its cores, temperatures, memory. Read from /proc and /sys by an ordinary
// thread once in a while; the link thread sends it on.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "messages/mavlink_messages.h"
#include "types/time.h"

namespace wasp::scheduling {

class ComputerWatch {
 public:
  /// `root`: where proc and sys are, for tests.
  explicit ComputerWatch(std::filesystem::path root = "/");

  /// Since the last call, or since boot at the first. What cannot be read stays at its "not known". Realtime-safe: no.
  mavlink::OnboardComputerStatus look(TimeNs now_ns);

 private:
  struct Ticks {
    std::uint64_t busy = 0, all = 0;
  };
  void read_cores(mavlink::OnboardComputerStatus& status);
  void read_memory(mavlink::OnboardComputerStatus& status) const;
  void read_temperatures(mavlink::OnboardComputerStatus& status) const;
  void read_disk(mavlink::OnboardComputerStatus& status) const;

  std::filesystem::path root_;
  std::vector<std::filesystem::path> thermal_zones_;
  std::vector<Ticks> before_;  ///< of all cores together, then of each
  std::array<std::uint8_t, 10> combined_{};
};

}  // namespace wasp::scheduling
