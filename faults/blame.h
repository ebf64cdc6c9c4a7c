// The verdict of one cell: the worst thing said of it. A delay that the host's own standstill explains is noise.
#pragma once

#include <functional>
#include <limits>
#include <string>

#include "faults/campaign.h"
#include "faults/stretch.h"

namespace wasp::faults {

class Blame {
 public:
  static constexpr double kNotExplained = std::numeric_limits<double>::infinity();

  /// `host_late_ms`: how long the host stood still within a stretch.
  Blame(CellResult& result, std::function<double(const Stretch&)> host_late_ms)
      : r_(result), host_late_ms_(std::move(host_late_ms)) {}

  /// What is `excess_ms` beyond its bar, and was waited for within `waited`.
  void late(const std::string& why, double excess_ms, const Stretch& waited);
  /// What no delay explains.
  void broken(const std::string& why) { late(why, kNotExplained, {}); }
  /// Noise whose cause is known; it never hides a miss.
  void noise(const std::string& why);

 private:
  CellResult& r_;
  std::function<double(const Stretch&)> host_late_ms_;
};

}  // namespace wasp::faults
