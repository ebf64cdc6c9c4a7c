// How far the guest is, and how long it will take: a line that redraws itself on a terminal, one every ten seconds
// elsewhere. And a lock, so that two runs never share one working folder.
#pragma once

#include <filesystem>

#include "tools/rt_guest/console.h"
#include "tools/rt_guest/plan.h"
#include "types/time.h"

namespace wasp::tools::rt_guest {

class Progress {
 public:
  explicit Progress(const Plan& plan);
  void show(const Console& console);
  void finish() const;

 private:
  const Plan& plan_;
  bool terminal_;
  TimeNs start_ns_, shown_ns_;
};

/// Held while alive; waits for another run to end.
class RunLock {
 public:
  explicit RunLock(const std::filesystem::path& file);
  ~RunLock();
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;

 private:
  int fd_;
};

}  // namespace wasp::tools::rt_guest
