// Where incidents are kept: one file each, bounded in number for a flight, nothing overwritten. A folder that cannot be
// written is said once; the flight goes on.
#pragma once

#include <string>

#include "scheduling/incident.h"

namespace wasp::scheduling {

class IncidentFolder {
 public:
  /// At most `limit` files; `folder` is made with the first of them.
  IncidentFolder(std::string folder, int limit) : folder_(std::move(folder)), limit_(limit) {}

  [[nodiscard]] bool has_room() const noexcept { return !failed_ && written_ < limit_; }
  [[nodiscard]] int next_number() const noexcept { return written_ + 1; }
  [[nodiscard]] int limit() const noexcept { return limit_; }

  /// Writes the text, and the JSON as the last line. Returns what to log: the file's path, or why there is none (from
  /// then on has_room() is false). Call only while has_room().
  std::string write(const Incident& incident);

 private:
  std::string folder_;
  int limit_, written_ = 0;
  bool failed_ = false;
};

/// "20261122-191500", for file names only.
std::string wall_time();

}  // namespace wasp::scheduling
