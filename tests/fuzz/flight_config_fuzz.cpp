// The flight configuration over the built-in one. Promises: it is taken, or refused with an error that names the file;
// what is taken lies in its ranges.
#include <sstream>

#include "scheduling/config.h"
#include "tests/fuzz/fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace wasp;
  static const scheduling::Config kDefaults = scheduling::load_config({}, {"ground_altitude", "avoid"});
  std::istringstream text(fuzz::FuzzInput(data, size).rest_as_text());
  try {
    scheduling::Config config = kDefaults;
    scheduling::override_config(scheduling::TomlTable::parse(text, "fuzz.toml"), config);
    fuzz::require(config.control_period_ns >= 5 * kMillisecond && config.control_period_ns <= 200 * kMillisecond,
                  "the control period is within its range");
    fuzz::require(config.control.min_height_m < config.control.max_height_m, "heights are in order");
    fuzz::require(config.control.mission.leg_count <= static_cast<int>(control::MissionParams::kMaxLegs),
                  "the mission fits");
    fuzz::require(config.camera.R_body_cam.allFinite(), "the camera's mount is finite");
  } catch (const scheduling::ConfigError& error) {
    fuzz::require_clear(error.what(), "fuzz.toml");
  }
  return 0;
}
