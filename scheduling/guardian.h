// The guardian: the tiny parent of the flying process. It opens the serial line, keeps it, and starts the flight with
// it; it reads the beat of the control thread from one shared page, and when the flight dies, freezes or its control
// thread stops beating it speaks in its place: neutral, or silence on purpose, as configured; then it starts the flight
// again, which never commands any more. The successor of a flight that hangs is started at once and waits, its
// configuration read, until that one has been killed or has come back. What is decided when: guard_policy.h.
#pragma once

#include <memory>

#include "drivers/autopilot_link.h"
#include "drivers/line_port.h"
#include "scheduling/flight_child.h"
#include "scheduling/guard_config.h"
#include "scheduling/guard_page.h"
#include "scheduling/hardware_watchdog.h"

namespace wasp::scheduling {

class Guardian {
 public:
  /// Opens line and watchdog; throws std::runtime_error naming the device. `command` is the flight's command line.
  Guardian(GuardPlan plan, std::vector<std::string> command, bool real_time);
  ~Guardian();
  Guardian(const Guardian&) = delete;
  Guardian& operator=(const Guardian&) = delete;

  /// Starts the flight and watches until it has ended; its exit code, or 128 + the signal that ended it.
  int run();

 private:
  std::unique_ptr<FlightChild> child();
  void prepare_successor();
  void start();
  [[nodiscard]] bool may_restart() const;
  void wait(TimeNs until_ns);
  void take_signals();
  void tend_line();
  [[nodiscard]] GuardSight sight(TimeNs planned_ns);
  void act(const GuardDeed& deed, TimeNs now_ns);
  void speak(TimeNs now_ns);
  bool ended(const ProcessEnd& end);

  GuardPlan plan_;
  std::vector<std::string> command_;
  bool real_time_;
  cpu_set_t cores_{};
  int signals_fd_ = -1;
  drivers::LinePort port_;
  HardwareWatchdog watchdog_;
  GuardPage page_;
  std::unique_ptr<drivers::LinkSigning> signing_;  ///< of a signed line
  drivers::AutopilotLink voice_;                   ///< encodes
  std::unique_ptr<FlightChild> flight_, successor_;
  GuardState state_;
  TimeNs heartbeat_due_ns_ = 0;
  bool line_gone_ = false, killed_ = false, reported_end_ = false;
  std::uint64_t spoken_ = 0;  ///< setpoints since the line was taken
};

}  // namespace wasp::scheduling
