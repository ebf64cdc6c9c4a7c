// The catalogue: every fault of the campaign, one row each.
#pragma once

#include <span>

#include "faults/fault.h"

namespace wasp::faults {

std::span<const Fault> catalogue();

}  // namespace wasp::faults
