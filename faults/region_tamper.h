// What a stranger with rights can do to a file of shared memory.
#pragma once

#include <cstdint>
#include <string>

namespace wasp::faults {

/// Flips `count` random bits of /dev/shm/`name` in bytes [from, until) (until 0: to the end). False without access.
bool flip_bits(const std::string& name, std::size_t from, std::size_t until, std::size_t count, std::uint32_t seed);
/// Cuts it to `bytes`. False without access.
bool cut_short(const std::string& name, std::size_t bytes);
/// True if a second writer of the region is refused.
bool second_writer_refused(const std::string& name);

}  // namespace wasp::faults
