// Progress of long work on the error stream: one line that is rewritten on a terminal, elsewhere a line every ten
// seconds and at the end.
#pragma once

#include <unistd.h>

#include <iostream>
#include <string>

#include "rt/clock.h"

namespace wasp::tools {

class ProgressLine {
 public:
  explicit ProgressLine(std::string title) : title_(std::move(title)) {}

  void show(const std::string& text, bool last) {
    const TimeNs now_ns = rt::now();
    if (!terminal_ && !last && shown_at_ns_ != kNever && now_ns - shown_at_ns_ < 10 * kSecond) return;
    shown_at_ns_ = now_ns;
    std::cerr << (terminal_ ? "\r\033[K" : "") << title_ << ": " << text << (terminal_ && !last ? "" : "\n")
              << std::flush;
  }

 private:
  std::string title_;
  bool terminal_ = isatty(STDERR_FILENO) != 0;
  TimeNs shown_at_ns_ = kNever;
};

}  // namespace wasp::tools
