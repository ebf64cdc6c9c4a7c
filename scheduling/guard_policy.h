// What the guardian decides at one look, pure: the beat of the control thread and whether the flying process lives ->
// whose line it is, whether to speak, whether to kill. No clock, no process, no line: guardian.cpp has those.
//
// The control thread says in every tick when its next release falls due. A release that is `patience` overdue while an
// armed vehicle hangs on the stream means: speak, neutral, now, at the control rate, for `neutral` at most, then be
// silent so that the autopilot's own failsafe acts. A beat gives the line back. A process that has not beaten for
// `kill_after` is killed; one that is dead is started again, and never commands.
#pragma once

#include "types/realtime.h"
#include "types/time.h"

namespace wasp::scheduling {

struct GuardTimes {
  DurationNs patience_ns = 20 * kMillisecond;     ///< after a release fell due
  DurationNs kill_after_ns = 200 * kMillisecond;  ///< likewise
  DurationNs neutral_ns = 2 * kSecond;            ///< how long neutral is sent; 0: the stream stops at once
  DurationNs period_ns = 50 * kMillisecond;       ///< between two neutral setpoints
  DurationNs late_ns = 3 * kMillisecond;          ///< a look this much later than planned: the host held us up as well
};

/// What is seen at one look.
struct GuardSight {
  TimeNs now_ns = 0;
  DurationNs woken_late_ns = 0;            ///< this look was planned so much earlier
  bool alive = false;                      ///< the flying process
  bool commanding = false;                 ///< setpoints went out to an armed vehicle (of a dead process: when it died)
  TimeNs beat_at_ns = 0, next_due_ns = 0;  ///< of the control thread; next_due 0: it does not run (yet)
};

struct GuardState {
  bool ours = false;       ///< the line is the guardian's
  bool restarted = false;  ///< the process at hand never commands
  TimeNs taken_at_ns = 0, beat_at_taking_ns = 0, speak_at_ns = 0;
  TimeNs forgiven_due_ns = 0;  ///< the release for which one more look was granted
};

struct GuardDeed {
  bool take = false, give_back = false;  ///< the line
  bool speak = false;                    ///< a neutral setpoint, now
  bool kill = false;                     ///< the flying process hangs
  TimeNs look_again_at_ns = 0;
};

/// Realtime-safe: yes.
GuardDeed guard_step(const GuardTimes& times, const GuardSight& sight, GuardState& state) WASP_REALTIME;

}  // namespace wasp::scheduling
