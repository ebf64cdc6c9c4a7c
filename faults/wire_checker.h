// Holds what went over the wire against what must hold of every setpoint, whatever the fault: a pure function of bytes,
// of what the flight wrote into its own command ring and of what the camera showed.
#pragma once

#include <string>
#include <vector>

#include "faults/stretch.h"
#include "faults/wire_reader.h"
#include "types/messages.h"

namespace wasp::faults {

struct WireLimits {
  float max_tilt_rad = 0.2618f;
  float max_yaw_rate_radps = 0.8f;
  DurationNs period_ns = 50 * kMillisecond;
  DurationNs longest_gap_ns =
      160 * kMillisecond;  ///< between setpoints to an armed vehicle: three periods and a tick's lateness
  DurationNs cue_age_ns = 250 * kMillisecond;  ///< evidence at the time on the wire
  DurationNs slack_ns = 2 * kMillisecond;      ///< from the flight's write to our time stamp
};

enum class Offence : std::uint8_t {
  kNotFinite,   ///< a number that is none
  kNoRotation,  ///< a quaternion whose length is not 1
  kTilt,        ///< beyond the configured limit
  kYawRate,
  kThrust,
  kResent,        ///< the bytes of an earlier setpoint once more
  kGap,           ///< silence towards an armed vehicle
  kRearmed,       ///< a request to arm after the vehicle had been armed and disarmed, or a second process' request
  kNotOurs,       ///< no control tick made it
  kOldEvidence,   ///< rests on a frame older than the limit
  kNoSuchFrame,   ///< rests on an exposure that the camera never showed
  kTaintedFrame,  ///< rests on a frame that was made under a fault and had to be known bad
  kCount
};
const char* name_of(Offence offence);

struct Violation {
  Offence offence = Offence::kNotFinite;
  TimeNs at_ns = 0;
  double value = 0;   ///< how much: rad, 1, ms
  std::string bytes;  ///< hex of the setpoint
  /// Gaps and ages: how long the line held the setpoint back, from the flight's own "written" to our time stamp; a
  /// pseudo-terminal is emptied by an ordinary kernel thread.
  double held_ms = 0;
};

struct WireEvidence {
  std::vector<Command> commands;      ///< of the flight's ring, in order; empty: not joined
  std::vector<TimeNs> exposures;      ///< that the camera showed, rising; empty: not joined
  std::vector<Stretch> gaps_excused;  ///< silence is what the fault causes, or what is promised
  std::vector<Stretch>
      not_joined;                ///< the guardian speaks, a process that died could not write its ring, we were blind
  std::vector<Stretch> unseen;   ///< exposures that we may have missed ourselves
  std::vector<Stretch> tainted;  ///< exposures that must not be used any more
};

/// In order of time.
std::vector<Violation> check_wire(const WireReader& wire, const WireLimits& limits, const WireEvidence& evidence);

/// The command each setpoint belongs to (index into `commands`), -1: none.
std::vector<int> join(const std::vector<Setpoint>& setpoints, const std::vector<Command>& commands);

}  // namespace wasp::faults
