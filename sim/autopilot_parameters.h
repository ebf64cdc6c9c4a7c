// The parameters that the simulated PX4 and ArduCopter have: those a companion computer asks for, with the values from
// the factory, in the encoding of each.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/autopilot_flavour.h"

namespace wasp::sim {

struct SimParameter {
  std::string name;
  double value = 0;
  std::uint8_t type = 9;  ///< MAV_PARAM_TYPE
};

class AutopilotParameters {
 public:
  explicit AutopilotParameters(drivers::Flavour flavour);
  /// "NAME=VALUE"; throws std::runtime_error for a name it does not have.
  void set(std::string_view assignment);
  bool set(std::string_view name, double value);
  [[nodiscard]] const SimParameter* find(std::string_view name) const;
  [[nodiscard]] double value(std::string_view name, double otherwise) const;
  [[nodiscard]] std::size_t index_of(const SimParameter& row) const {
    return static_cast<std::size_t>(&row - rows_.data());
  }
  [[nodiscard]] std::size_t size() const { return rows_.size(); }

 private:
  std::vector<SimParameter> rows_;
};

}  // namespace wasp::sim
