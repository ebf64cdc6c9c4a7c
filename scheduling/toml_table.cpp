#include "scheduling/toml_table.h"

#include <fmt/format.h>

#include "drivers/toml_text.h"

namespace wasp::scheduling {

TomlTable TomlTable::parse_file(const std::string& path) {
  try {
    return TomlTable(drivers::parse_toml_file(path));
  } catch (const std::exception& e) {
    throw ConfigError("configuration " + std::string(e.what()));
  }
}

TomlTable TomlTable::parse(std::istream& text, const std::string& name) {
  try {
    return TomlTable(drivers::parse_toml(text, name));
  } catch (const std::exception& e) {
    throw ConfigError("configuration " + std::string(e.what()));
  }
}

std::string TomlTable::text(double x) { return fmt::format("{:g}", x); }

void TomlTable::fail(const toml::value& v, const std::string& why) {
  const auto where = v.location();
  throw ConfigError(where.file_name() + ":" + std::to_string(where.line()) + ": '" + where.line_str() + "': " + why);
}

const toml::value* TomlTable::find(const char* key) {
  asked_.insert(key);
  if (!value_.is_table() || !value_.contains(key)) return nullptr;
  return &value_.as_table().at(key);
}

void TomlTable::flag(const char* key, bool& out) {
  if (const toml::value* v = find(key)) {
    if (!v->is_boolean()) fail(*v, "must be true or false");
    out = v->as_boolean();
  }
}

void TomlTable::text_value(const char* key, std::string& out, const std::vector<std::string>& allowed) {
  const toml::value* v = find(key);
  if (v == nullptr) return;
  if (!v->is_string()) fail(*v, "must be text in quotes");
  const std::string s = v->as_string().str;
  bool ok = allowed.empty();
  std::string list;
  for (const auto& a : allowed) {
    ok = ok || a == s;
    list += (list.empty() ? "" : ", ") + a;
  }
  if (!ok) fail(*v, "must be one of: " + list);
  out = s;
}

void TomlTable::numbers(const char* key, std::vector<double>& out, double low, double high) {
  const toml::value* v = find(key);
  if (v == nullptr) return;
  if (!v->is_array()) fail(*v, "must be a list of numbers");
  std::vector<double> xs;
  for (const auto& item : v->as_array()) {
    double x = 0;
    if (item.is_floating())
      x = item.as_floating();
    else if (item.is_integer())
      x = static_cast<double>(item.as_integer());
    else
      fail(item, "must be a number");
    if (!(x >= low && x <= high)) fail(item, "must lie in " + text(low) + " ... " + text(high));
    xs.push_back(x);
  }
  out = xs;
}

std::vector<TomlTable> TomlTable::tables(const char* key, std::size_t most) {
  std::vector<TomlTable> list;
  const toml::value* v = find(key);
  if (v == nullptr) return list;
  if (!v->is_array()) fail(*v, "must be tables: [[" + std::string(key) + "]]");
  if (v->as_array().size() > most) fail(*v, "more than " + std::to_string(most) + " tables");
  for (const auto& item : v->as_array()) {
    if (!item.is_table()) fail(item, "must be a table");
    list.emplace_back(item);
  }
  return list;
}

TomlTable TomlTable::table(const char* key) {
  const toml::value* v = find(key);
  if (v == nullptr) return TomlTable(toml::table{});
  if (!v->is_table()) fail(*v, "must be a table");
  return TomlTable(*v);
}

void TomlTable::merge(const TomlTable& later) {
  for (const auto& [key, value] : later.value_.as_table()) value_.as_table()[key] = value;
}

void TomlTable::finish() const {
  if (!value_.is_table()) return;
  for (const auto& [key, value] : value_.as_table())
    if (!asked_.contains(key)) fail(value, "unknown key '" + key + "'");
}

}  // namespace wasp::scheduling
