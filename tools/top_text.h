// A snapshot as lines for a terminal.
#pragma once

#include <string>
#include <vector>

#include "tools/top_snapshot.h"

namespace wasp::tools {

/// Plain text, one entry a line, no escape sequences. Topics and stages are aligned in columns; about 100 wide.
std::vector<std::string> top_lines(const TopSnapshot& snapshot);

/// "REAL TIME ..." or "NOT REAL TIME", as the flight process says.
std::string real_time_line(const TopSnapshot& snapshot);

}  // namespace wasp::tools
