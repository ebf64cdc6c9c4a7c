// Chance for faults: xorshift64*, the same series in every flight (Vigna 2016). Eight bytes a draw.
#pragma once

#include <cstdint>

#include "rt/contract.h"

namespace wasp::scheduling {

class FaultRandom {
 public:
  explicit FaultRandom(std::uint64_t seed = 1) noexcept : state_(seed * 0x9E3779B97F4A7C15ull | 1) {}

  std::uint64_t next() WASP_REALTIME {
    state_ ^= state_ >> 12;
    state_ ^= state_ << 25;
    state_ ^= state_ >> 27;
    return state_ * 0x2545F4914F6CDD1Dull;
  }
  /// True with this probability.
  bool chance(float share) WASP_REALTIME {
    return static_cast<float>(next() >> 40) < share * static_cast<float>(1u << 24);
  }
  /// 0 ... n - 1, n > 0.
  std::uint32_t below(std::uint32_t n) WASP_REALTIME { return static_cast<std::uint32_t>((next() >> 32) * n >> 32); }

 private:
  std::uint64_t state_;
};

}  // namespace wasp::scheduling
