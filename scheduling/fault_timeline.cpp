#include "scheduling/fault_timeline.h"

#include <algorithm>

namespace wasp::scheduling {
namespace {

constexpr double kLongestDelay_s = 86'400;
constexpr std::size_t kMostFaults = 10'000;

std::optional<double> number_in(TomlTable& row, const char* key) {
  if (!row.has(key)) return std::nullopt;
  double x = 0;
  row.number(key, x, -1e39, 1e39);  // the point knows its range
  return x;
}

TimedFault fault_of(TomlTable& row, const FaultScope& scope) {
  TimedFault fault;
  const std::vector<std::string> names(kMilestoneNames.begin(), kMilestoneNames.end());
  std::string after = names[0];
  row.text_value("after", after, names);
  fault.after = static_cast<Milestone>(std::find(names.begin(), names.end(), after) - names.begin());
  double at_s = 0;
  for (const char* key : {"at_s", "what"})
    if (!row.has(key)) row.refuse("[[fault]] needs '" + std::string(key) + "'");
  row.number("at_s", at_s, 0, kLongestDelay_s);
  fault.delay_ns = from_seconds(at_s);
  FaultWords words;
  row.text_value("what", words.what);
  row.text_value("behaviour", words.behaviour);
  words.for_s = number_in(row, "for_s");
  words.value = number_in(row, "value");
  row.finish();
  try {
    fault.order = order_of(words, scope);
  } catch (const FaultRefused& e) {
    row.refuse(e.what());
  }
  return fault;
}

std::vector<TimedFault> timeline_of(TomlTable file, const std::string& name, const FaultScope& scope) {
  std::vector<TimedFault> timeline;
  auto rows = file.tables("fault", kMostFaults);
  file.finish();
  for (auto& row : rows) timeline.push_back(fault_of(row, scope));
  if (timeline.empty()) throw ConfigError("faults '" + name + "': there is no [[fault]] in it");
  return timeline;
}

}  // namespace

std::vector<TimedFault> load_fault_timeline(const std::string& path, const FaultScope& scope) {
  return timeline_of(TomlTable::parse_file(path), path, scope);
}

std::vector<TimedFault> read_fault_timeline(std::istream& text, const std::string& name, const FaultScope& scope) {
  return timeline_of(TomlTable::parse(text, name), name, scope);
}

}  // namespace wasp::scheduling
