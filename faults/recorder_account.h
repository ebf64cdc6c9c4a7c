// What a recorder says it kept and lost, held against what is in its files.
#pragma once

#include <filesystem>
#include <string>

namespace wasp::faults {

/// Lines of its tables, and those that its disk refused.
struct RecorderAccount {
  std::string wrong;  ///< no account, or one that does not add up; empty: right
  std::uint64_t taken = 0, lost = 0, refused = 0, on_disk = 0;
};

/// Of the recording in `folder`, whose recorder has ended: every message it took is a line in a table, or counted as
/// refused by the disk.
RecorderAccount read_account(const std::filesystem::path& folder);

}  // namespace wasp::faults
