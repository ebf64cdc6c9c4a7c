// Requests on the fault control socket: one line of text a packet, from a stranger (docs/faults.md).
#pragma once

#include <string_view>

#include "scheduling/fault_order.h"

namespace wasp::scheduling {

inline constexpr std::size_t kLongestRequest = 512;

struct FaultRequest {
  enum class Verb : std::uint8_t { kInject, kClear, kList, kStatus };
  Verb verb = Verb::kStatus;
  FaultOrder order = {};            ///< kInject
  std::optional<FaultPoint> point;  ///< kClear; none: all
};

/// `text`: any bytes. Throws FaultRefused with the reason, which repeats nothing of the request.
FaultRequest parse_fault_request(std::string_view text, const FaultScope& scope);

}  // namespace wasp::scheduling
