// The directory of a region: laying it out, and judging one found in a file. Used by region.cpp only.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "shm/region.h"
#include "shm/shm_file.h"

namespace wasp::shm {

/// Rows for these topics; returns the region's size [bytes]. Throws naming the topic that cannot be.
std::uint64_t lay_out(const std::string& name, std::span<const TopicSpec> specs, std::vector<TopicEntry>& entries);

/// FNV-1a over the rows.
std::uint64_t hash_of(const std::vector<TopicEntry>& entries);

/// True if the row lies inside a file of this size; no product is trusted to fit 64 bits.
bool possible(const TopicEntry& entry, std::uint64_t file_bytes);

/// True if the file is a finished region with exactly these rows, and its rings are as a writer leaves them, however it
/// died: then its history can be kept.
bool has_layout(const File& file, std::uint64_t total, std::uint64_t hash, const std::vector<TopicEntry>& entries);

}  // namespace wasp::shm
