// Corridors and the office. Walls are quads with notices and doors on them; whatever is seeded leaves a way through.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/random.h"
#include "sim/scene_generators.h"
#include "sim/walker.h"

namespace wasp::sim {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kH = kCorridorHeight_m, kW = kCorridorWidth_m;
const Material kPaper{kWallpaper, 2.f, 0.95f}, kFloorMaterial{kNatural, 1.6f, 0.8f},
    kCeilingMaterial{kWallpaper, 1.2f, 1.1f};

/// Builds upright things between points of the floor plan.
class Builder {
 public:
  explicit Builder(std::uint32_t seed)
      : random_(seed), world_(empty_world(seed, {kNatural, kWallpaper, kDoor, kNotices, kCarton, kSoft, kCloth})) {}

  float between(double low, double high) { return static_cast<float>(random_.uniform(low, high)); }
  World& world() { return world_; }

  /// Floor and ceiling of a rectangle.
  void room(float x0, float y0, float x1, float y1) {
    world_.add_quad({x0, y0, 0}, {x1 - x0, 0, 0}, {0, y1 - y0, 0}, kFloorMaterial);
    world_.add_quad({x0, y0, -kH}, {0, y1 - y0, 0}, {x1 - x0, 0, 0}, kCeilingMaterial);
  }
  /// A wall from a to b with notices and doors every few metres on both of its faces.
  void wall(const Vec3& a, const Vec3& b, bool dressed = true) {
    const Vec3 along = b - a;
    world_.add_quad(a + Vec3(0, 0, -kH), along, {0, 0, kH}, kPaper);
    if (!dressed) return;
    const Vec3 unit = along.normalized(), out = unit.cross(Vec3::UnitZ()) * 0.012f;
    for (float at = between(0.4, 1.2); at + 1.2f < along.norm(); at += between(1.6, 3.2)) {
      const bool door = random_.uniform() < 0.3;
      const float wide = door ? 0.9f : between(0.5, 1.1), high = door ? 2.1f : between(0.5, 0.9);
      const float top = door ? 2.1f : between(1.5, 2.1);
      for (const float side : {1.f, -1.f})
        world_.add_quad(a + unit * at + out * side + Vec3(0, 0, -top), unit * wide, {0, 0, high},
                        {door ? kDoor : kNotices, door ? 2.1f : 1.f, 1.f});
    }
  }
  /// Both long walls of a corridor along x.
  void corridor_x(float x0, float x1, float y) {
    room(x0, y - kW / 2, x1, y + kW / 2);
    wall({x0, y - kW / 2, 0}, {x1, y - kW / 2, 0});
    wall({x0, y + kW / 2, 0}, {x1, y + kW / 2, 0});
  }
  void carton(float x, float y, const Vec3& size) { carton(x, y, size, between(-0.3, 0.3)); }
  void carton(float x, float y, const Vec3& size, float yaw_rad) {
    world_.add_box({x, y, 0}, size, yaw_rad, {kCarton, 0.7f, between(0.7, 1.2)});
  }
  Random& random() { return random_; }
  Scene finish(const char* title) { return {std::move(world_), Vec3::Zero(), 0, title}; }
  /// The same with the start up to 0.4 m to one side and 10 degrees askew, from the seed.
  Scene finish_astray(const char* title, std::uint32_t seed) {
    Random random(mix(seed, 61));
    const auto side = static_cast<float>(random.uniform(-0.4, 0.4)),
               askew = static_cast<float>(random.uniform(-10, 10));
    return {std::move(world_), Vec3(0, side, 0), askew * kPi / 180, title};
  }

 private:
  Random random_;
  World world_;
};

/// A wall across the corridor at x with a gap about y.
void partition(Builder& b, float x, float gap_y, float gap) {
  b.wall({x, -kW / 2, 0}, {x, gap_y - gap / 2, 0}, false);
  b.wall({x, gap_y + gap / 2, 0}, {x, kW / 2, 0}, false);
  b.world().add_quad({x, gap_y - gap / 2, -kH}, {0, gap, 0}, {0, 0, kH - 2.1f}, kPaper);
  for (const float side : {-1.f, 1.f})
    b.world().add_box({x, gap_y + side * gap / 2, 0}, {0.12f, 0.08f, 2.1f}, 0, {kDoor, 2.f, 0.8f});
}

Builder straight(std::uint32_t seed) {
  Builder b(seed);
  b.corridor_x(-3, kCorridorLength_m, 0);
  b.wall({kCorridorLength_m, -kW / 2, 0}, {kCorridorLength_m, kW / 2, 0}, false);
  b.wall({-3, -kW / 2, 0}, {-3, kW / 2, 0}, false);
  return b;
}

}  // namespace

Scene make_corridor(std::uint32_t seed) { return straight(seed).finish_astray("corridor", seed); }

Scene make_corridor_bend(std::uint32_t seed) {
  Builder b(seed);
  const float corner = 15, far = 12;
  b.room(-3, -kW / 2, corner + kW / 2, kW / 2);
  b.room(corner - kW / 2, kW / 2, corner + kW / 2, far);
  b.wall({-3, -kW / 2, 0}, {corner + kW / 2, -kW / 2, 0});
  b.wall({-3, kW / 2, 0}, {corner - kW / 2, kW / 2, 0});
  b.wall({corner + kW / 2, -kW / 2, 0}, {corner + kW / 2, far, 0});
  b.wall({corner - kW / 2, kW / 2, 0}, {corner - kW / 2, far, 0});
  b.wall({corner - kW / 2, far, 0}, {corner + kW / 2, far, 0}, false);
  b.wall({-3, -kW / 2, 0}, {-3, kW / 2, 0}, false);
  return b.finish("corridor-bend");
}

Scene make_corridor_doorway(std::uint32_t seed) {
  Builder b = straight(seed);
  partition(b, 10, b.between(-0.4, 0.4), 1.1f);
  return b.finish("corridor-doorway");
}

/// Things stand against one wall or the other, at least 3 m apart, and reach at most a third of the width.
Scene make_corridor_obstacles(std::uint32_t seed) {
  Builder b = straight(seed);
  float side = b.between(0, 1) < 0.5f ? -1.f : 1.f;
  for (float x = 5; x < kCorridorLength_m - 4; x += b.between(3, 5)) {
    const float reach = b.between(0.35, 0.8), tall = b.between(0.6, 2.2);
    b.carton(x, side * (kW / 2 - reach / 2), {b.between(0.3, 0.7), reach, tall});
    if (b.between(0, 1) < 0.7f) side = -side;
  }
  return b.finish_astray("corridor-obstacles", seed);
}

/// Cartons keep to one wall, people to the other, so that at least 1.2 m stay free between them. Each walks a half of
/// the corridor to and fro: one comes along the vehicle's way first, the other towards it.
Scene make_corridor_people(std::uint32_t seed) {
  Builder b = straight(seed);
  const float side = b.between(0, 1) < 0.5f ? -1.f : 1.f;
  for (float x = b.between(4, 6); x < kCorridorLength_m - 4; x += b.between(3, 5)) {
    const float reach = b.between(0.35, 0.6), tall = b.between(0.6, 2.2);
    b.carton(x, side * (kW / 2 - reach / 2), {b.between(0.3, 0.5), reach, tall}, 0);
  }
  const float lane = -side * (kW / 2 - 0.1f - kWalkerWidth_m / 2), inwards = side * std::numbers::pi_v<float> / 2;
  for (const bool first : {true, false})
    add_walker(
        b.world(), first ? "walker_near" : "walker_far",
        {first ? 4.f : 15.f, first ? 14.f : 27.f, lane, b.between(0.4, 0.8), b.between(0.2, 0.8), first, inwards},
        b.random());
  return b.finish_astray("corridor-people", seed);
}

/// Four by three rooms of 5 m x 4 m; every inner wall has a doorway of 1 m. The start is the first room's middle.
Scene make_office(std::uint32_t seed) {
  constexpr int kAcross = 4, kDeep = 3;
  constexpr float kRoomX = 5, kRoomY = 4, kDoorWide = 1;
  Builder b(seed);
  const float x0 = -kRoomX / 2, y0 = -kRoomY / 2, x1 = x0 + kAcross * kRoomX, y1 = y0 + kDeep * kRoomY;
  b.room(x0, y0, x1, y1);
  const auto inner = [&](const Vec3& a, const Vec3& along, float length) {
    const float gap = b.between(1, static_cast<double>(length) - 2);
    b.wall(a, a + along * gap);
    b.wall(a + along * (gap + kDoorWide), a + along * length);
    b.world().add_quad(a + along * gap + Vec3(0, 0, -kH), along * kDoorWide, {0, 0, kH - 2.1f}, kPaper);
  };
  for (int i = 0; i <= kAcross; ++i)
    for (int j = 0; j < kDeep; ++j) {
      const Vec3 a(x0 + static_cast<float>(i) * kRoomX, y0 + static_cast<float>(j) * kRoomY, 0);
      if (i == 0 || i == kAcross)
        b.wall(a, a + Vec3(0, kRoomY, 0));
      else
        inner(a, Vec3::UnitY(), kRoomY);
    }
  for (int j = 0; j <= kDeep; ++j)
    for (int i = 0; i < kAcross; ++i) {
      const Vec3 a(x0 + static_cast<float>(i) * kRoomX, y0 + static_cast<float>(j) * kRoomY, 0);
      if (j == 0 || j == kDeep)
        b.wall(a, a + Vec3(kRoomX, 0, 0));
      else
        inner(a, Vec3::UnitX(), kRoomX);
    }
  for (int i = 0; i < kAcross; ++i)
    for (int j = 0; j < kDeep; ++j) {
      if (i == 0 && j == 0) continue;
      const float x = x0 + (static_cast<float>(i) + 0.5f) * kRoomX, y = y0 + (static_cast<float>(j) + 0.5f) * kRoomY;
      b.world().add_box({x + b.between(-1, 1), y + b.between(-0.6, 0.6), 0}, {1.4f, 0.7f, 0.74f}, b.between(-0.2, 0.2),
                        {kDoor, 1.5f, 1.4f});
      b.carton(x + 2.1f, y + b.between(-1.2, 1.2), {0.4f, 0.8f, b.between(0.8, 1.8)});
    }
  return b.finish("office");
}

}  // namespace wasp::sim
