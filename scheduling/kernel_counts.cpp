#include "scheduling/kernel_counts.h"

#include <unistd.h>

#include <fstream>

namespace wasp::scheduling {

std::optional<ThreadCounts> thread_counts(int tid) {
  std::ifstream file("/proc/self/task/" + std::to_string(tid) + "/schedstat");
  ThreadCounts c;
  if (file >> c.ran_ns >> c.run_delay_ns >> c.slices) return c;
  return std::nullopt;
}

std::optional<CoreCounts> core_counts(int core) {
  std::ifstream file("/proc/stat");
  const std::string wanted = "cpu" + std::to_string(core);
  std::string name;
  while (file >> name) {
    if (name == wanted) {
      CoreCounts c;
      for (auto& t : c.ticks)
        if (!(file >> t)) return std::nullopt;
      return c;
    }
    file.ignore(100'000, '\n');
  }
  return std::nullopt;
}

DurationNs core_tick_ns() { return kSecond / sysconf(_SC_CLK_TCK); }

}  // namespace wasp::scheduling
