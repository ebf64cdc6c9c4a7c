// Looks at a flight from outside, read-only, for the progress line.
#pragma once

#include <memory>
#include <string>

#include "shm/region.h"

namespace wasp::tools {

/// What the progress line shows.
struct FlightGlance {
  bool attached = false;
  bool commanding = false;  ///< a command was seen
  int mission_phase = 0;
  double in_phase_s = 0;
  double height_m = 0, setpoint_m = 0, truth_m = 0;
  bool truth_known = false;
  unsigned long long ticks = 0, misses = 0;
  long long worst_ns = 0;  ///< longest exposure-to-byte so far
};

class FlyMonitor {
 public:
  explicit FlyMonitor(std::string instance) : instance_(std::move(instance)) {}
  FlightGlance look();

 private:
  std::string instance_;
  std::unique_ptr<shm::Region> flight_, truth_;
  int phase_ = -1;
  long long phase_since_ns_ = 0;
};

/// One line for a terminal, at most 110 characters.
std::string progress_line(const FlightGlance& glance, double elapsed_s, double expected_s);

}  // namespace wasp::tools
