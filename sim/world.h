// A world as the renderer wants it: planar quads, each with a surface (texture, its axes, brightness). Light is one
// lamp direction plus ambient, so a planar surface has one brightness, worked out when it is added. World coordinates
// are NED with the floor at z = 0 [m]. Quads of a moving part are in its own frame and follow all those that stand
// still.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sim/mover.h"
#include "sim/texture.h"
#include "types/frames.h"

namespace wasp::sim {

/// How a material looks; `repeat_m` is the length of one texture repeat.
struct Material {
  int texture = 0;
  float repeat_m = 1;
  float albedo = 1;  ///< multiplies the texture, 0 ... 1.5
  float glow = 0;    ///< light of its own, as a share of full white (lamps, windows, screens)
};

/// Texture coordinates are (u_axis . p + u0, v_axis . p + v0) in repeats for a world point p.
struct Surface {
  Vec3 u_axis, v_axis, normal;
  float u0 = 0, v0 = 0;
  float brightness = 1;  ///< pixel value per texture value
  float glow = 0;        ///< pixel value added
  float texels_per_m = 1;
  std::int32_t texture = 0;
};

struct World {
  std::vector<Vec3> vertices_ned_m;
  std::vector<std::array<std::uint32_t, 4>> quads;
  std::vector<Surface> surfaces;  ///< one for each quad
  std::vector<Texture> textures;
  std::vector<Mover> movers;  ///< of the last quads, in their order, none left out
  float sky = 0;              ///< pixel value where nothing is hit
  bool smooth = false;        ///< true: no fine grain on the surfaces; texture 1 is blank

  /// A parallelogram with one corner and two edges; its normal is edge_u x edge_v, light falls on both sides alike.
  void add_quad(const Vec3& corner, const Vec3& edge_u, const Vec3& edge_v, const Material& material);
  void make_smooth();
  /// The next moving part: what is added until `end_mover` belongs to it, in its own frame.
  void begin_mover(const std::string& name, std::vector<MoverKey> keys, bool looped);
  void end_mover();
  [[nodiscard]] std::size_t still_quads() const { return movers.empty() ? quads.size() : movers.front().first_quad; }
  /// A surface of a moving part, and the whole world with every part where it is at time t, standing still.
  [[nodiscard]] static Surface placed(const Surface& own, const MoverPlace& place);
  [[nodiscard]] World at(double t_s) const;

  /// Share of the lamp's and the ambient light on a surface with this normal.
  static float lit(const Vec3& normal);
  /// A box standing on `base` (centre of its underside, NED), turned by `yaw_rad`; the underside is included.
  void add_box(const Vec3& base, const Vec3& size_m, float yaw_rad, const Material& material);
};

}  // namespace wasp::sim
