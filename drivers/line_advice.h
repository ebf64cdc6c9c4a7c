// What to do about a device that cannot be opened, as a sentence for the one who started the program.
#pragma once

#include <string>

#include "drivers/endpoint.h"

namespace wasp::drivers {

/// By the errno of the attempt; empty where there is nothing to add. Realtime-safe: no.
std::string line_advice(const Endpoint& endpoint, int error);

}  // namespace wasp::drivers
