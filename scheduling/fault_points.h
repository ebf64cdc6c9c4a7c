// Fault points of the flying process: named switches at its borders, thrown by a timeline or over a control socket
// (fault_control.h). They exist only in a flight that was started with faults; everywhere else the board is a null
// pointer and each point one never-taken branch (`wasp bench micro` measures it).
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string_view>

#include "rt/contract.h"
#include "types/time.h"

namespace wasp::scheduling {

/// What can be thrown inside the flying process. `value` of each: fault_points.cpp.
enum class FaultPoint : std::uint8_t {
  // Camera, between the ring of the camera process and the behaviours (camera_relay.h).
  kCameraFreeze,
  kCameraDrop,
  kCameraSlow,
  kCameraDisconnect,
  kCameraError,
  kCameraLate,
  kCameraReorder,
  kCameraDuplicate,
  kCameraSize,
  kCameraTornHeader,
  kCameraStampAhead,
  kCameraStampBack,
  kCameraStampStuck,
  kCameraSequenceWrap,
  kCameraSequenceRestart,
  kImageBlack,
  kImageWhite,
  kImageBlur,
  kImageNoise,
  kImageBand,
  kImageTear,
  kImageGain,
  kDepthHoles,
  kDepthNone,
  kDepthBias,
  kDepthQuantise,
  kDepthNoise,
  kDepthZero,
  kDepthFar,
  kDepthFreeze,
  kDepthDrop,
  // What the autopilot's samples say, between the link and the rings.
  kAttitudeStop,
  kAttitudeFreeze,
  kAttitudeSpike,
  kAttitudeNan,
  kAttitudeBias,
  kAttitudeSlow,
  kAttitudeStampAhead,
  kAttitudeStampBack,
  kImuStop,
  kImuFreeze,
  kImuSpike,
  kImuNan,
  kImuBias,
  kImuSlow,
  // A behaviour (which one: the switch's target), around its step.
  kBehaviourSpin,
  kBehaviourEndless,
  kBehaviourNanCue,
  kBehaviourHugeCue,
  kBehaviourDenormal,
  kBehaviourStuckCue,
  kBehaviourFutureCue,
  kBehaviourSilent,
  // Control, between what the arbiter said and the write.
  kControlStall,
  kControlSpin,
  // The process.
  kProcessAbort,
  kProcessSegv,
  kProcessDescriptors,
  kCount
};

inline constexpr std::size_t kFaultPoints = static_cast<std::size_t>(FaultPoint::kCount);

/// Where and at what a point may be aimed.
enum class FaultUse : std::uint8_t {
  kAnyFlight,
  kLiveCamera,  ///< refused in a replay, whose frames must reach their behaviours as recorded
  kBehaviour,   ///< may name a behaviour; else every one is meant
  kMoment,      ///< happens at once, lasts no time
};

/// What is known of a point.
struct FaultRow {
  std::string_view name;  ///< "camera.freeze"
  FaultUse use = FaultUse::kAnyFlight;
  float value = 0, low = 0, high = 0;  ///< default and range; low == high: it takes none
  std::string_view unit;
  std::string_view effect;  ///< one line
  [[nodiscard]] constexpr bool takes_value() const noexcept { return low < high; }
};

const FaultRow& row_of(FaultPoint point) noexcept;
std::string_view name_of(FaultPoint point) noexcept;
std::optional<FaultPoint> fault_point_named(std::string_view name) noexcept;

/// The switches. Written by the fault control thread, read by real-time threads.
class FaultBoard {
 public:
  static constexpr std::int32_t kAnyTarget = -1;

  /// On during [from, until). `target`: index of the behaviour meant, or kAnyTarget.
  void set(FaultPoint point, TimeNs from_ns, TimeNs until_ns, float value, std::int32_t target = kAnyTarget) noexcept {
    Switch& s = switches_[static_cast<std::size_t>(point)];
    s.until_ns.store(0, std::memory_order_release);  // off while it changes
    s.value.store(value, std::memory_order_relaxed);
    s.target.store(target, std::memory_order_relaxed);
    s.from_ns.store(from_ns, std::memory_order_relaxed);
    s.until_ns.store(until_ns, std::memory_order_release);
  }
  void clear(FaultPoint point) noexcept { switches_[static_cast<std::size_t>(point)].until_ns.store(0); }

  /// Realtime-safe: yes (wait-free).
  [[nodiscard]] bool on(FaultPoint point, TimeNs now_ns, std::int32_t target = kAnyTarget) const WASP_REALTIME {
    const Switch& s = switches_[static_cast<std::size_t>(point)];
    if (now_ns >= s.until_ns.load(std::memory_order_acquire)) return false;
    const std::int32_t meant = s.target.load(std::memory_order_relaxed);
    return now_ns >= s.from_ns.load(std::memory_order_relaxed) &&
           (meant == kAnyTarget || target == kAnyTarget || meant == target);
  }
  /// Realtime-safe: yes.
  [[nodiscard]] float value(FaultPoint point) const WASP_REALTIME {
    return switches_[static_cast<std::size_t>(point)].value.load(std::memory_order_relaxed);
  }

 private:
  struct Switch {
    std::atomic<TimeNs> from_ns{0}, until_ns{0};
    std::atomic<float> value{0};
    std::atomic<std::int32_t> target{kAnyTarget};
  };
  std::array<Switch, kFaultPoints> switches_{};
};

/// A value in milliseconds. Realtime-safe: yes.
inline DurationNs milliseconds_of(const FaultBoard& board, FaultPoint point) WASP_REALTIME {
  return static_cast<DurationNs>(static_cast<double>(board.value(point)) * static_cast<double>(kMillisecond));
}

/// True where a board exists and the point is on. Realtime-safe: yes; one branch without a board.
inline bool fault_on(const FaultBoard* board, FaultPoint point, TimeNs now_ns,
                     std::int32_t target = FaultBoard::kAnyTarget) WASP_REALTIME {
  return __builtin_expect(board != nullptr, 0) && board->on(point, now_ns, target);
}

}  // namespace wasp::scheduling
