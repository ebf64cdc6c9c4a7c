// VRML97 worlds. Promises: a world is read, or refused with an error that names the file; what is read is finite and
// within the documented bounds.
#include <stdexcept>

#include "sim/vrml_file.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/scratch_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace wasp;
  static fuzz::ScratchFile file(".wrl");
  file.write({data, size});
  try {
    const sim::Scene scene = sim::read_vrml(file.path());
    fuzz::require(!scene.world.quads.empty() && scene.world.quads.size() == scene.world.surfaces.size(),
                  "every face has a surface");
    for (const Vec3& v : scene.world.vertices_ned_m)
      fuzz::require(v.allFinite() && v.cwiseAbs().maxCoeff() <= 2e5f, "coordinates are finite and bounded");
    for (const auto& quad : scene.world.quads)
      for (const auto i : quad) fuzz::require(i < scene.world.vertices_ned_m.size(), "faces have their corners");
    for (const sim::Surface& s : scene.world.surfaces)
      fuzz::require(s.texture >= 0 && static_cast<std::size_t>(s.texture) < scene.world.textures.size(),
                    "faces have their textures");
    fuzz::require(scene.start_ned_m.allFinite() && std::isfinite(scene.start_yaw_rad), "the start is finite");
  } catch (const std::runtime_error& error) {
    fuzz::require_clear(error.what(), file.path().string());
  }
  return 0;
}
