#include "tools/doctor_check.h"

#include <fmt/format.h>

#include <algorithm>

#include "rt/process.h"

namespace wasp::tools {
namespace {

long count_of(const std::vector<Check>& checks, State state) {
  return std::count_if(checks.begin(), checks.end(), [state](const Check& c) { return c.state == state; });
}

nlohmann::json check_json(const Check& c) {
  return {{"name", c.name}, {"state", name_of(c.state)}, {"measured", c.measured},
          {"why", c.why},   {"commands", c.commands},    {"figures", c.figures}};
}

}  // namespace

const char* name_of(State state) {
  switch (state) {
    case State::kOk:
      return "ok";
    case State::kUnknown:
      return "unknown";
    case State::kWarn:
      return "warn";
    case State::kFail:
      return "fail";
  }
  return "?";
}

int exit_code_of(const std::vector<Check>& checks) {
  if (count_of(checks, State::kFail) > 0) return 2;
  return count_of(checks, State::kOk) == static_cast<long>(checks.size()) ? 0 : 1;
}

std::string verdict_of(const std::vector<Check>& checks) {
  const long fail = count_of(checks, State::kFail), warn = count_of(checks, State::kWarn);
  const long unknown = count_of(checks, State::kUnknown);
  const std::string counts =
      fmt::format("{} checks: {} failed, {} warnings, {} could not be found out", checks.size(), fail, warn, unknown);
  if (fail > 0) return "This machine cannot fly real time as it is (" + counts + ").";
  if (warn + unknown > 0) return "This machine can fly real time, with reservations (" + counts + ").";
  return fmt::format("This machine is ready to fly real time ({} checks, all fine).", checks.size());
}

std::vector<std::string> commands_of(const std::vector<Check>& checks) {
  std::vector<std::string> all;
  for (const auto& c : checks)
    if (c.state != State::kOk)
      for (const auto& command : c.commands)
        if (std::find(all.begin(), all.end(), command) == all.end()) all.push_back(command);
  return all;
}

nlohmann::json doctor_json(const std::vector<Check>& checks) {
  nlohmann::json document{{"verdict", verdict_of(checks)},      {"exit_code", exit_code_of(checks)},
                          {"kernel", rt::kernel_description()}, {"host", rt::host_description()},
                          {"checks", nlohmann::json::array()},  {"commands", commands_of(checks)}};
  for (const auto& c : checks) document["checks"].push_back(check_json(c));
  return document;
}

std::string doctor_text(const std::vector<Check>& checks) {
  std::string text = fmt::format("{}, {}\n", rt::kernel_description(), rt::host_description());
  for (const auto& c : checks) {
    text += fmt::format("{:<8} {:<24} {}\n", name_of(c.state), c.name, c.measured);
    if (c.state != State::kOk) text += fmt::format("{:<33} because: {}\n", "", c.why);
  }
  text += fmt::format("\n{}\n", verdict_of(checks));
  const auto commands = commands_of(checks);
  if (!commands.empty()) text += "What changes it (--fix-script prints this as a script):\n";
  for (const auto& command : commands) text += fmt::format("  {}\n", command);
  return text;
}

std::string fix_script(const std::vector<Check>& checks) {
  std::string text =
      "#!/bin/sh\n# Written by wasp doctor. Read it before you run it; kernel parameters need a reboot.\n";
  for (const auto& c : checks) {
    if (c.state == State::kOk || c.commands.empty()) continue;
    text += fmt::format("\n# {}: {}\n", c.name, c.why);
    for (const auto& command : c.commands) text.append(command).append("\n");
  }
  return text;
}

}  // namespace wasp::tools
