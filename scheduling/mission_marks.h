// When a mission reached what a fault can be timed by: single words, written once each.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "rt/contract.h"
#include "types/time.h"

namespace wasp::scheduling {

enum class Milestone : std::uint8_t {
  kStart,    ///< every thread stands
  kArmed,    ///< the autopilot says that it is armed: take-off begins
  kFlying,   ///< 0.2 m above where it stood
  kLanding,  ///< the mission lands
  kCount
};

inline constexpr std::array<const char*, 4> kMilestoneNames = {"start", "armed", "flying", "landing"};

class MissionMarks {
 public:
  /// The first call counts. One thread a milestone. Realtime-safe: yes.
  void reach(Milestone milestone, TimeNs now_ns) WASP_REALTIME {
    auto& mark = reached_ns_[static_cast<std::size_t>(milestone)];
    if (mark.load(std::memory_order_relaxed) == 0) mark.store(now_ns, std::memory_order_relaxed);
  }
  /// 0: not yet.
  [[nodiscard]] TimeNs reached_ns(Milestone milestone) const noexcept {
    return reached_ns_[static_cast<std::size_t>(milestone)].load(std::memory_order_relaxed);
  }

 private:
  std::array<std::atomic<TimeNs>, static_cast<std::size_t>(Milestone::kCount)> reached_ns_{};
};

}  // namespace wasp::scheduling
