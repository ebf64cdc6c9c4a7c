// Timelines of faults. Promises: one is taken, or refused with an error that names the file; what is taken lies within
// its bounds.
#include <cmath>
#include <sstream>

#include "scheduling/fault_timeline.h"
#include "tests/fuzz/fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace wasp;
  fuzz::FuzzInput in(data, size);
  const scheduling::FaultScope scope{{"ground_altitude", "", "avoid"}, (in.take<std::uint8_t>() & 1) == 0};
  std::istringstream text(in.rest_as_text());
  try {
    const auto timeline = scheduling::read_fault_timeline(text, "fuzz.toml", scope);
    fuzz::require(!timeline.empty(), "a timeline has a fault");
    for (const scheduling::TimedFault& fault : timeline) {
      fuzz::require(fault.order.point < scheduling::FaultPoint::kCount, "the point exists");
      fuzz::require(fault.delay_ns >= 0 && fault.order.for_ns >= 0, "times do not run backwards");
      fuzz::require(std::isfinite(fault.order.value), "values are finite");
      fuzz::require(!scheduling::text_of(fault.order, scope).empty(), "an order can be told");
    }
  } catch (const scheduling::ConfigError& error) {
    fuzz::require_clear(error.what(), "fuzz.toml");
  }
  return 0;
}
