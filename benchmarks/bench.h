// What every benchmark is given and how it is listed. A new one is one function and one row in bench_main.cpp.
#pragma once

#include <cstdint>
#include <string>

namespace wasp::bench {

struct Options {
  bool json = false;    ///< one object a line on stdout: {"name", "value", "unit", "bar", "ok", ...}; else a table
  double seconds = 20;  ///< about how long the whole benchmark may measure
  std::uint64_t kills = 10'000;  ///< observers: how many die
  std::string only = {};         ///< vision, render: only rows whose name contains this
};

/// Each returns 0 if it measured and met its bars, 1 if a bar was missed, 2 if it could not measure.
int run_ipc(const Options& options);
int run_observers(const Options& options);
int run_bridge(const Options& options);
int run_micro(const Options& options);
int run_vision(const Options& options);
int run_render(const Options& options);

}  // namespace wasp::bench
