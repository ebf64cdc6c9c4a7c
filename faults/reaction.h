// How a flight answered one fault, measured on the wire: pure functions of what was read there.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "faults/fault.h"
#include "faults/stretch.h"
#include "faults/wire_reader.h"
#include "types/messages.h"

namespace wasp::faults {

/// When a fault was there, and until when its flight was watched.
struct Trial {
  TimeNs began_ns = 0, ended_ns = 0, watched_until_ns = 0;
};

/// Milliseconds; absent: it was not seen.
struct Reaction {
  std::optional<double> detected_ms;  ///< since the fault began: first heartbeat that tells
  std::optional<double> response_ms;  ///< likewise: first of the setpoints that are all neutral, or the stream's end
  std::optional<double>
      recovered_ms;       ///< since its end: first heartbeat "behaviours command", or of the next incarnation
  bool alarmed = false;   ///< CRITICAL or EMERGENCY meanwhile
  bool guardian = false;  ///< the guardian spoke
  int incarnation = 0;    ///< of the last heartbeat
  bool stream_ended = false;
  ModeReason reason = ModeReason::kNone;  ///< of the first heartbeat that tells
  FlightMode mode = FlightMode::kDisarmed;
};

/// A heartbeat tells when it alarms, when the guardian sends it, or when mode or sender have changed away from what
/// behaviours command.
Reaction react(const WireReader& wire, const Trial& trial);

/// A promise that was not kept.
struct Breach {
  std::string why;
  double excess_ms = 0;  ///< late by; infinite: it never came, or no delay of the host explains it
  Stretch waited = {};   ///< from the cause until it came
};

/// For a flight process that was started again: since the fault began, by the new process' first tick in the command
/// ring, which goes on behind the old one's.
void read_restart(const std::vector<Command>& commands, const Trial& trial, Reaction& reaction);

/// What is wrong with a reaction by the fault's promise. Without `times`, only whether it came.
std::optional<Breach> breach_of(const Fault& fault, const Trial& trial, Phase phase, const Reaction& reaction,
                                bool times);

/// For a line that was gone: seen when the flight's log says so, recovered from with the first setpoint after its end.
void read_line(const WireReader& wire, const Trial& trial, TimeNs gone_logged_ns, Reaction& reaction);

/// True where the fault's promise has something to show in that phase: on the ground no behaviour commands, so only the
/// guardian and the line are seen.
bool answers_in(const Fault& fault, Phase phase);

}  // namespace wasp::faults
