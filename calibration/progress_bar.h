// A progress bar on the error stream: "wasp calibrate camera: [#####.....]  50 %  corners in img_0190.png".
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "tools/progress_line.h"

namespace wasp::calibration {

class ProgressBar {
 public:
  explicit ProgressBar(const std::string& title) : line_(title) {}

  /// `share` of the work done, 0 ... 1; `doing` names what is at hand. 1 ends the line.
  void show(double share, const std::string& doing) {
    const double done = std::clamp(share, 0.0, 1.0);
    const auto full = static_cast<std::size_t>(done * kWidth);
    line_.show(
        fmt::format("[{}{}] {:3.0f} %  {}", std::string(full, '#'), std::string(kWidth - full, '.'), 100 * done, doing),
        share >= 1);
  }

 private:
  static constexpr std::size_t kWidth = 30;
  tools::ProgressLine line_;
};

}  // namespace wasp::calibration
