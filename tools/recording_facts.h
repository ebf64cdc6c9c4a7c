// What `wasp recording` says of a folder.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "drivers/recording.h"

namespace wasp::tools {

/// A stretch of time without a frame, longer than one and a half usual intervals.
struct FrameGap {
  double after_s = 0, length_s = 0;  ///< since the first frame
  std::size_t after_entry = 0;
};

struct RecordingFacts {
  std::size_t depth = 0, gray = 0, both = 0;  ///< entries that have it
  double length_s = 0;
  double median_interval_s = 0;  ///< 0 for fewer than two entries
  std::vector<FrameGap> gaps;
  std::size_t with_attitude = 0;  ///< entries to which a replay can give an attitude
  std::vector<std::string> undecodable;
  std::size_t problems = 0;  ///< those of the recording, and undecodable images
};

/// `decode`: load every image. Realtime-safe: no.
RecordingFacts facts_of(const drivers::Recording& recording, bool decode);
std::string facts_text(const drivers::Recording& recording, const RecordingFacts& facts);
std::string facts_json(const drivers::Recording& recording, const RecordingFacts& facts);

}  // namespace wasp::tools
