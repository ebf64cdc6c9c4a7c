// Counter-based random numbers: a value is a pure function of (seed, counter), so any order of evaluation gives the
// same numbers. The mixer is the "lowbias32" integer hash (C. Wellons, hash-prospector), 32-bit so that compilers
// vectorise it.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace wasp::sim {

constexpr std::uint32_t mix(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352dU;
  x ^= x >> 15;
  x *= 0x846ca68bU;
  x ^= x >> 16;
  return x;
}

constexpr std::uint32_t mix(std::uint32_t seed, std::uint32_t counter) {
  return mix(seed ^ mix(counter + 0x9e3779b9U));
}

/// Uniform in [0, 1).
constexpr float uniform_of(std::uint32_t hash) { return static_cast<float>(hash >> 8) * 0x1p-24f; }

/// Close to a unit normal from the four bytes of one hash (Irwin-Hall, bounded at +-3.45), for pixel noise.
constexpr float rough_normal_of(std::uint32_t hash) {
  const auto sum = static_cast<std::int32_t>((hash & 0xff) + (hash >> 8 & 0xff) + (hash >> 16 & 0xff) + (hash >> 24));
  return static_cast<float>(sum - 510) * (1.f / 147.7998f);  // the sum's deviation: sqrt(4 (256^2 - 1) / 12)
}

/// A stream of independent numbers for slow consumers (IMU, world building).
class Random {
 public:
  explicit Random(std::uint32_t seed) : seed_(mix(seed)) {}
  std::uint32_t bits() { return mix(seed_, counter_++); }
  double uniform() { return uniform_of(bits()); }  ///< [0, 1)
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double exponential(double mean) { return -mean * std::log(1.0 - uniform()); }
  /// Unit normal by Box and Muller.
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  std::uint32_t seed_, counter_ = 0;
};

}  // namespace wasp::sim
