// What a flight left behind, whoever flew it: the lockstep simulation or the real process through its logs. Judges and
// figures read this and nothing else.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "types/messages.h"

namespace wasp::sim {
struct LockstepLog;
}

namespace wasp::missions {

class WorldProbe;

struct FlightTrace {
  std::vector<Truth> truth;                      ///< 20 Hz from lockstep, 200 Hz from logs
  std::vector<Command> commands;                 ///< one a control tick
  std::map<std::string, std::vector<Cue>> cues;  ///< by behaviour, in order of exposure
  std::vector<ImuSample> imu;                    ///< as the companion heard it
  TimeNs lift_off_ns = kNever;                   ///< the vehicle first left the ground

  [[nodiscard]] double seconds(TimeNs at_ns) const;  ///< since lift-off; before it negative
  /// Cues of a behaviour; none if it did not run.
  [[nodiscard]] const std::vector<Cue>& of(const std::string& behaviour) const;
  /// Truth at `at_ns`: the newest not after it, the first before that.
  [[nodiscard]] const Truth& truth_at(TimeNs at_ns) const;
};

/// `names` by Cue::behaviour.
FlightTrace trace_of(sim::LockstepLog log, const std::vector<std::string>& names);

/// Reads FOLDER/{truth,commands,cues,imu}.csv as wasp-record writes them. Throws std::runtime_error naming a file that
/// is missing.
FlightTrace read_trace(const std::filesystem::path& log_folder);

/// One line a control tick: time since lift-off, where the vehicle was (in the flight's frame
/// and in the world's) and what it was told. Throws naming the file.
void write_trace_csv(const FlightTrace& trace, const WorldProbe& probe, const std::filesystem::path& file);

/// Every cue, in the columns of wasp-record's cues.csv. Throws naming the file.
void write_cues_csv(const FlightTrace& trace, const std::filesystem::path& file);

/// Roll, pitch and heading of a truth sample [rad].
struct TruthEuler {
  double roll_rad = 0, pitch_rad = 0, yaw_rad = 0;
};
TruthEuler euler_of(const Truth& truth);

/// Spans of constant mission leg in `commands` as [first, last] indices; legs only.
struct LegSpan {
  int leg = 0;
  std::size_t first = 0, last = 0;
};
std::vector<LegSpan> legs_of(const FlightTrace& trace);

}  // namespace wasp::missions
