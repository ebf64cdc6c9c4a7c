// Which entries of a list to keep so that times rise strictly: as many as possible, so that one wrong time costs one
// entry and not all that follow; of equally many, those that come first.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "types/time.h"

namespace wasp::drivers {

/// Fate of each entry. O(n log n). Realtime-safe: no.
enum class TimeFate { kKept, kUnordered, kDuplicate };

inline std::vector<TimeFate> keep_rising(const std::vector<TimeNs>& times) {
  // From the end: longest[i] entries can be kept from i on; tails[k] is the latest time at which k + 1 can begin.
  std::vector<std::size_t> longest(times.size());
  std::vector<TimeNs> tails;
  for (std::size_t i = times.size(); i-- > 0;) {
    const auto at = std::partition_point(tails.begin(), tails.end(), [&](TimeNs t) { return t > times[i]; });
    longest[i] = static_cast<std::size_t>(at - tails.begin()) + 1;
    if (at == tails.end())
      tails.push_back(times[i]);
    else
      *at = times[i];
  }
  std::vector<TimeFate> fates(times.size(), TimeFate::kUnordered);
  std::size_t left = tails.size();
  TimeNs last = kNever;
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (times[i] == last)
      fates[i] = TimeFate::kDuplicate;
    else if (times[i] > last && longest[i] == left)
      fates[i] = TimeFate::kKept, last = times[i], --left;
  }
  return fates;
}

}  // namespace wasp::drivers
