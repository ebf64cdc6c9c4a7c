// One finding of `wasp doctor`, and what follows from all of them. A check is a small function that tries or reads one
// thing and returns one of these; nothing it does outlives it.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace wasp::tools {

/// Worse is greater, except that kUnknown says nothing of the machine: the doctor could not look.
enum class State { kOk, kUnknown, kWarn, kFail };

struct Check {
  std::string name;
  State state = State::kOk;
  std::string measured;                    ///< what was tried or read, with its figures and counts
  std::string why;                         ///< one line: why it matters to a flight
  std::vector<std::string> commands = {};  ///< shell lines that change it, or let the doctor see it
  nlohmann::json figures = nlohmann::json::object();
};

const char* name_of(State state);

/// 0: all fine; 1: warnings, or something could not be found out; 2: cannot fly real time.
int exit_code_of(const std::vector<Check>& checks);
/// One line.
std::string verdict_of(const std::vector<Check>& checks);
/// Every command of a check that is not kOk, once, in order.
std::vector<std::string> commands_of(const std::vector<Check>& checks);

/// {"verdict", "exit_code", "kernel", "host", "checks": [...], "commands": [...]}.
nlohmann::json doctor_json(const std::vector<Check>& checks);
/// The same for a terminal.
std::string doctor_text(const std::vector<Check>& checks);
/// A shell script of all commands, each behind its reason.
std::string fix_script(const std::vector<Check>& checks);

}  // namespace wasp::tools
