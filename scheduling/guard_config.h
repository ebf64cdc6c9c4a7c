// [guardian] of the configuration, for the guardian itself and for the strict reading of the whole file.
#pragma once

#include <string>
#include <vector>

#include "scheduling/autopilot_config.h"
#include "scheduling/guard_policy.h"
#include "scheduling/toml_table.h"

namespace wasp::scheduling {

struct GuardConfig {
  GuardTimes times;
  bool neutral = true;   ///< false: the stream stops at once, and the autopilot's own failsafe acts
  int restarts = 1;      ///< of a flying process that died or hung; it never commands again
  int core = 0;          ///< another one than control's
  int priority = 90;     ///< SCHED_FIFO, above every thread of the flight
  std::string watchdog;  ///< hardware watchdog to feed, e.g. /dev/watchdog; empty: none
};

/// Everything the guardian needs to know, read before the flight's own, strict reading.
struct GuardPlan {
  GuardConfig guard;
  AutopilotConfig autopilot;
};

/// Takes the keys of [guardian]; throws ConfigError.
void read_guardian(TomlTable t, GuardConfig& config);

/// The defaults, then `paths` in order. Other sections are the flying process' business. Throws ConfigError.
GuardPlan load_guard_plan(const std::vector<std::string>& paths);

}  // namespace wasp::scheduling
