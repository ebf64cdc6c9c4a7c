// The frame of `wasp bench vision`: rows of (our kernel, what a user would pick instead), timed call by call over the
// same inputs, interleaved in blocks on one core. To add a kernel: write benchmarks/vision_<kernel>.cpp with one
// function `std::vector<VisionRow> <kernel>_rows(const VisionData&)` and add it to benchmarks/vision_rows.h.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "benchmarks/vision_data.h"

namespace wasp::bench {

/// What our kernel is measured against: it works on input i, as ours does.
struct VisionPeer {
  std::string name;               ///< "cv::phaseCorrelate"
  std::function<void(int)> call;  ///< one call on input i
  double ratio_bar = 0;           ///< time of the peer over ours must reach this; 0: no bar
};

/// One line of the table. `ours` and every peer get the index of an input, 0 ... inputs.size()-1.
struct VisionRow {
  std::string name;                 ///< "edge_rows", "image_shift.256"
  std::string what;                 ///< the work of one call, in a few words
  double floor_us = 0;              ///< physical floor at 2.8 GHz (issue); 0: none stated
  std::vector<std::string> inputs;  ///< name of each input, to say which one was slowest
  std::function<void(int)> ours;
  std::vector<VisionPeer> peers;
  std::function<int(int)> trips = {};  ///< trip count of input i where time depends on the data; empty where it cannot
  /// For the ratios only: called before every call of either side, outside its time. Reads the frame, which leaves it
  /// as a driver does that has just written it; without it, and in p99.9 and max, frames have long fallen out of the
  /// caches.
  std::function<void(int)> fresh = {};
  /// Inputs the bars are about; the ratio over the others is a figure of its own. Empty: all. p99.9 and max: all.
  std::function<bool(int)> judged = {};
  std::string bound = {};  ///< what bounds the time: "fixed trip counts", "at most 3 x 16 iterations"
};

/// Reads all of a frame.
template <class T>
inline void read_through(const std::vector<T>& pixels) {
  constexpr std::size_t kLine = 64 / sizeof(T);
  T sum = 0;
  for (std::size_t i = 0; i < pixels.size(); i += kLine) sum = static_cast<T>(sum + pixels[i]);
  asm volatile("" : : "r"(static_cast<unsigned>(sum)));
}

/// Keeps the compiler from dropping a result.
template <class T>
inline void keep(const T& value) {
  asm volatile("" : : "g"(&value) : "memory");
}

}  // namespace wasp::bench
