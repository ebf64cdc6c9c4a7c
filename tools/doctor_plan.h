// What the doctor examines for: the cores, priorities and devices of the configured flight.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "tools/doctor_system.h"
#include "types/time.h"

namespace wasp::tools {

struct DoctorPlan {
  SystemTree tree;
  std::set<int> usable_cores;  ///< this process may run on
  std::set<int> flight_cores;  ///< of the thread table, each the nearest usable one
  int core = 0;                ///< of the control thread, or as --core says
  std::set<int> priorities;    ///< SCHED_FIFO, of the thread table
  int heap_mib = 64;
  DurationNs control_deadline_ns = 10 * kMillisecond, control_budget_ns = 2 * kMillisecond;
  std::string tty;               ///< device of the configured endpoint, e.g. "/dev/ttyUSB0"; empty: a socket
  double seconds = 5;            ///< of the wake-up measurement
  std::string flight_under_way;  ///< its region, "" if none; then nothing is done that could disturb it

  [[nodiscard]] std::set<int> other_cores() const;  ///< usable ones that are not the flight's
};

/// Reads the thread table and the endpoint from wasp.toml and `config` (empty: none). `core` < 0: as configured.
/// Throws ConfigError naming file and line.
DoctorPlan plan_doctor(const std::string& config, int core, double seconds);

/// The command that grants the flight binary what it needs.
std::string setcap_command();
/// The command that runs the doctor with every right.
std::string as_root_command();

}  // namespace wasp::tools
