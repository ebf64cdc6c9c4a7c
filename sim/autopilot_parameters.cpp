#include "sim/autopilot_parameters.h"

#include <algorithm>
#include <charconv>
#include <stdexcept>

namespace wasp::sim {
namespace {

constexpr std::uint8_t kInt8 = 2, kInt16 = 4, kInt32 = 6, kReal = 9;

std::vector<SimParameter> factory(drivers::Flavour flavour) {
  switch (flavour) {
    case drivers::Flavour::kPx4:
      return {{"MPC_THR_HOVER", 0.5, kReal}, {"COM_OF_LOSS_T", 1.0, kReal},  {"COM_OBL_RC_ACT", 4, kInt32},
              {"MAV_FWDEXTSP", 1, kInt32},   {"COM_RC_IN_MODE", 3, kInt32},  {"COM_RCL_EXCEPT", 4, kInt32},
              {"NAV_DLL_ACT", 0, kInt32},    {"COM_DISARM_PRFLT", 10, kReal}};
    case drivers::Flavour::kArduPilot:
      return {{"GUID_OPTIONS", 0, kInt32},    {"DEV_OPTIONS", 0, kInt32},   {"WPNAV_SPEED_UP", 250, kReal},
              {"WPNAV_SPEED_DN", 150, kReal}, {"FRAME_CLASS", 1, kInt8},    {"ARMING_CHECK", 1, kInt32},
              {"SYSID_ENFORCE", 0, kInt8},    {"SYSID_MYGCS", 255, kInt16}, {"ANGLE_MAX", 3000, kInt16},
              {"DISARM_DELAY", 10, kInt8},    {"GUID_TIMEOUT", 3.0, kReal}};
    case drivers::Flavour::kWasp:
      break;
  }
  return {};
}

}  // namespace

AutopilotParameters::AutopilotParameters(drivers::Flavour flavour) : rows_(factory(flavour)) {}

void AutopilotParameters::set(std::string_view assignment) {
  const auto equals = assignment.find('=');
  double number = 0;
  const std::string_view text = equals == std::string_view::npos ? "" : assignment.substr(equals + 1);
  const auto [end, error] = std::from_chars(text.begin(), text.end(), number);
  if (error != std::errc{} || end != text.end() || text.empty())
    throw std::runtime_error("autopilot parameter '" + std::string(assignment) + "': expected NAME=VALUE");
  if (!set(assignment.substr(0, equals), number))
    throw std::runtime_error("autopilot parameter '" + std::string(assignment) +
                             "': this autopilot has none of that name");
}

bool AutopilotParameters::set(std::string_view name, double value) {
  for (SimParameter& row : rows_)
    if (row.name == name) {
      row.value = value;
      return true;
    }
  return false;
}

const SimParameter* AutopilotParameters::find(std::string_view name) const {
  const auto row = std::find_if(rows_.begin(), rows_.end(), [name](const auto& r) { return r.name == name; });
  return row == rows_.end() ? nullptr : &*row;
}

double AutopilotParameters::value(std::string_view name, double otherwise) const {
  const SimParameter* row = find(name);
  return row == nullptr ? otherwise : row->value;
}

}  // namespace wasp::sim
