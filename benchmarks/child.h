// Child processes of a benchmark: pinned, FIFO where permitted, and gone with their parent whatever it dies of.
#pragma once

#include <sys/types.h>

#include <functional>
#include <string>

namespace wasp::bench {

/// Where the two ends of a channel run, and how.
struct Placement {
  int writer_core = 0, reader_core = 0;
  bool two_cores = false;
  bool fifo = false;  ///< SCHED_FIFO 80; only where permitted and two cores are there to spin on
  [[nodiscard]] std::string description() const;
};
Placement choose_placement();

/// Ctrl-C and SIGTERM from now on only raise a flag, so that the parent can clean up.
void catch_interrupts();
bool interrupted();

/// Runs `int body()` in a child on `core`; it leaves through exit(), since iceoryx says good-bye to its daemon there.
pid_t start(int core, bool fifo, const std::function<int()>& body);
/// Waits for a child; on an interrupt or after `seconds` it is killed. True if it ended with 0.
bool finish(pid_t pid, double seconds);

}  // namespace wasp::bench
