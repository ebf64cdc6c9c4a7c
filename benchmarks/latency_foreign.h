// Other people's real-time threads on the core that is being measured: with one of them there at control's priority or
// above, a late control says nothing of the flight.
#pragma once

#include <set>
#include <string>
#include <string_view>

namespace wasp::bench {

/// What matters of one line of /proc/PID/task/TID/stat.
struct ThreadStat {
  std::string name;
  int parent = 0, core = -1, rt_priority = 0;
};
/// rt_priority 0 and core -1 if the line is not one.
ThreadStat parse_thread_stat(std::string_view line);

/// "name (priority)" of threads at `priority` or above that last ran on `core`, except kernel threads and this process
/// with all its descendants.
std::set<std::string> foreign_real_time(int core, int priority);

}  // namespace wasp::bench
