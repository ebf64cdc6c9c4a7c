// Does a fault to a flight and takes it back. Only to processes that this program started, and to their files.
#pragma once

#include <functional>
#include <string>

#include "faults/fault.h"
#include "faults/flight_under_test.h"

namespace wasp::faults {

/// A fault under way.
struct Injected {
  TimeNs at_ns = 0;            ///< it began
  std::string error;           ///< why it could not; empty: it did
  std::function<void()> undo;  ///< may be empty
};

/// `seed` decides what is random in it. Never throws; what cannot be done is said.
Injected inject(const Fault& fault, FlightUnderTest& flight, std::uint32_t seed);

/// Why a fault cannot be tried on this machine or with these programs; empty: it can.
std::string missing_for(const Fault& fault, const Abilities& abilities);

}  // namespace wasp::faults
