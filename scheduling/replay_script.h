// What the behaviours were given when a recording was made: for each behaviour, the frames it stepped on (for one that
// reads flow: the second frame of each field) and the exact attitude and specific force. Replaying with it gives the
// same cues to the bit, whatever the timing of the replay.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "types/messages.h"
#include "types/realtime.h"

namespace wasp::scheduling {

struct ScriptedStep {
  std::uint32_t frame_sequence = 0;
  TimeNs exposed_at_ns = 0;
  bool attitude_valid = false;
  AttitudeSample attitude;
  bool accel_valid = false;  ///< false throughout in recordings older than these columns
  std::array<float, 3> accel_body_mps2{};
};

/// Steps of one behaviour in order of frames.
using BehaviourScript = std::vector<ScriptedStep>;

/// Reads `folder`/cues.csv as wasp-record writes it. Empty if the file is absent. Throws std::runtime_error naming file
/// and line if it is malformed.
std::map<std::string, BehaviourScript> load_replay_script(const std::string& folder);

/// Step for a frame, nullptr if the behaviour skipped it when the recording was made. Realtime-safe: yes.
const ScriptedStep* find_step(const BehaviourScript& script, std::uint32_t frame_sequence) WASP_REALTIME;

}  // namespace wasp::scheduling
