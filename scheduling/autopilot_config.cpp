#include "scheduling/autopilot_config.h"

#include <algorithm>

#include "drivers/endpoint.h"

namespace wasp::scheduling {
namespace {

/// What 60 % of a line carry, both streams together; 120 bytes are an attitude and an IMU sample in their frames.
double rate_of(const std::string& endpoint) {
  constexpr double kMost_hz = 100, kLeast_hz = 15, kBytes = 120, kShare = 0.6, kBitsPerByte = 10;
  const auto line = drivers::Endpoint::parse(endpoint);
  if (line.kind != drivers::EndpointKind::kSerial) return kMost_hz;
  return std::clamp(kShare * line.baud / kBitsPerByte / kBytes, kLeast_hz, kMost_hz);
}

}  // namespace

drivers::LinkIdentity AutopilotConfig::identity() const {
  drivers::LinkIdentity id;
  id.system_id = id.autopilot_system_id = static_cast<std::uint8_t>(system_id);
  id.component_id = static_cast<std::uint8_t>(component_id);
  return id;
}

drivers::SetupWish AutopilotConfig::wish(float max_tilt_rad) const {
  drivers::SetupWish w;
  w.flavour = flavour;
  w.mode = mode();
  w.max_tilt_rad = max_tilt_rad;
  w.hover_share = static_cast<float>(hover_thrust);
  w.climb_rate = thrust_field == 1;
  w.thrust = thrust_field == 2;
  w.enforce = enforce_check;
  w.stream_hz = stream_hz > 0 ? stream_hz : rate_of(endpoint);
  return w;
}

void read_autopilot(TomlTable t, AutopilotConfig& c) {
  t.text_value("endpoint", c.endpoint);
  std::string flavour{drivers::facts_of(c.flavour).name};
  t.text_value("flavour", flavour, {"wasp", "px4", "ardupilot"});
  for (std::size_t i = 0; i < drivers::kFlavours.size(); ++i)
    if (drivers::kFlavours[i].name == flavour) c.flavour = static_cast<drivers::Flavour>(i);
  t.number("system_id", c.system_id, 1, 255);
  t.number("component_id", c.component_id, 1, 255);
  t.number("follow_mode", c.follow_mode, -1, 4294967295.0);
  t.flag("arm", c.arm);
  t.flag("enter_mode", c.enter_mode);
  std::string check = c.enforce_check ? "enforce" : "warn";
  t.text_value("check", check, {"enforce", "warn"});
  c.enforce_check = check == "enforce";
  constexpr const char* kMeanings[] = {"read", "climb_rate", "thrust"};
  std::string meaning = kMeanings[c.thrust_field];
  t.text_value("thrust_field", meaning, {"read", "climb_rate", "thrust"});
  for (int i = 0; i < 3; ++i)
    if (meaning == kMeanings[i]) c.thrust_field = i;
  t.number("hover_thrust", c.hover_thrust, 0, 0.95);
  t.number("stream_hz", c.stream_hz, 0, 400);
  t.text_value("signing", c.signing.mode, {"off", "sign", "require"});
  t.text_value("signing_key_file", c.signing.key_file);
  t.finish();
}

}  // namespace wasp::scheduling
