// Requests on the fault control socket. Promises: a request is understood, or refused in words that repeat nothing of
// it, so that no stranger writes into our log.
#include <cmath>

#include "scheduling/fault_request.h"
#include "tests/fuzz/fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace wasp;
  fuzz::FuzzInput in(data, size);
  const scheduling::FaultScope scope{{"ground_altitude", "", "avoid"}, (in.take<std::uint8_t>() & 1) == 0};
  const std::string text = in.rest_as_text();
  try {
    const scheduling::FaultRequest request = scheduling::parse_fault_request(text, scope);
    fuzz::require(text.size() <= scheduling::kLongestRequest, "what is longer is refused");
    if (request.verb != scheduling::FaultRequest::Verb::kInject) return 0;
    fuzz::require(request.order.point < scheduling::FaultPoint::kCount, "the point exists");
    fuzz::require(request.order.for_ns >= 0 && std::isfinite(request.order.value), "numbers are finite");
    fuzz::require(!scheduling::text_of(request.order, scope).empty(), "an order can be told");
  } catch (const scheduling::FaultRefused& error) {
    const std::string_view reason = error.what();
    fuzz::require(!reason.empty(), "a refusal has a reason");
    for (const char c : reason) fuzz::require(c >= ' ' && c <= '~', "a refusal is one line of plain text");
  }
  return 0;
}
