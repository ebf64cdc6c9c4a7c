// One fault as it is ordered, by a timeline or over the control socket: the same words, the same checks.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "scheduling/fault_points.h"

namespace wasp::scheduling {

/// Why an order cannot be carried out.
class FaultRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What this flight has that a fault could be aimed at.
struct FaultScope {
  std::vector<std::string> behaviours;  ///< by Cue::behaviour; empty text: not enabled
  bool live_camera = true;              ///< false in a replay
};

/// As asked for; `value` and `for_s` may be left out where the point says what they are.
struct FaultWords {
  std::string what;
  std::optional<double> for_s, value;
  std::string behaviour;  ///< empty: all
};

/// Checked.
struct FaultOrder {
  FaultPoint point = FaultPoint::kCount;
  DurationNs for_ns = 0;
  float value = 0;
  std::int32_t target = FaultBoard::kAnyTarget;
};

inline constexpr double kLongestFault_s = 3600;

/// Throws FaultRefused with the reason.
FaultOrder order_of(const FaultWords& words, const FaultScope& scope);

/// "camera.late on for 0.5 s, 120 ms, behaviour avoid".
std::string text_of(const FaultOrder& order, const FaultScope& scope);

/// The table of points, one line each: name, default, range, use, effect.
std::string list_of_fault_points();

}  // namespace wasp::scheduling
