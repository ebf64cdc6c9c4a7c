// The configuration a flight would have, read by a program that does not know the behaviours themselves.
#pragma once

#include <string>

#include "scheduling/config.h"

namespace wasp::tools {

/// wasp.toml, then `extra` (empty: none); behaviours are those with a section. Throws ConfigError naming file and line.
scheduling::Config read_flight_config(const std::string& extra);

}  // namespace wasp::tools
