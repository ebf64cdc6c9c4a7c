// One measured figure with its bar: what every measuring subcommand prints with --json.
#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <string>

namespace wasp::tools {

struct Result {
  std::string name;
  double value = 0;
  std::string unit;
  std::string bar;  ///< e.g. "<= 0.05"; empty: no bar
  bool ok = true;
};

inline nlohmann::json to_json(const Result& r) {
  nlohmann::json bar = nullptr;
  if (!r.bar.empty()) bar = r.bar;
  return {{"name", r.name}, {"value", r.value}, {"unit", r.unit}, {"bar", bar}, {"ok", r.ok}};
}

/// Back from to_json; a value that is no number is NaN.
inline Result result_from_json(const nlohmann::json& j) {
  const auto text = [&](const char* key) {
    return j.contains(key) && j[key].is_string() ? j[key].get<std::string>() : "";
  };
  const auto& value = j.contains("value") ? j["value"] : nlohmann::json();
  return {text("name"), value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN(),
          text("unit"), text("bar"), j.value("ok", false)};
}

/// `value` against an upper bar.
inline Result at_most(std::string name, double value, std::string unit, double bar) {
  std::string text = "<= " + nlohmann::json(bar).dump();
  return {std::move(name), value, std::move(unit), std::move(text), value <= bar};
}

}  // namespace wasp::tools
