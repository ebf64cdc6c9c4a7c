// The flight as its shared memory shows it, read-only and from outside: every command of its ring, every exposure of
// the camera's, its counters. Looks a hundred times a second on a thread of its own.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "faults/stretch.h"
#include "rt/thread.h"
#include "scheduling/stage_table.h"
#include "shm/broadcast_ring.h"
#include "types/messages.h"

namespace wasp::faults {

/// Counters of scheduling::RunStatus at one moment.
struct FlightCounts {
  bool known = false;
  bool real_time = false, finished = false;
  std::uint32_t mission_result = 0, faults_armed = 0, incarnation = 0;
  std::uint64_t ticks = 0, skipped = 0, deadline_misses = 0, frames_lost = 0, bad_frames = 0, link_reconnects = 0,
                commands_refused = 0, samples_refused = 0, schedule_thefts = 0, pages_lost = 0;
};

class FlightWatch {
 public:
  explicit FlightWatch(std::string instance);
  ~FlightWatch();
  FlightWatch(const FlightWatch&) = delete;
  FlightWatch& operator=(const FlightWatch&) = delete;

  /// Newest command; tick 0 and mission phase 0 before the first.
  [[nodiscard]] Command newest() const;
  [[nodiscard]] TimeNs phase_since_ns() const;  ///< the mission phase of the newest command began
  [[nodiscard]] std::vector<Command> commands() const;
  [[nodiscard]] std::vector<Stretch> commands_unseen() const;   ///< we looked too late: they were overwritten
  [[nodiscard]] std::vector<Stretch> exposures_unseen() const;  ///< likewise
  [[nodiscard]] std::vector<TimeNs> exposures() const;          ///< of the front camera, rising as published
  /// From an exposure to the next frame's arrival, where that took so long that nothing usable was left meanwhile: a
  /// camera that is late by itself, if nothing was done to it.
  [[nodiscard]] std::vector<Stretch> camera_pauses() const;
  [[nodiscard]] FlightCounts counts() const;
  [[nodiscard]] Truth truth() const;
  /// Lets go of all regions and looks no more (before somebody cuts them short).
  void stop();

 private:
  struct Rings;
  void run();
  void look();

  std::string instance_;
  mutable std::mutex mutex_;
  std::unique_ptr<Rings> rings_;
  std::vector<Command> commands_;
  std::vector<TimeNs> exposures_;
  FlightCounts counts_;
  Truth truth_;
  TimeNs phase_since_ns_ = 0;
  std::vector<Stretch> commands_unseen_, exposures_unseen_, camera_pauses_;
  std::uint64_t commands_lost_ = 0, exposures_lost_ = 0;
  std::atomic<bool> stop_{false};
  rt::Thread thread_;  // joined first
};

}  // namespace wasp::faults
