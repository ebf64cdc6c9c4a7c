// The simulator's configuration. Promises: it is taken, or refused with an error that names the file.
#include <cmath>

#include "sim/sim_config.h"
#include "tests/fuzz/fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace wasp;
  try {
    const sim::SimConfig config = sim::parse_sim_config(fuzz::FuzzInput(data, size).rest_as_text(), "fuzz.toml");
    const Intrinsics& k = config.camera.intrinsics;
    fuzz::require(k.width_px >= 32 && k.width_px <= 1920 && k.height_px >= 32 && k.height_px <= 1440,
                  "the camera is of a size that can be drawn");
    fuzz::require(std::isfinite(config.vehicle.mass_kg) && config.vehicle.mass_kg > 0, "the vehicle has a mass");
    fuzz::require(sim::find_scene_kind(config.world_kind) != nullptr, "the kind of world exists");
  } catch (const std::runtime_error& error) {
    fuzz::require_clear(error.what(), "fuzz.toml");
  }
  return 0;
}
