// One CSV line per message, every field of it, units in the column names. Floats carry nine significant digits, so that
// reading them back gives the same bits (NaN excepted: its payload is not kept). The last two columns of every file are
// the message's number in its ring and the instant it was published.
#pragma once

#include <iterator>
#include <string>
#include <string_view>

#include "types/messages.h"

namespace wasp::tools {

/// What the ring knows about a message.
struct RingStamp {
  std::uint64_t number = 0;
  TimeNs published_at_ns = 0;
};

/// Column names, comma-separated.
std::string_view imu_columns();
std::string_view attitude_columns();
std::string_view cue_columns();
std::string_view command_columns();
std::string_view truth_columns();

/// One line without newline. `behaviour` is the name behind Cue::behaviour.
std::string csv_row(const ImuSample& imu, const RingStamp& stamp);
std::string csv_row(const AttitudeSample& attitude, const RingStamp& stamp);
std::string csv_row(const Cue& cue, const RingStamp& stamp, std::string_view behaviour);
std::string csv_row(const Command& command, const RingStamp& stamp);
std::string csv_row(const Truth& truth, const RingStamp& stamp);

/// "hold", "cue_lost", ...; "unknown" outside the enum.
std::string_view mode_name(FlightMode mode);
std::string_view reason_name(ModeReason reason);

}  // namespace wasp::tools
