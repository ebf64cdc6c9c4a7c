// One IndexedFaceSet for each (texture, glow): unlit, the face colour multiplies the grey texture. Colours end at 1 in
// VRML, brightness here does not: all are divided by kExposure, which WorldInfo tells the reader.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
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

/// Files under construction: FILE.part until `finish`, gone without it.
class UnfinishedFiles {
 public:
  UnfinishedFiles() = default;
  ~UnfinishedFiles() {
    std::error_code ignored;
    for (const fs::path& file : files_) fs::remove(part(file), ignored);
  }
  UnfinishedFiles(const UnfinishedFiles&) = delete;
  UnfinishedFiles& operator=(const UnfinishedFiles&) = delete;

  /// Where to write what shall become `file`.
  fs::path add(const fs::path& file) {
    files_.push_back(file);
    return part(file);
  }
  /// In the order of `add`.
  void finish() {
    for (const fs::path& file : files_) fs::rename(part(file), file);
    files_.clear();
  }

 private:
  static fs::path part(const fs::path& file) { return file.string() + ".part"; }
  std::vector<fs::path> files_;
};

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
      << "WorldInfo { title \"" << scene.title << "\" info [ \"" << kVrmlBakedLight << '"'
      << (scene.world.smooth ? std::string(", \"") + kVrmlSmooth + '"' : "") << " ] }\n"
      << "NavigationInfo { type [ \"FLY\", \"ANY\" ] }\n"
      << "Background { skyColor " << sky << ' ' << sky << ' ' << sky << " }\n"
      << "Viewpoint { description \"start\" position ";
  point(out, scene.start_ned_m) << " orientation 0 1 0 " << -scene.start_yaw_rad << " }\n";
}

using Groups = std::map<Group, std::vector<std::size_t>>;

Groups groups_of(const World& world, std::size_t first, std::size_t end) {
  Groups groups;
  for (std::size_t i = first; i < end; ++i) groups[{world.surfaces[i].texture, world.surfaces[i].glow}].push_back(i);
  return groups;
}

void write_groups(std::ostream& out, const World& world, const Groups& groups, const fs::path& file) {
  for (const auto& [group, faces] : groups) write_group(out, world, group, faces, file);
}

/// key and keyValue of an interpolator; `value` writes one.
void write_keys(std::ostream& out, const Mover& mover, float cycle_s, const auto& value) {
  out << " { key [ ";
  for (const MoverKey& key : mover.keys) out << key.at_s / cycle_s << ", ";
  out << "] keyValue [ ";
  for (const MoverKey& key : mover.keys) {
    value(key.place);
    out << ", ";
  }
  out << "] }\n";
}

/// A Transform and what drives it. The clock starts when the viewer enters the world.
void write_mover(std::ostream& out, const World& world, const Mover& mover, const fs::path& file) {
  const std::string& name = mover.name;
  const float cycle_s = mover.keys.back().at_s > 0 ? mover.keys.back().at_s : 1.f;
  const bool turns = std::any_of(mover.keys.begin(), mover.keys.end(), [](auto& k) { return k.place.yaw_rad != 0; });
  out << "DEF " << name << " Transform {\n  translation ";
  point(out, mover.keys.front().place.position_ned_m)
      << "\n  rotation 0 1 0 " << -mover.keys.front().place.yaw_rad << "\n  children [\n";
  write_groups(out, world, groups_of(world, mover.first_quad, mover.first_quad + mover.quad_count), file);
  out << "  ]\n}\nDEF " << name << "_clock TimeSensor { cycleInterval " << cycle_s << " loop "
      << (mover.looped ? "TRUE" : "FALSE") << " }\nDEF " << name << "_path PositionInterpolator";
  write_keys(out, mover, cycle_s, [&](const MoverPlace& place) { point(out, place.position_ned_m); });
  out << "ROUTE arrival.enterTime TO " << name << "_clock.set_startTime\n"
      << "ROUTE " << name << "_clock.fraction_changed TO " << name << "_path.set_fraction\n"
      << "ROUTE " << name << "_path.value_changed TO " << name << ".set_translation\n";
  if (!turns) return;
  out << "DEF " << name << "_turn OrientationInterpolator";
  write_keys(out, mover, cycle_s, [&](const MoverPlace& place) { out << "0 1 0 " << -place.yaw_rad; });
  out << "ROUTE " << name << "_clock.fraction_changed TO " << name << "_turn.set_fraction\n"
      << "ROUTE " << name << "_turn.value_changed TO " << name << ".set_rotation\n";
}

void write_world(const fs::path& part, const Scene& scene, const fs::path& file) {
  const World& world = scene.world;
  std::ofstream out(part);
  out.precision(9);
  write_head(out, scene);
  write_groups(out, world, groups_of(world, 0, world.still_quads()), file);
  if (!world.movers.empty()) out << "DEF arrival ProximitySensor { size 2e5 2e5 2e5 }\n";
  for (const Mover& mover : world.movers) write_mover(out, world, mover, file);
  out.close();
  if (!out) throw std::runtime_error(file.string() + ": cannot be written");
}

}  // namespace

void write_vrml(const Scene& scene, const fs::path& file) {
  const World& world = scene.world;
  if (world.quads.empty()) throw std::runtime_error(file.string() + ": the world has no geometry");
  if (fs::is_directory(file)) throw std::runtime_error(file.string() + ": is a folder");
  UnfinishedFiles files;
  std::set<std::int32_t> textures;
  for (const Surface& surface : world.surfaces) textures.insert(surface.texture);
  for (const std::int32_t texture : textures)
    write_texture(world.textures[static_cast<std::size_t>(texture)],
                  files.add(file.parent_path() / texture_name(file, texture)));
  write_world(files.add(file), scene, file);
  files.finish();
}

}  // namespace wasp::sim
