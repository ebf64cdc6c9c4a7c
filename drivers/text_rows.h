// Rows of a text table as people's tools write them: fields apart by commas, semicolons, blanks or tabs, '#' comments,
// LF or CRLF, with or without a newline at the end, with or without a byte order mark.
// Realtime-safe: no.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "types/time.h"

namespace wasp::drivers {

struct TextRow {
  int line = 0;                          ///< in the file, from 1
  std::vector<std::string_view> fields;  ///< without blanks about them; valid during the visit
};

/// Calls `visit` for every line that holds anything but a comment; comments go, without '#', to `comment` if given.
/// Throws std::runtime_error naming the file when it cannot be read or is no text (a NUL byte).
void visit_rows(const std::filesystem::path& file, const std::function<void(const TextRow&)>& visit,
                const std::function<void(std::string_view)>& comment = {});

/// Decimal seconds, kept exact to the nanosecond: a double holds times since 1970 to 0.2 us only. Exponents are read
/// through one. False for anything else, negative times and those after the year 2116.
bool parse_seconds(std::string_view text, TimeNs& out);
/// Integer nanoseconds, likewise.
bool parse_nanoseconds(std::string_view text, TimeNs& out);
/// A finite number, the whole field.
bool parse_number(std::string_view text, double& out);
/// Numbers from fields[first] on, as many as `out` has; false if there are too few or one is none.
bool parse_numbers(const TextRow& row, std::size_t first, std::span<double> out);

}  // namespace wasp::drivers
