#include "sim/world.h"

#include <cmath>

namespace wasp::sim {
namespace {

constexpr float kAmbient = 0.62f, kDiffuse = 0.38f;

}  // namespace

/// Light from the ceiling, a little from the left and behind, so that the faces of a box differ.
float World::lit(const Vec3& normal) {
  const Vec3 to_lamp = Vec3(-0.45f, -0.35f, -0.82f).normalized();
  return kAmbient + kDiffuse * std::fmax(0.f, normal.dot(to_lamp)) + 0.12f * normal.x() * normal.y() -
         0.06f * std::fabs(normal.y());
}

void World::add_quad(const Vec3& corner, const Vec3& edge_u, const Vec3& edge_v, const Material& m) {
  const auto first = static_cast<std::uint32_t>(vertices_ned_m.size());
  for (const Vec3& v : {corner, Vec3(corner + edge_u), Vec3(corner + edge_u + edge_v), Vec3(corner + edge_v)})
    vertices_ned_m.push_back(v);
  quads.push_back({first, first + 1, first + 2, first + 3});

  Surface s;
  s.u_axis = edge_u.normalized() / m.repeat_m;
  s.v_axis = edge_v.normalized() / m.repeat_m;
  s.normal = edge_u.cross(edge_v).normalized();
  s.u0 = -s.u_axis.dot(corner);
  s.v0 = -s.v_axis.dot(corner);
  s.brightness = m.albedo * lit(s.normal);
  s.glow = 255.f * m.glow;
  s.texture = m.texture;
  s.texels_per_m = static_cast<float>(textures[static_cast<std::size_t>(m.texture)].size_px()) / m.repeat_m;
  surfaces.push_back(s);
}

void World::add_box(const Vec3& base, const Vec3& size_m, float yaw_rad, const Material& m) {
  const Vec3 x = Vec3(std::cos(yaw_rad), std::sin(yaw_rad), 0) * size_m.x();
  const Vec3 y = Vec3(-std::sin(yaw_rad), std::cos(yaw_rad), 0) * size_m.y();
  const Vec3 z(0, 0, -size_m.z());
  const Vec3 near_left = base - x / 2 - y / 2;
  add_quad(near_left + z, y, x, m);       // top
  add_quad(near_left, x, y, m);           // underside
  add_quad(near_left + z, -z, y, m);      // back (towards -x)
  add_quad(near_left + x + z, y, -z, m);  // front (towards +x)
  add_quad(near_left + z, x, -z, m);      // left
  add_quad(near_left + y + z, -z, x, m);  // right
}

void World::make_smooth() {
  smooth = true;
  textures[1] = Texture(1, [](int, int) { return 0.5; });
}

void World::begin_mover(const std::string& name, std::vector<MoverKey> keys, bool looped) {
  movers.push_back({name, static_cast<std::uint32_t>(quads.size()), 0, std::move(keys), looped});
}

void World::end_mover() {
  movers.back().quad_count = static_cast<std::uint32_t>(quads.size()) - movers.back().first_quad;
}

Surface World::placed(const Surface& own, const MoverPlace& place) {
  const Mat3 R = R_world_mover(place);
  Surface s = own;
  s.u_axis = R * own.u_axis, s.v_axis = R * own.v_axis, s.normal = R * own.normal;
  s.u0 = own.u0 - s.u_axis.dot(place.position_ned_m), s.v0 = own.v0 - s.v_axis.dot(place.position_ned_m);
  return s;
}

World World::at(double t_s) const {
  World still = *this;
  still.movers.clear();
  for (const Mover& mover : movers) {
    const MoverPlace place = mover.at(t_s);
    const Mat3 R = R_world_mover(place);
    std::vector<bool> moved(vertices_ned_m.size());
    for (std::uint32_t quad = mover.first_quad; quad < mover.first_quad + mover.quad_count; ++quad) {
      still.surfaces[quad] = placed(surfaces[quad], place);
      for (const std::uint32_t v : quads[quad])
        if (!moved[v]) still.vertices_ned_m[v] = place.position_ned_m + R * vertices_ned_m[v], moved[v] = true;
    }
  }
  return still;
}

}  // namespace wasp::sim
