// Durations in a TOML table: numbers in the unit that the key's name ends in. As TomlTable::number: `out` stays as it
// is when the key is absent, the range is inclusive, errors name file, line and value.
#pragma once

#include "scheduling/toml_table.h"
#include "types/time.h"

namespace wasp::scheduling {

inline void read_milliseconds(TomlTable& t, const char* key, DurationNs& out, double low_ms = 1,
                              double high_ms = 60'000) {
  double ms = static_cast<double>(out) / kMillisecond;
  t.number(key, ms, low_ms, high_ms);
  out = static_cast<DurationNs>(ms * kMillisecond);
}

inline void read_microseconds(TomlTable& t, const char* key, DurationNs& out) {
  double us = static_cast<double>(out) / kMicrosecond;
  t.number(key, us, 1, 1'000'000);
  out = static_cast<DurationNs>(us * kMicrosecond);
}

}  // namespace wasp::scheduling
