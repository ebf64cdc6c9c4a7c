// The configuration a flight would have, read by a program that does not know the behaviours themselves.
#pragma once

#include <string>
#include <vector>

#include "scheduling/config.h"

namespace wasp::tools {

/// wasp.toml, then `extra` in order; behaviours are those with a section. Throws ConfigError naming file and line.
scheduling::Config read_flight_config(const std::vector<std::string>& extra);
/// The same with one file; empty: none.
scheduling::Config read_flight_config(const std::string& extra);

}  // namespace wasp::tools
