// A region's file may be cut short by anybody with the rights while others have it mapped; touching a lost page would
// end them with SIGBUS. The guard puts a page of zeros under the access instead and counts it: zeros read as "nothing
// published". An observer then lets go of the region; in flight cues and samples age, and the flight mode answers.
// Where the memory is the process' own to write, the page can be written, and is its own from then on.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace wasp::shm {

/// Installs the handler for this process. Call once at start. Only faults beyond the end of a mapped file are taken.
void install_bus_guard();

/// How many pages were lost so far.
std::uint64_t lost_pages() noexcept;

/// True if a page within [begin, begin + bytes) was among those lost after the first `since`. Only the newest 256 are
/// remembered; when more were lost since, the answer is true.
bool lost_page_within(const void* begin, std::uint64_t bytes, std::uint64_t since) noexcept;

/// Names of the mappings with a page among those lost after the first `since`, with commas between; "memory of another
/// kind" if it is in none of them.
std::string lost_names(std::uint64_t since);

/// Every mapping of a region is known to the guard while it lasts. At most 64 at a time; those beyond are guarded as
/// memory that is only read, without a name.
void guard_mapping(std::string_view name, const void* begin, std::uint64_t bytes, bool writable);
void forget_mapping(const void* begin);

}  // namespace wasp::shm
