#include "scheduling/flight_end.h"

namespace wasp::scheduling {
namespace {

constexpr int kEndedShort = 4;

void say_counts(const FlightEnd& end, const LogLine& log) {
  const auto say = [&log](std::uint64_t n, const std::string& what) {
    if (n > 0) log(std::to_string(n) + " " + what);
  };
  if (end.replay != nullptr) {
    say(end.replay->held_back(), "times the replay held the camera back for a slow reader");
    say(end.replay->dropped(), "frames of the recording were dropped as late ([threads.camera] overrun)");
    say(end.replay->decode_errors(), "frames of the recording could not be decoded");
  }
  const RunStatus& status = end.status;
  say(status.skipped, "control releases were skipped");
  say(status.deadline_misses, "control deadlines were missed");
  say(status.commands_refused, "commands were refused as too old at the wire");
  say(status.frames_duplicate, "frames were refused as repeated");
  say(status.frames_disordered, "frames were refused as out of order");
  say(status.frames_malformed, "frames were refused as malformed");
  say(status.frames_misdated, "frames were refused as misdated");
  say(status.samples_refused, "samples of the autopilot were refused");
  say(status.setpoints_flushed, "times an old setpoint was thrown out of a stalled serial line");
  log("page faults in real-time threads: " + std::to_string(status.minor_faults) + " minor, " +
      std::to_string(status.major_faults) + " major");
}

}  // namespace

int conclude_flight(const FlightEnd& end, const LogLine& log) {
  say_counts(end, log);
  const auto result = static_cast<MissionResult>(end.status.mission_result.load());
  const bool flown = result == MissionResult::kFlown, stopped = result == MissionResult::kStoppedEarly;
  const bool idle = flown && end.status.behaviour_ticks == 0;
  log(stopped  ? "mission stopped early, in order"
      : !flown ? "mission broken off"
      : idle   ? "mission flown to its end, but no behaviour ever commanded"
               : "mission flown to its end");
  if (end.overrun_stop) log("stopped because a thread overran ([threads] overrun = \"stop\")");
  const bool damaged = end.recording_damaged || (end.replay != nullptr && end.replay->decode_errors() > 0);
  if (damaged) log("the recording is damaged: see above");
  if (damaged || (!flown && !stopped)) return 1;
  return idle || stopped ? kEndedShort : 0;
}

}  // namespace wasp::scheduling
