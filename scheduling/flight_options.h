// The command line of `wasp flight`.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace wasp::scheduling {

struct FlightOptions {
  std::string instance = "wasp";
  std::vector<std::string> configs;
  std::string replay;
  bool preload = false;  ///< decode the whole recording before arming
  double seconds = 0;
  std::string measured;
  std::string faults;        ///< timeline of faults; empty: none
  std::string fault_socket;  ///< where faults are taken live; empty: nowhere. Both empty: no fault points exist
  bool no_rt = false;
  bool check_rights = false;
  bool guarded = false;  ///< started by a guardian: page and line are inherited (guard_page.h)
};

/// An exit code when the program is to end at once (help, bad arguments).
std::optional<int> parse_flight_options(int argc, char** argv, FlightOptions& options);

}  // namespace wasp::scheduling
