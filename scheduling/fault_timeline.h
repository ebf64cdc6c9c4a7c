// A timeline: which fault, how long after which event of the mission. A TOML file of [[fault]] rows (docs/faults.md).
#pragma once

#include "scheduling/fault_order.h"
#include "scheduling/mission_marks.h"
#include "scheduling/toml_table.h"

namespace wasp::scheduling {

struct TimedFault {
  Milestone after = Milestone::kStart;
  DurationNs delay_ns = 0;  ///< after that milestone
  FaultOrder order;
};

/// In the order of the file. Throws ConfigError naming file, line and reason: unknown keys and names, values out of
/// range, what this flight cannot have, and a file without a fault.
std::vector<TimedFault> load_fault_timeline(const std::string& path, const FaultScope& scope);
/// The same of a stream; `name` stands in error messages.
std::vector<TimedFault> read_fault_timeline(std::istream& text, const std::string& name, const FaultScope& scope);

}  // namespace wasp::scheduling
