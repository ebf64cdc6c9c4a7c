// The regions a flight process writes and reads.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "scheduling/stage_table.h"
#include "shm/region.h"
#include "types/camera.h"

namespace wasp::scheduling {

/// Which rings a flight's region has for its behaviours.
struct BehaviourRings {
  std::vector<std::string> names = {};   ///< all behaviours, in the order of Cue::behaviour
  std::vector<std::string> silent = {};  ///< those that are not enabled: no cue ring
  std::vector<std::string> flows = {};   ///< topics of flow fields
};

/// Creates wasp.<instance>.flight with imu, attitude, command, one cue topic per enabled behaviour, flow fields, stages
/// and run. A region left by a crashed flight is taken over with its history; its counters start anew, or go on with
/// `keep_history`, for a flying process started again.
shm::Region create_flight_region(const std::string& instance, const BehaviourRings& behaviours, bool real_time,
                                 bool keep_history = false);

StageTable& stage_table(const shm::Region& flight);
RunStatus& run_status(const shm::Region& flight);

/// Waits for wasp.<instance>.camera, written by another process, to offer the streams. Throws std::runtime_error after
/// `patience_s`, or as soon as `cancelled` says so.
shm::Region attach_camera(const std::string& instance, double patience_s, const std::function<bool()>& cancelled);

/// Throws std::runtime_error naming both sizes if the newest frame of a stream is of another one than `section` of the
/// configuration promises. A stream that has shown nothing yet passes: its frames are judged one by one.
void check_frame_size(const shm::Region& camera, const char* topic, const Intrinsics& promised, const char* section);

}  // namespace wasp::scheduling
