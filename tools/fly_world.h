// What a flight of `wasp fly` looks at and hangs on, as another process: the simulator, or `wasp camera` on real
// hardware.
#pragma once

#include <csignal>
#include <functional>
#include <optional>

#include "rt/clock.h"
#include "tools/child_process.h"
#include "tools/fly_run.h"

namespace wasp::tools {

class FlyWorld {
 public:
  /// Starts it.
  explicit FlyWorld(const Run& run);

  /// Waits, with generous patience, until its serial line or its frames are there. Throws std::runtime_error when it
  /// ends before, or when `given_up`.
  void wait_until_there(const std::function<bool()>& given_up);
  /// False: it has ended, and the flight has nothing to fly in. A camera process that ended is started again instead:
  /// it goes on in the same memory, and the vehicle is in the air.
  bool look_after();
  void end() { process_->end(SIGTERM, 10.0); }

 private:
  [[nodiscard]] bool there() const;
  void start();

  const Run& run_;
  std::optional<ChildProcess> process_;
  TimeNs started_at_ns_ = kNever;
  int starts_ = 0;
};

}  // namespace wasp::tools
