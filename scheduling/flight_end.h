// What a flight says when it is over, and its exit code.
#pragma once

#include "scheduling/arming.h"
#include "scheduling/replay_camera.h"
#include "scheduling/stage_table.h"

namespace wasp::scheduling {

struct FlightEnd {
  const RunStatus& status;
  bool overrun_stop = false;       ///< a thread with the policy "stop" overran
  bool recording_damaged = false;  ///< frames of it were unreadable from the start
  const ReplayCamera* replay = nullptr;
};

/// Says the counters a user must hear and how the mission ended. Returns 0: flown to its end, and behaviours commanded
/// it; 1: broken off, or the recording is damaged; 4: ended in order, but short of its purpose.
int conclude_flight(const FlightEnd& end, const LogLine& log);

}  // namespace wasp::scheduling
