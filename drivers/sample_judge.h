// What the autopilot's samples must be like to be used: finite, within what a sensor can read, in order of their times,
// changing, and - an attitude - no further from the last one than a vehicle can have turned. Pure: no clock, no
// ring.
//
// An attitude that jumps is refused until kAgree samples in a row agree with each other: a spike is over by then, a
// reset of the autopilot's estimator is not. Values that repeat bit for bit for kFrozenFor count as no samples at all,
// so that the age limits act as if the stream had stopped: noise makes every reading of a living sensor another number.
#pragma once

#include <cstdint>

#include "rt/contract.h"
#include "types/messages.h"

namespace wasp::drivers {

enum class SampleFault : std::uint8_t { kNone = 0, kNotFinite, kOutOfRange, kJump, kFrozen, kMisdated };

/// "not finite" etc.
const char* name_of(SampleFault fault) WASP_REALTIME;

/// Counts how long values stay the same to the bit.
class FreezeWatch {
 public:
  static constexpr DurationNs kFrozenFor = 100 * kMillisecond;
  static constexpr DurationNs kCoarseFrozenFor = 2 * kSecond;  ///< of whole mG and mrad/s, which repeat at rest
  static constexpr int kFrozenSamples = 3;

  /// True once the same values were given for kFrozenFor, and kFrozenSamples times after the first.
  bool frozen(bool same, TimeNs received_at_ns, DurationNs for_ns = kFrozenFor) WASP_REALTIME {
    if (!same) repeats_ = 0, since_ns_ = received_at_ns;
    if (same && repeats_ < kFrozenSamples) ++repeats_;
    return repeats_ >= kFrozenSamples && received_at_ns - since_ns_ >= for_ns;
  }

 private:
  int repeats_ = 0;
  TimeNs since_ns_ = 0;
};

/// Accelerometers are set to 16 g, gyroscopes to 2000 degrees per second; a little more, for their scale.
inline constexpr float kMostAccel_mps2 = 165.f, kMostRate_radps = 36.f;

/// One stream; one thread. Realtime-safe: yes.
class ImuJudge {
 public:
  /// kNone: to be used.
  SampleFault judge(const ImuSample& sample, TimeNs received_at_ns) WASP_REALTIME;

 private:
  FreezeWatch freeze_;
  ImuSample before_;  ///< the last one given, used or not
  TimeNs used_at_ns_ = kNever;
};

/// One stream; one thread. Realtime-safe: yes.
class AttitudeJudge {
 public:
  static constexpr int kAgree = 5;  ///< samples that make a reset out of a jump
  /// No rotor turns a vehicle faster than this into another rate: a jump that brings its own rates is one all the same.
  static constexpr float kRateJump_radps = 5.f, kMostSpin_radps2 = 500.f;
  static constexpr float kJump_rad = 0.2f;                    ///< beyond what the rates explain
  static constexpr float kRateTrust = 1.5f;                   ///< rates change between two samples
  static constexpr DurationNs kLongGap = 500 * kMillisecond;  ///< after it nothing is known of what was between

  /// kNone: to be used.
  SampleFault judge(const AttitudeSample& sample, TimeNs received_at_ns) WASP_REALTIME;

 private:
  SampleFault look(const AttitudeSample& sample) WASP_REALTIME;

  FreezeWatch freeze_;
  AttitudeSample before_, used_, doubted_;
  bool any_ = false, used_any_ = false;
  int agreeing_ = 0;  ///< doubted samples in a row that agree
};

}  // namespace wasp::drivers
