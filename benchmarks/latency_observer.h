// Follows control ticks and cues of a flight from outside, read-only, and keeps every one with its instant.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "benchmarks/latency_data.h"
#include "shm/broadcast_ring.h"
#include "shm/region.h"

namespace wasp::bench {

class FlightObserver {
 public:
  explicit FlightObserver(std::string instance) : instance_(std::move(instance)) {}

  /// Attaches if it can; true once it follows the flight.
  bool attach();
  /// Takes what is new. Call at least every second.
  void look();
  /// Forgets what was seen so far and starts counting losses anew.
  void forget();
  /// The newest tick, nullptr before the first.
  [[nodiscard]] const Tick* newest() const { return ticks_.empty() ? nullptr : &ticks_.back(); }
  /// Moves everything seen into `data`.
  void hand_over(PairData& data);

 private:
  [[nodiscard]] std::size_t lost() const;

  std::string instance_;
  std::unique_ptr<shm::Region> region_;
  std::unique_ptr<shm::RingReader> commands_;
  std::vector<std::string> behaviours_;
  std::vector<shm::RingReader> cue_readers_;
  std::vector<Tick> ticks_;
  std::vector<std::vector<SeenCue>> cues_;
  std::size_t lost_before_ = 0;
};

}  // namespace wasp::bench
