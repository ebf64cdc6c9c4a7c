// Strong units for folder boundaries: a number that crosses into another room says what it measures.
// Inside a room plain floats carry an SI suffix (_m, _rad, _radps). Degrees exist in configuration and display only.
#pragma once

#include <numbers>

namespace wasp {

/// A double tagged with its unit. Explicit in, explicit out; arithmetic stays within the unit.
template <class Tag>
struct Quantity {
  double value = 0.0;

  constexpr Quantity() = default;
  constexpr explicit Quantity(double v) : value(v) {}
  friend constexpr auto operator<=>(Quantity, Quantity) = default;
  friend constexpr Quantity operator+(Quantity a, Quantity b) { return Quantity{a.value + b.value}; }
  friend constexpr Quantity operator-(Quantity a, Quantity b) { return Quantity{a.value - b.value}; }
  friend constexpr Quantity operator*(Quantity a, double k) { return Quantity{a.value * k}; }
  constexpr Quantity operator-() const { return Quantity{-value}; }
};

using Metres = Quantity<struct MetresTag>;
using Radians = Quantity<struct RadiansTag>;
using Degrees = Quantity<struct DegreesTag>;
using Seconds = Quantity<struct SecondsTag>;

constexpr Radians to_radians(Degrees d) { return Radians{d.value * std::numbers::pi / 180.0}; }
constexpr Degrees to_degrees(Radians r) { return Degrees{r.value * 180.0 / std::numbers::pi}; }

}  // namespace wasp
