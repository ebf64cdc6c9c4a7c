// What the processor does to save power: frequency, turbo, sleep states.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "tools/doctor_checks.h"

namespace wasp::tools {

Check check_governor(const DoctorPlan& plan) {
  Check c{"frequency governor", State::kOk, "",
          "a step takes two or three times as long on a core that was clocked down"};
  std::map<std::string, std::string> by_core;
  for (const int core : plan.flight_cores) {
    const auto governor = plan.tree.text(fmt::format("/sys/devices/system/cpu/cpu{}/cpufreq/scaling_governor", core));
    if (!governor) continue;
    by_core[std::to_string(core)] = *governor;
    c.measured += fmt::format("{}core {}: {}", c.measured.empty() ? "" : "; ", core, *governor);
    if (*governor == "performance") continue;
    c.state = State::kWarn;
    c.commands.push_back(
        fmt::format("echo performance | sudo tee /sys/devices/system/cpu/cpu{}/cpufreq/scaling_governor", core));
  }
  c.figures = {{"governors", by_core}};
  if (by_core.empty())
    c.measured = "no frequency scaling visible here (fixed clock, or a virtual machine's host decides)";
  return c;
}

Check check_turbo(const DoctorPlan& plan) {
  Check c{"turbo", State::kOk, "", "the clock then depends on heat and on the other cores' load, and so do all times"};
  const auto off = plan.tree.number("/sys/devices/system/cpu/intel_pstate/no_turbo");
  const auto boost = plan.tree.number("/sys/devices/system/cpu/cpufreq/boost");
  if (!off && !boost) {
    c.measured = "no turbo switch visible here";
    return c;
  }
  const bool on = off ? *off == 0 : *boost != 0;
  c.measured = on ? "on" : "off";
  if (!on) return c;
  c.state = State::kWarn;
  c.commands = {off ? "echo 1 | sudo tee /sys/devices/system/cpu/intel_pstate/no_turbo"
                    : "echo 0 | sudo tee /sys/devices/system/cpu/cpufreq/boost"};
  return c;
}

Check check_idle_states(const DoctorPlan& plan) {
  Check c{"sleep states", State::kOk, "", "waking from a deep sleep takes longer than the flight's whole wake-up"};
  const std::string folder = fmt::format("/sys/devices/system/cpu/cpu{}/cpuidle", plan.core);
  long long deepest_us = 0;
  for (const auto& state : plan.tree.names(folder)) {
    const std::string at = folder + "/" + state;
    if (plan.tree.number(at + "/disable").value_or(0) != 0) continue;
    const long long latency_us = plan.tree.number(at + "/latency").value_or(0);
    deepest_us = std::max(deepest_us, latency_us);
    c.measured += fmt::format("{}{} {} us", c.measured.empty() ? "" : ", ",
                              plan.tree.text(at + "/name").value_or(state), latency_us);
  }
  c.figures = {{"deepest_enabled_us", deepest_us}};
  if (c.measured.empty()) c.measured = "none visible here (the host of a virtual machine decides)";
  constexpr long long kHarmless_us = 20;
  if (deepest_us <= kHarmless_us) return c;
  if (plan.tree.exists("/dev/cpu_dma_latency")) {
    c.measured += "; the flight holds /dev/cpu_dma_latency at 0 while it runs";
    return c;
  }
  c.state = State::kWarn;
  c.commands = {fmt::format("for s in {}/state*; do [ $(cat $s/latency) -gt {} ] && echo 1 | sudo tee $s/disable; done",
                            folder, kHarmless_us)};
  return c;
}

}  // namespace wasp::tools
