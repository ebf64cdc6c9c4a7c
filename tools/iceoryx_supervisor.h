// iceoryx 2.0 can take its process with it: a client that stood still too long aborts when it goes on, one that waits
// for a lock whose holder was killed waits for ever, and a new daemon knows none of the clients of the old. So the work
// is done by a child, and the parent, which never touches iceoryx, watches its beat and replaces it.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <functional>

#include "types/time.h"

namespace wasp::iceoryx {

/// Exit codes of the program and of its worker.
enum ExitCode : int {
  kDone = 0,
  kFailed = 1,      ///< an error said on standard error
  kBadRequest = 2,  ///< bad arguments, unknown topic or instance
  kNoDaemon = 3,    ///< no iox-roudi, or it does not answer
  kReconnect = 75,  ///< worker to parent: the daemon is another one, start me again
};

enum class Phase : std::uint32_t { kWaiting, kConnecting, kRunning };

/// Shared by parent and worker; lives on when a worker dies.
struct Shared {
  std::atomic<std::uint64_t> beats{0};
  std::atomic<Phase> phase{Phase::kWaiting};
  std::atomic<bool> was_running{false};  ///< a worker has been connected: from now on patience is endless
  std::atomic<std::uint32_t> width_px{0}, height_px{0};  ///< import: frame size learned from the first message
  std::atomic<std::uint64_t> worker_restarts{0};
};

/// Set by SIGINT, SIGTERM and SIGHUP in parent and worker.
bool stop_requested();

/// Memory that parent and workers share. Call once, before supervise. Throws std::runtime_error.
Shared& map_shared();

/// Runs `work` in child processes until one ends of its own accord, is told to stop, or cannot go on; returns the exit
/// code of the program. `work` calls `Shared::beats` up at least every second; five seconds without one are a
/// standstill, and the worker is killed and replaced. What happens is said on standard error.
int supervise(Shared& shared, const std::function<int(Shared&)>& work);

}  // namespace wasp::iceoryx
