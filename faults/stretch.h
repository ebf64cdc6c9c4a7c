// A stretch of time.
#pragma once

#include <algorithm>
#include <vector>

#include "types/time.h"

namespace wasp::faults {

struct Stretch {
  TimeNs from_ns = 0, until_ns = 0;
  [[nodiscard]] bool holds(TimeNs t_ns) const { return t_ns >= from_ns && t_ns <= until_ns; }
};

inline bool within(const std::vector<Stretch>& stretches, TimeNs t_ns) {
  return std::ranges::any_of(stretches, [t_ns](const Stretch& s) { return s.holds(t_ns); });
}

}  // namespace wasp::faults
