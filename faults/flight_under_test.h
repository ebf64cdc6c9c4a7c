// One flight with all its processes, every one a child of ours: vehicle, camera, tap, recorder, flight. Gone with the
// object, with every file in /dev/shm.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "faults/flight_plan.h"
#include "faults/flight_watch.h"
#include "faults/gateway_daemon.h"
#include "faults/recorder_account.h"
#include "faults/wire_reader.h"
#include "faults/wire_tap.h"
#include "tools/child_process.h"
#include "tools/wakeup_loop.h"

namespace wasp::faults {

/// A line of the flight's (or guardian's) log.
struct LogLine {
  TimeNs at_ns = 0;
  std::string text;
};

class FlightUnderTest {
 public:
  /// Starts everything. Throws std::runtime_error with what did not come up.
  explicit FlightUnderTest(const FlightPlan& plan);
  ~FlightUnderTest();
  FlightUnderTest(const FlightUnderTest&) = delete;
  FlightUnderTest& operator=(const FlightUnderTest&) = delete;

  /// True once the flight is where the phase begins; false when it ended, or after `patience_s`.
  bool wait_for(Phase phase, double patience_s);
  /// Commanded by behaviours (idle: on the ground, disarmed), now.
  [[nodiscard]] bool commanded(Phase phase);
  /// True once the phase is over for good: high enough, or nearly down.
  [[nodiscard]] bool past(Phase phase);
  /// Besides, where faults of the phase may begin.
  [[nodiscard]] bool settled(Phase phase);
  /// The flight process, or the guardian above it, still runs.
  [[nodiscard]] bool running();
  /// Its exit code, once it has ended.
  std::optional<int> exit_code();
  /// From now on the flight's end counts, not its guardian's: that one is about to die.
  void orphan_flight();
  /// Ends it in order (lands) or, when it does not within `patience_s`, by force.
  int end(double patience_s);

  /// Process of a name: "flight" (the one that flies, below a guardian), "guardian", "camera", "sim", an observer's;
  /// -1: there is none.
  [[nodiscard]] pid_t pid_of(std::string_view name) const;
  /// Thread of the flight process by its name, -1: there is none.
  [[nodiscard]] pid_t thread_of(std::string_view name) const;
  /// Starts the camera (again).
  void start_camera();
  void start_observer(std::string_view name);
  /// The recorder, on a disk of 256 KiB that only it sees.
  void start_recorder_on_small_disk();
  /// Ends the recorder in order and reads what it says of itself; after end().
  RecorderAccount recorder_account();
  /// One request over the fault socket; its answer.
  std::string ask_flight(const std::string& request);

  /// What went over the wire until now.
  const WireReader& wire();
  [[nodiscard]] WireTap& tap() { return *tap_; }
  [[nodiscard]] FlightWatch& watch() { return *watch_; }
  [[nodiscard]] const FlightPlan& plan() const { return plan_; }
  [[nodiscard]] std::vector<LogLine> log() const;
  /// Wake-ups of the reference loop beside; after end().
  std::vector<tools::Wakeup> reference();

 private:
  void end_orphan(double patience_s);
  void wait_until_there(const std::string& path, tools::ChildProcess& by);

  FlightPlan plan_;
  std::optional<tools::ChildProcess> sim_, camera_, flight_;
  pid_t orphan_ = -1;  ///< the flight process whose guardian is dead; ours to reap
  std::optional<int> orphan_code_;
  std::unique_ptr<GatewayDaemon> daemon_;  ///< before the gateway, which it serves
  std::map<std::string, tools::ChildProcess, std::less<>> observers_;
  std::filesystem::path recording_;  ///< of the newest recorder
  int recordings_ = 0;
  std::unique_ptr<WireTap> tap_;
  std::unique_ptr<FlightWatch> watch_;
  std::unique_ptr<tools::WakeupLoop> reference_;
  WireReader wire_;
  int held_ = 0;  ///< the tap's fault that keeps the flight on the ground
};

/// Process ids of the children of a process.
std::vector<pid_t> children_of(pid_t pid);
/// Thread ids of a process with their names.
std::vector<std::pair<pid_t, std::string>> threads_of(pid_t pid);

}  // namespace wasp::faults
