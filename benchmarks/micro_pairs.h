// Two paths that differ in one thing, measured in alternating blocks of one run.
#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <vector>

#include "rt/clock.h"

namespace wasp::bench {

constexpr int kPairBlock = 200;  ///< calls at a time

template <class Path>
double block_ns(Path& path) {
  const TimeNs begin_ns = rt::now();
  for (int i = 0; i < kPairBlock; ++i) path();
  return static_cast<double>(rt::now() - begin_ns) / kPairBlock;
}

inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Either path in turn, the first of a pair alternately. Counters: medians of a call, and of the ratio of a pair.
template <class With, class Without>
void in_pairs(benchmark::State& state, With&& with, Without&& without) {
  std::vector<double> ratios, with_ns, without_ns;
  bool with_first = false;
  for (auto _ : state) {
    with_first = !with_first;
    double a = with_first ? block_ns(with) : 0;
    const double b = block_ns(without);
    if (!with_first) a = block_ns(with);
    with_ns.push_back(a);
    without_ns.push_back(b);
    ratios.push_back(a / b);
  }
  state.counters["with_ns"] = median(with_ns);
  state.counters["without_ns"] = median(without_ns);
  state.counters["ratio"] = median(ratios);
}

}  // namespace wasp::bench
