#include "benchmarks/latency_foreign.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <vector>

namespace wasp::bench {
namespace {

namespace fs = std::filesystem;

constexpr int kKernelThreads = 2;

ThreadStat read_stat(const fs::path& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  return parse_thread_stat(line);
}

std::vector<int> numbers_in(const fs::path& folder) {
  std::vector<int> numbers;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    if (const int n = std::atoi(it->path().filename().c_str()); n > 0) numbers.push_back(n);
  return numbers;
}

/// True if `pid` is this process or descends from it, or is a kernel thread.
bool ours(int pid, const std::map<int, int>& parents) {
  for (int depth = 0; pid > 1 && depth < 64; ++depth) {
    if (pid == getpid() || pid == kKernelThreads) return true;
    const auto it = parents.find(pid);
    if (it == parents.end()) return false;
    pid = it->second;
  }
  return false;
}

}  // namespace

ThreadStat parse_thread_stat(std::string_view line) {
  const std::size_t open = line.find('('), close = line.rfind(')');  // the name may hold both
  if (open == std::string_view::npos || close == std::string_view::npos || close < open) return {};
  ThreadStat t;
  t.name = line.substr(open + 1, close - open - 1);
  std::istringstream rest{std::string(line.substr(close + 1))};
  std::vector<std::string> fields;  // from field 3, the state, on (man 5 proc)
  for (std::string f; rest >> f;) fields.push_back(f);
  constexpr std::size_t kParent = 4 - 3, kCore = 39 - 3, kPriority = 40 - 3;
  if (fields.size() <= kPriority) return {};
  t.parent = std::atoi(fields[kParent].c_str());
  t.core = std::atoi(fields[kCore].c_str());
  t.rt_priority = std::atoi(fields[kPriority].c_str());
  return t;
}

std::set<std::string> foreign_real_time(int core, int priority) {
  const auto pids = numbers_in("/proc");
  std::map<int, int> parents;
  for (const int pid : pids) parents[pid] = read_stat("/proc/" + std::to_string(pid) + "/stat").parent;
  std::set<std::string> found;
  for (const int pid : pids) {
    if (ours(pid, parents)) continue;
    const fs::path tasks = "/proc/" + std::to_string(pid) + "/task";
    for (const int tid : numbers_in(tasks)) {
      const ThreadStat t = read_stat(tasks / std::to_string(tid) / "stat");
      if (t.core == core && t.rt_priority >= priority)
        found.insert(t.name + " (" + std::to_string(t.rt_priority) + ")");
    }
  }
  return found;
}

}  // namespace wasp::bench
