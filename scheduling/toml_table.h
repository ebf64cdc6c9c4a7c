// A TOML table read strictly: every value has a range, every error names file, line and value, and keys nobody asked
// for are errors.
#pragma once

#include <cmath>
#include <set>
#include <stdexcept>
#include <string>
#include <toml.hpp>
#include <type_traits>
#include <vector>

namespace wasp::scheduling {

class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class TomlTable {
 public:
  /// Throws ConfigError if the file cannot be read or is not TOML.
  static TomlTable parse_file(const std::string& path);
  /// The same of a stream; `name` stands in error messages.
  static TomlTable parse(std::istream& text, const std::string& name);
  explicit TomlTable(toml::value value) : value_(std::move(value)) {}

  /// Leaves `out` as it is when the key is absent. Range is inclusive.
  template <class T>
  void number(const char* key, T& out, double low, double high) {
    const toml::value* v = find(key);
    if (v == nullptr) return;
    double x = 0;
    if (v->is_floating())
      x = v->as_floating();
    else if (v->is_integer())
      x = static_cast<double>(v->as_integer());
    else
      fail(*v, "must be a number");
    if (!(x >= low && x <= high)) fail(*v, "must lie in " + text(low) + " ... " + text(high));
    if (std::is_integral_v<T> && x != std::floor(x)) fail(*v, "must be a whole number");
    out = static_cast<T>(x);
  }
  void flag(const char* key, bool& out);
  /// `allowed` empty: any text.
  void text_value(const char* key, std::string& out, const std::vector<std::string>& allowed = {});
  void numbers(const char* key, std::vector<double>& out, double low, double high);
  [[nodiscard]] bool has(const char* key) const { return value_.is_table() && value_.contains(key); }
  /// The tables [[key]], in order; none if absent.
  std::vector<TomlTable> tables(const char* key, std::size_t most);
  /// Throws naming file and line of this table.
  [[noreturn]] void refuse(const std::string& why) const { fail(value_, why); }
  /// Child table; an empty one if absent.
  TomlTable table(const char* key);
  /// Takes over every key of `later`, which wins.
  void merge(const TomlTable& later);
  /// Throws if the table holds a key nobody asked for.
  void finish() const;

 private:
  static std::string text(double x);
  [[noreturn]] static void fail(const toml::value& v, const std::string& why);
  const toml::value* find(const char* key);

  toml::value value_;
  std::set<std::string> asked_;
};

}  // namespace wasp::scheduling
