// What becomes of an exposure in the camera relay: decided once, when its first frame comes, and kept for its other
// frames, so that depth and grey meet the same faults and stay in order.
#pragma once

#include <array>

#include "scheduling/fault_points.h"
#include "scheduling/fault_random.h"
#include "types/messages.h"

namespace wasp::scheduling {

struct Fate {
  std::uint32_t sequence = 0;
  TimeNs exposed_at_ns = kNever;  ///< kNever: of no exposure
  std::uint64_t points = 0;       ///< bit i: point i is on (the camera's points are the first)
  bool lost = false;              ///< dropped, or one too many for camera.slow
  bool held = false;              ///< comes after the next exposure
  std::uint32_t sequence_shown = 0;
  TimeNs exposed_shown_ns = 0;  ///< what the header will say
  [[nodiscard]] bool has(FaultPoint point) const WASP_REALTIME {
    return (points >> static_cast<unsigned>(point) & 1) != 0;
  }
};
static_assert(static_cast<unsigned>(FaultPoint::kDepthDrop) < 64);

/// The exposures of one camera, relay thread only.
class CameraFates {
 public:
  /// Realtime-safe: yes.
  const Fate& of(const FrameHeader& header, const FaultBoard* board, TimeNs now_ns) WASP_REALTIME;

 private:
  void decide(Fate& fate, const FaultBoard& board, TimeNs now_ns) WASP_REALTIME;
  void stamp(Fate& fate, const FaultBoard& board) WASP_REALTIME;
  void count(Fate& fate, const FaultBoard& board) WASP_REALTIME;

  std::array<Fate, 8> kept_;  ///< as many as a ring has slots
  std::size_t next_ = 0;
  Fate last_;                       ///< decided before this one
  TimeNs passed_at_ns_ = kNever;    ///< the last exposure that was not lost
  TimeNs stuck_ns_ = 0;             ///< stamp of the first exposure of camera.stamp_stuck
  std::uint32_t counted_from_ = 0;  ///< true sequence at which a count of its own began
  FaultRandom random_;
};

}  // namespace wasp::scheduling
