// The parameters of an autopilot that decide whether, and how, it can be flown by setpoints: one table per flavour, and
// what follows from the values read. Pure; who asks is autopilot_setup.h. Sources and meanings: docs/autopilots.md.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/autopilot_flavour.h"
#include "drivers/text_line.h"
#include "rt/contract.h"
#include "types/autopilot_semantics.h"

namespace wasp::drivers {

/// What the flight wants of the autopilot.
struct SetupWish {
  Flavour flavour = Flavour::kWasp;
  std::uint32_t mode = 1;                   ///< in which it obeys (main mode number)
  float max_tilt_rad = 0.26f;               ///< most that is commanded
  float hover_share = 0;                    ///< of the configuration; 0: as the autopilot says
  bool climb_rate = false, thrust = false;  ///< the meaning of the thrust field, where the user says it; neither: read
  bool enforce = true;                      ///< false: a refusal is only said
  double stream_hz = 100;                   ///< attitude and IMU
  double position_hz = 20;                  ///< LOCAL_POSITION_NED
};

enum class ReadingState : std::uint8_t { kUnknown, kKnown, kAbsent };

struct Reading {
  ReadingState state = ReadingState::kUnknown;
  double value = 0;
};

inline constexpr std::size_t kMostParameters = 20;
using Readings = std::array<Reading, kMostParameters>;

/// Names to read, in order; at most kMostParameters.
std::span<const std::string_view> parameters_of(Flavour flavour) WASP_REALTIME;

struct CheckContext {
  SetupWish wish;
  std::uint8_t own_system_id = 1;
  std::uint32_t version = 0;  ///< AUTOPILOT_VERSION.flight_sw_version: major, minor, patch, type by bytes; 0: not known
};

/// What a reading means: for the log, behind "NAME = value: ". Empty when there is nothing to say.
std::string_view meaning_of(Flavour flavour, std::size_t parameter, double value) WASP_REALTIME;

/// What follows from all readings.
struct Verdict {
  AutopilotSemantics semantics;
  TextLine refusal;   ///< why the vehicle must not be armed: parameter, value, what to set; empty: it may
  TextLine failsafe;  ///< what the autopilot does when the stream of setpoints ends
  int to_write = -1;  ///< a parameter whose value means nothing until it is written explicitly; -1: none
  double value_to_write = 0;
};
Verdict judge(const CheckContext& context, const Readings& readings) WASP_REALTIME;

/// Of a flavour before anything was read.
AutopilotSemantics semantics_of(const SetupWish& wish) WASP_REALTIME;

}  // namespace wasp::drivers
