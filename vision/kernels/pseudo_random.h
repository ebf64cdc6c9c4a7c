// A 32-bit linear congruential generator that lives in a behaviour's State, so that a logged step replays to the bit.
// Numerical Recipes' constants; the high bits are used because the low ones have short periods.
#pragma once

#include <cstdint>

#include "types/realtime.h"

namespace wasp::vision {

struct PseudoRandom {
  std::uint32_t state = 0x2545F491u;

  /// Next 32 bits. Realtime-safe: yes.
  constexpr std::uint32_t next() WASP_REALTIME { return state = state * 1664525u + 1013904223u; }

  /// Uniform in 0 ... n-1 (n >= 1; bias below n/65536 for n <= 65536). Realtime-safe: yes.
  constexpr int below(int n) WASP_REALTIME {
    return static_cast<int>((static_cast<std::uint64_t>(next() >> 8) * static_cast<std::uint64_t>(n)) >> 24);
  }

  /// Uniform in [0, 1). Realtime-safe: yes.
  constexpr float uniform() WASP_REALTIME { return static_cast<float>(next() >> 8) * 0x1p-24f; }
};

}  // namespace wasp::vision
