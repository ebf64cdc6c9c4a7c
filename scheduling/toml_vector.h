// Vectors of fixed length in a TOML table.
#pragma once

#include <span>
#include <vector>

#include "scheduling/toml_table.h"

namespace wasp::scheduling {

/// Leaves `out` as it is when the key is absent; throws ConfigError for another number of values, or one out of range.
inline void read_vector(TomlTable& t, const char* key, std::span<float> out, double low, double high) {
  std::vector<double> numbers;
  t.numbers(key, numbers, low, high);
  if (!numbers.empty() && numbers.size() != out.size())
    t.refuse("'" + std::string(key) + "' needs " + std::to_string(out.size()) + " numbers");
  for (std::size_t i = 0; i < numbers.size(); ++i) out[i] = static_cast<float>(numbers[i]);
}

}  // namespace wasp::scheduling
