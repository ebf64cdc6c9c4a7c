// A region's file may be cut short by anybody with the rights while an observer has it mapped; touching the lost pages
// would end the observer with SIGBUS. The guard puts a page of zeros under the access instead and counts it: zeros read
// as "nothing published", and the observer then lets go of its regions.
#pragma once

#include <cstdint>

namespace wasp::tools {

/// Installs the handler for this process. Call once at start. Only faults beyond the end of a mapped file are taken.
void install_bus_guard();

/// How many pages were lost so far.
std::uint64_t lost_pages() noexcept;

/// True if a page within [begin, begin + bytes) was among those lost after the first `since`. Only the newest 256 are
/// remembered; when more were lost since, the answer is true.
bool lost_page_within(const void* begin, std::uint64_t bytes, std::uint64_t since) noexcept;

}  // namespace wasp::tools
