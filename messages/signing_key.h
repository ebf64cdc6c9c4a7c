// The secret of a signed link, and the time of its streams on disk. A key file belongs to the user (or root), nobody else
// may read it, and it holds 32 bytes, raw or as 64 hexadecimal digits. The key is never printed, logged or sent.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace wasp::mavlink {

struct SigningKey {
  std::array<std::uint8_t, 32> bytes{};
};

/// Throws std::runtime_error with the path and the reason, never with what the file holds.
SigningKey load_signing_key(const std::string& path);

/// Where the time of a key's streams is kept: `KEYFILE.time`.
std::string signing_time_path(const std::string& key_path);
/// Signing time stored there [10 us units]; 0 if there is none or it is no number.
std::uint64_t load_signing_time(const std::string& path) noexcept;
/// Replaces it as a whole, or leaves what was; false if it cannot be written.
bool save_signing_time(const std::string& path, std::uint64_t units) noexcept;

/// Time to start from: the clock if it is ahead of what was stored, else (the clock cannot be trusted) a minute behind
/// nothing that can have been sent since it was stored.
std::uint64_t first_signing_time(std::uint64_t clock_units, std::uint64_t stored_units) noexcept;

}  // namespace wasp::mavlink
