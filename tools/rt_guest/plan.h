// What one boot of the guest is asked to do, and the bars its figures must meet.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace wasp::tools::rt_guest {

inline constexpr double kControlRate_hz = 20.0;  ///< of config/wasp.toml

enum class JobKind {
  kFlight,    ///< frames replayed, autopilot simulated
  kFaults,    ///< faults done to flights, answers judged from the wire (faults/)
  kRights,    ///< what root is granted, and what anybody else is refused by name
  kWatchdog,  ///< the board's watchdog fed, disarmed, and left to bite: the last job of a boot
};

struct Job {
  std::string name;
  JobKind kind = JobKind::kFlight;
  std::int64_t cycles = 0;  ///< control cycles a flight must reach
  bool real_time = true;    ///< false: the same binary with --no-rt, SCHED_OTHER
  bool stressed = false;    ///< beside stress-ng
  bool timed = true;        ///< false: of faults, only whether the answer came is judged
  std::string faults = {};  ///< which, a regular expression of their names
  int fault_count = 0;      ///< how many that are, at least
  std::string module = {};  ///< of the kernel, for a watchdog

  /// Virtual time in flight.
  [[nodiscard]] int seconds() const;
  /// Its line for jobs.sh.
  [[nodiscard]] std::string line() const;
};

struct Bars {
  double release_us = 60;       ///< intended release -> control thread runs, always
  double last_byte_ms = 2;      ///< intended release -> the command's last byte, always
  double not_real_time_ms = 1;  ///< what the negative control must exceed
  double restart_ms = 2'100;    ///< the guardian's death -> the board starts again: its limit, and the last feeding
};

struct Plan {
  std::string arch;
  int cores = 1;  ///< more than one: not on virtual time, no time is judged
  std::vector<Job> jobs;
  Bars bars;
  [[nodiscard]] int seconds() const;  ///< all jobs' virtual time
};

/// How many control cycles each flight must reach.
struct Cycles {
  std::int64_t quiet = 300, stressed = 200, not_real_time = 100;
};

/// arm64: rights, the quiet flight, faults, the stressed flight, and the negative control: the same binary and load
/// without real time. amd64: rights, the quiet flight, faults, the board's watchdog.
Plan plan_boot(const std::string& arch, const Cycles& cycles);
/// Every kind of fault that a flight on replayed frames with one core can show; or those whose names `only`, a regular
/// expression without spaces, finds.
Plan plan_faults(const std::string& arch, const std::string& only = {});
/// What needs a second core: one is taken away in flight.
Plan plan_two_cores(const std::string& arch);

}  // namespace wasp::tools::rt_guest
