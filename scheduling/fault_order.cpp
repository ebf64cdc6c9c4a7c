#include "scheduling/fault_order.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace wasp::scheduling {
namespace {

DurationNs duration_of(const FaultRow& row, const std::optional<double>& for_s) {
  if (row.use == FaultUse::kMoment) return 0;
  if (!for_s) throw FaultRefused(fmt::format("{}: for how long?", row.name));
  if (!(*for_s > 0 && *for_s <= kLongestFault_s))
    throw FaultRefused(fmt::format("{}: lasts more than 0 and at most {:g} s", row.name, kLongestFault_s));
  return from_seconds(*for_s);
}

float value_of(const FaultRow& row, const std::optional<double>& value) {
  if (!value) return row.value;
  if (!row.takes_value()) throw FaultRefused(fmt::format("{} takes no value", row.name));
  if (!(*value >= static_cast<double>(row.low) && *value <= static_cast<double>(row.high)))
    throw FaultRefused(fmt::format("{}: value must lie in {:g} ... {:g}{}{}", row.name, row.low, row.high,
                                   row.unit.empty() ? "" : " ", row.unit));
  return static_cast<float>(*value);
}

std::int32_t target_of(const FaultRow& row, const std::string& behaviour, const FaultScope& scope) {
  if (behaviour.empty()) return FaultBoard::kAnyTarget;
  if (row.use != FaultUse::kBehaviour) throw FaultRefused(fmt::format("{} is not aimed at a behaviour", row.name));
  const auto it = std::find(scope.behaviours.begin(), scope.behaviours.end(), behaviour);
  if (it == scope.behaviours.end())
    throw FaultRefused(fmt::format("{}: no behaviour of this name is enabled in this flight", row.name));
  return static_cast<std::int32_t>(it - scope.behaviours.begin());
}

std::string default_of(const FaultRow& row) {
  if (!row.takes_value()) return "-";
  return fmt::format("{:g}{}{} ({:g} ... {:g})", row.value, row.unit.empty() ? "" : " ", row.unit, row.low, row.high);
}

constexpr std::string_view note_of(FaultUse use) {
  switch (use) {
    case FaultUse::kLiveCamera:
      return " [not in a replay]";
    case FaultUse::kBehaviour:
      return " [behaviour NAME, else all]";
    case FaultUse::kMoment:
      return " [at once]";
    case FaultUse::kAnyFlight:
      break;
  }
  return "";
}

}  // namespace

FaultOrder order_of(const FaultWords& words, const FaultScope& scope) {
  const auto point = fault_point_named(words.what);
  if (!point) throw FaultRefused("no fault point of this name; 'list' names them all");
  const FaultRow& row = row_of(*point);
  if (row.use == FaultUse::kLiveCamera && !scope.live_camera)
    throw FaultRefused(fmt::format("{}: not in a replay, whose frames must come as recorded", row.name));
  return {*point, duration_of(row, words.for_s), value_of(row, words.value), target_of(row, words.behaviour, scope)};
}

std::string text_of(const FaultOrder& order, const FaultScope& scope) {
  const FaultRow& row = row_of(order.point);
  std::string text = fmt::format("{} on", row.name);
  if (row.use != FaultUse::kMoment) text += fmt::format(" for {:g} s", to_seconds(order.for_ns));
  if (row.takes_value()) text += fmt::format(", {:g}{}{}", order.value, row.unit.empty() ? "" : " ", row.unit);
  if (order.target >= 0) text += ", behaviour " + scope.behaviours.at(static_cast<std::size_t>(order.target));
  return text;
}

std::string list_of_fault_points() {
  std::string text;
  for (std::size_t i = 0; i < kFaultPoints; ++i) {
    const FaultRow& row = row_of(static_cast<FaultPoint>(i));
    text += fmt::format("{:<24} {:<32} {}{}\n", row.name, default_of(row), row.effect, note_of(row.use));
  }
  return text;
}

}  // namespace wasp::scheduling
