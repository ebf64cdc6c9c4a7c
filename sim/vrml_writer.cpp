// One IndexedFaceSet for each (texture, glow): unlit, the face colour multiplies the grey texture. Colours end at 1 in
// VRML, brightness here does not: all are divided by kExposure, which WorldInfo tells the reader.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <stdexcept>

#include "drivers/image_file.h"
#include "sim/vrml_exposure.h"
#include "sim/vrml_file.h"

namespace wasp::sim {
namespace {

namespace fs = std::filesystem;

struct Group {
  std::int32_t texture = 0;
  float glow = 0;
  friend bool operator<(const Group& a, const Group& b) {
    return a.texture != b.texture ? a.texture < b.texture : a.glow < b.glow;
  }
};

std::ostream& point(std::ostream& out, const Vec3& ned) { return out << ned.y() << ' ' << -ned.z() << ' ' << -ned.x(); }

std::string texture_name(const fs::path& file, std::int32_t texture) {
  return file.stem().string() + "_" + std::to_string(texture) + ".png";
}

void write_texture(const Texture& texture, const fs::path& file) {
  const int n = texture.size_px();
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const auto at = [n](int i) { return (static_cast<float>(i) + 0.5f) / static_cast<float>(n); };
      pixels.push_back(static_cast<std::uint8_t>(std::lround(texture.sample(at(x), at(y), 0))));
    }
  drivers::save_png(file, GrayView{pixels.data(), n, n, n}, 6);
}

void write_group(std::ostream& out, const World& world, const Group& group, const std::vector<std::size_t>& faces,
                 const fs::path& file) {
  out << "Shape {\n  appearance Appearance {\n";
  if (group.glow > 0) {
    const float g = std::min(group.glow / 255.f, 1.f);
    out << "    material Material { diffuseColor 1 1 1 emissiveColor " << g << ' ' << g << ' ' << g << " }\n";
  }
  out << "    texture ImageTexture { url \"" << texture_name(file, group.texture)
      << "\" }\n  }\n  geometry IndexedFaceSet {\n    solid FALSE\n    colorPerVertex FALSE\n    coord Coordinate { "
         "point [\n";
  for (const std::size_t face : faces)
    for (const std::uint32_t v : world.quads[face]) point(out << "      ", world.vertices_ned_m[v]) << ",\n";
  out << "    ] }\n    texCoord TextureCoordinate { point [\n";
  for (const std::size_t face : faces) {
    const Surface& s = world.surfaces[face];
    for (const std::uint32_t v : world.quads[face]) {
      const Vec3& p = world.vertices_ned_m[v];
      out << "      " << s.u_axis.dot(p) + s.u0 << ' ' << 1.f - (s.v_axis.dot(p) + s.v0) << ",\n";
    }
  }
  out << "    ] }\n    color Color { color [\n";
  for (const std::size_t face : faces) {
    const float c = std::clamp(world.surfaces[face].brightness / kVrmlExposure, 0.f, 1.f);
    out << "      " << c << ' ' << c << ' ' << c << ",\n";
  }
  out << "    ] }\n    coordIndex [\n";
  std::size_t next = 0;
  for (const std::size_t face : faces) {
    const bool triangle = world.quads[face][2] == world.quads[face][3];
    out << "      " << next << ", " << next + 1 << ", " << next + 2 << ", ";
    if (!triangle) out << next + 3 << ", ";
    out << "-1,\n";
    next += 4;
  }
  out << "    ]\n  }\n}\n";
}

void write_head(std::ostream& out, const Scene& scene) {
  const float sky = std::clamp(scene.world.sky / 255.f, 0.f, 1.f);
  out << "#VRML V2.0 utf8\n"
      << "WorldInfo { title \"" << scene.title << "\" info \"" << kVrmlBakedLight << "\" }\n"
      << "NavigationInfo { type [ \"FLY\", \"ANY\" ] }\n"
      << "Background { skyColor " << sky << ' ' << sky << ' ' << sky << " }\n"
      << "Viewpoint { description \"start\" position ";
  point(out, scene.start_ned_m) << " orientation 0 1 0 " << -scene.start_yaw_rad << " }\n";
}

}  // namespace

void write_vrml(const Scene& scene, const fs::path& file) {
  const World& world = scene.world;
  if (world.quads.empty()) throw std::runtime_error(file.string() + ": the world has no geometry");
  std::map<Group, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < world.quads.size(); ++i)
    groups[{world.surfaces[i].texture, world.surfaces[i].glow}].push_back(i);
  std::int32_t written = -1;
  for (const auto& [group, faces] : groups) {
    if (group.texture == written) continue;
    written = group.texture;
    write_texture(world.textures[static_cast<std::size_t>(written)], file.parent_path() / texture_name(file, written));
  }
  const fs::path unfinished = file.string() + ".part";
  std::ofstream out(unfinished);
  out.precision(9);
  write_head(out, scene);
  for (const auto& [group, faces] : groups) write_group(out, world, group, faces, file);
  out.close();
  if (!out) {
    fs::remove(unfinished);
    throw std::runtime_error(file.string() + ": cannot be written");
  }
  fs::rename(unfinished, file);
}

}  // namespace wasp::sim
