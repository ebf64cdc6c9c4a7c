// What stress-ng does beside a flight, on every core, at the lowest ordinary priority: the simulator stands for
// hardware, which no load slows down. Real-time threads are above every ordinary one whatever its nice value, so for
// them the load is the same.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/child_process.h"

namespace wasp::bench {

/// Arguments of stress-ng for "cpu", "memory" or "io" on `cores` cores; empty for "idle". Files go to `folder`.
std::vector<std::string> load_arguments(const std::string& program, const std::string& load, int cores,
                                        const std::string& folder);

/// Runs while alive. Throws std::runtime_error if stress-ng is not installed.
class Load {
 public:
  explicit Load(const std::string& load);
  /// True while the load is really there (always for "idle").
  bool running();

 private:
  std::optional<tools::ChildProcess> child_;
};

}  // namespace wasp::bench
