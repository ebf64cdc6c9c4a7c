#include "scheduling/telemetry_config.h"

namespace wasp::scheduling {

void read_telemetry(TomlTable t, TelemetryConfig& c) {
  t.number("budget_Bps", c.budget_Bps, 0, 1e6);
  t.text_value("parameters", c.parameters, {"auto", "c_cast", "bytewise"});
  t.flag("texts", c.texts);
  t.number("computer_status_hz", c.computer_status_hz, 0, 10);
  t.number("obstacle_distance_hz", c.obstacle_distance_hz, 0, 50);
  t.number("optical_flow_hz", c.optical_flow_hz, 0, 50);
  t.number("named_values_hz", c.named_values_hz, 0, 50);
  t.number("cues_hz", c.cues_hz, 0, 50);
  t.number("latencies_hz", c.latencies_hz, 0, 50);
  t.number("state_hz", c.state_hz, 0, 50);
  t.number("flow_field_hz", c.flow_field_hz, 0, 50);
  t.number("position_hz", c.position_hz, 0, 200);
  t.number("obstacle_above_m", c.obstacle_above_m, 0.05, 10);
  t.number("obstacle_below_m", c.obstacle_below_m, 0.05, 10);
  t.number("obstacle_least_m", c.obstacle_least_m, 0, 10);
  t.number("obstacle_greatest_m", c.obstacle_greatest_m, 0.5, 100);
  t.finish();
  if (c.obstacle_least_m >= c.obstacle_greatest_m)
    t.refuse("telemetry.obstacle_least_m must be below telemetry.obstacle_greatest_m");
}

drivers::ParameterEncoding encoding_for(const TelemetryConfig& config, drivers::Flavour flavour) {
  if (config.parameters == "auto") return drivers::facts_of(flavour).encoding;
  return config.parameters == "bytewise" ? drivers::ParameterEncoding::kBytewise : drivers::ParameterEncoding::kCCast;
}

}  // namespace wasp::scheduling
