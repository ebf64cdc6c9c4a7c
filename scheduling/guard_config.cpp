#include "scheduling/guard_config.h"

#include <sstream>

#include "scheduling/default_config.h"
#include "scheduling/toml_durations.h"

namespace wasp::scheduling {
namespace {

void read_plan(TomlTable root, GuardPlan& plan) {
  read_guardian(root.table("guardian"), plan.guard);
  read_autopilot(root.table("autopilot"), plan.autopilot);
  double rate_hz = static_cast<double>(kSecond) / static_cast<double>(plan.guard.times.period_ns);
  root.table("control").number("rate_hz", rate_hz, 5, 200);
  plan.guard.times.period_ns = static_cast<DurationNs>(static_cast<double>(kSecond) / rate_hz);
}

}  // namespace

void read_guardian(TomlTable t, GuardConfig& c) {
  std::string action = c.neutral ? "neutral" : "stop";
  t.text_value("action", action, {"neutral", "stop"});
  c.neutral = action == "neutral";
  read_milliseconds(t, "patience_ms", c.times.patience_ns, 1, 10'000);
  read_milliseconds(t, "kill_after_ms", c.times.kill_after_ns, 20, 60'000);
  read_milliseconds(t, "neutral_ms", c.times.neutral_ns, 0, 60'000);
  t.number("restarts", c.restarts, 0, 100);
  t.number("core", c.core, -1, 1023);
  t.number("priority", c.priority, 1, 99);
  t.text_value("watchdog", c.watchdog);
  t.finish();
}

GuardPlan load_guard_plan(const std::vector<std::string>& paths) {
  GuardPlan plan;
  std::istringstream defaults(kDefaultConfig);
  read_plan(TomlTable::parse(defaults, "built-in config/wasp.toml"), plan);
  for (const auto& path : paths) read_plan(TomlTable::parse_file(path), plan);
  return plan;
}

}  // namespace wasp::scheduling
