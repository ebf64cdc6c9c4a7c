// Quantiles of exact samples: nearest rank, nothing interpolated, nothing left out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace wasp::tools {

/// Nanoseconds; `count` is the whole population they were taken from.
struct Quantiles {
  std::size_t count = 0;
  double p50 = 0, p99 = 0, p999 = 0, max = 0;
};

/// All zero when there are no samples.
Quantiles quantiles(std::vector<std::int64_t> samples_ns);

/// Middle of `values`, the mean of the two middle ones for an even number; NaN when empty.
double median(std::vector<double> values);

}  // namespace wasp::tools
