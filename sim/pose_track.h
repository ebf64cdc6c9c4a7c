// The path of a vehicle that somebody else flies, put together from attitudes and positions that arrive apart and at
// their own rates, and read at the instant of an exposure: always between two samples, never beyond them. Between
// positions a cubic through both velocities, between attitudes both ends turned towards each other by their own rates:
// third-order exact, so that 10 Hz do for a vehicle that does not throw itself about. No clock: instants come as
// arguments.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "sim/pose.h"

namespace wasp::sim {

struct AttitudeFix {
  TimeNs at_ns = kNever;
  Quat q_ned_body = Quat::Identity();
  Vec3 rate_body_radps = Vec3::Zero();
};

/// In the world, not in the autopilot's own frame (pose_placement.h).
struct PositionFix {
  TimeNs at_ns = kNever;
  Vec3 position_ned_m = Vec3::Zero(), velocity_ned_mps = Vec3::Zero();
};

/// The latest samples of one kind, rising in time.
template <class Fix>
class FixHistory {
 public:
  static constexpr std::size_t kKept = 128;
  /// Of a time not after the last one: false, and nothing is kept.
  bool add(const Fix& fix) {
    if (count_ > 0 && fix.at_ns <= newest().at_ns) return false;
    fixes_[count_++ % kKept] = fix;
    return true;
  }
  void clear() { count_ = 0; }
  [[nodiscard]] bool empty() const { return count_ == 0; }
  [[nodiscard]] const Fix& newest() const { return fixes_[(count_ - 1) % kKept]; }
  /// The last one not after `at_ns`, and the one behind it.
  struct Pair {
    Fix before, after;
  };
  [[nodiscard]] std::optional<Pair> around(TimeNs at_ns) const {
    for (std::size_t n = count_; n > 1 && count_ - n < kKept - 1; --n) {
      const Fix& before = fixes_[(n - 2) % kKept];
      if (before.at_ns <= at_ns) {
        const Fix& after = fixes_[(n - 1) % kKept];
        if (after.at_ns < at_ns) return std::nullopt;
        return Pair{before, after};
      }
    }
    return std::nullopt;
  }

 private:
  std::array<Fix, kKept> fixes_{};
  std::size_t count_ = 0;
};

class PoseTrack {
 public:
  /// Two samples farther apart have nothing known between them: 4 Hz with one of them lost still counts.
  static constexpr DurationNs kLongestGap = 600 * kMillisecond;
  /// Positions that their velocities do not explain, by more than this and half the way: a reset of the estimator.
  static constexpr float kJump_m = 1.f;

  void add(const AttitudeFix& fix) { attitudes_.add(fix); }
  /// True if the position jumped: nothing is told of the time between this and the last one.
  bool add(const PositionFix& fix);
  /// Another vehicle, or another clock: all is forgotten.
  void clear();

  /// nullopt where either is not known on both sides of `at_ns`.
  [[nodiscard]] std::optional<BodyPose> at(TimeNs at_ns) const;
  /// Until when both are known; kNever when one is not.
  [[nodiscard]] TimeNs known_until_ns() const;

 private:
  FixHistory<AttitudeFix> attitudes_;
  FixHistory<PositionFix> positions_;
  TimeNs jumped_after_ns_ = kNever, jumped_at_ns_ = kNever;  ///< the last jump lies between these
};

}  // namespace wasp::sim
