#include "sim/lab_world.h"

#include <cmath>
#include <numbers>

#include "sim/lab_textures.h"
#include "sim/random.h"

namespace wasp::sim {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

/// Builds furniture and remembers what shades the floor.
class LabBuilder {
 public:
  explicit LabBuilder(const LabOptions& options) : options_(options), random_(options.seed) {
    // The floor's place is taken first; it is painted last, when all shadows are known.
    world_.textures.push_back(Texture(1, [](int, int) { return 0.5; }));
    for (auto& t : paint_lab_textures(options.seed)) world_.textures.push_back(std::move(t));
  }

  World build() {
    room();
    fittings();
    furniture();
    cartons();
    world_.textures[kFloor] = paint_floor(options_.edges_per_m, shadows_, options_.seed + 100);
    add_floor();
    return std::move(world_);
  }

 private:
  float between(double low, double high) { return static_cast<float>(random_.uniform(low, high)); }

  void box(float x, float y, float z_up, const Vec3& size, float yaw, const Material& m) {
    world_.add_box(Vec3(x, y, -z_up), size, yaw, m);
  }
  void shade(float x, float y, float half_x, float half_y, double strength) {
    shadows_.push_back({static_cast<double>(x - kLabMinX_m), static_cast<double>(y - kLabMinY_m),
                        static_cast<double>(half_x), static_cast<double>(half_y), strength});
  }

  void add_floor() {
    world_.add_quad({kLabMinX_m, kLabMinY_m, 0}, {kLabMaxX_m - kLabMinX_m, 0, 0}, {0, kLabMaxY_m - kLabMinY_m, 0},
                    {kFloor, static_cast<float>(kFloorRepeat_m), 1.05f});
  }

  void room() {
    const float lx = kLabMaxX_m - kLabMinX_m, ly = kLabMaxY_m - kLabMinY_m, h = kLabHeight_m;
    const Material wall{kPlaster, 1.5f, 0.95f}, skirting{kPlain, 1.f, 0.30f};
    world_.add_quad({kLabMaxX_m, kLabMinY_m, -h}, {0, ly, 0}, {0, 0, h}, wall);
    world_.add_quad({kLabMinX_m, kLabMaxY_m, -h}, {0, -ly, 0}, {0, 0, h}, wall);
    world_.add_quad({kLabMinX_m, kLabMinY_m, -h}, {lx, 0, 0}, {0, 0, h}, {kPlaster, 1.5f, 0.85f});
    world_.add_quad({kLabMaxX_m, kLabMaxY_m, -h}, {-lx, 0, 0}, {0, 0, h}, {kPlaster, 1.5f, 0.9f});
    world_.add_quad({kLabMinX_m, kLabMinY_m, -h}, {0, ly, 0}, {lx, 0, 0}, {kCeiling, 0.6f, 1.f});
    box(kLabMaxX_m - 0.01f, 0, 0, {0.02f, ly, 0.12f}, 0, skirting);
    box(kLabMinX_m + 0.01f, 0, 0, {0.02f, ly, 0.12f}, 0, skirting);
    box(2, kLabMinY_m + 0.01f, 0, {lx, 0.02f, 0.12f}, 0, skirting);
    box(2, kLabMaxY_m - 0.01f, 0, {lx, 0.02f, 0.12f}, 0, skirting);
  }

  void fittings() {
    for (float x = -2; x < 8; x += 3)
      for (const float y : {-2.5f, 2.5f})
        world_.add_quad({x - 0.6f, y - 0.15f, -2.98f}, {1.2f, 0, 0}, {0, 0.3f, 0}, {kPlain, 1.f, 0.2f, 0.9f});
    for (const float x : {-2.f, 1.f, 4.f}) {  // windows on the right
      world_.add_quad({x, 4.98f, -2.4f}, {1.6f, 0, 0}, {0, 0, 1.4f}, {kPlain, 1.f, 0.3f, 0.65f});
      box(x + 0.8f, 4.96f, 1.0f, {0.06f, 0.05f, 1.4f}, 0, {kPlain, 1.f, 0.6f});
      box(x + 0.8f, 4.93f, 0.95f, {1.8f, 0.14f, 0.05f}, 0, {kPlain, 1.f, 0.8f});
    }
    world_.add_quad({7.97f, -1.4f, -2.5f}, {0, 1.6f, 0}, {0, 0, 1.6f}, {kWhiteboard, 1.6f, 1.1f});
    box(7.96f, 3.6f, 0, {0.06f, 1.0f, 2.1f}, 0, {kWood, 2.f, 0.62f});
    box(7.91f, 3.22f, 1.0f, {0.06f, 0.12f, 0.04f}, 0, {kPlain, 1.f, 0.25f});
  }

  /// A bench of `length` along its own y, depth 0.8 m, top at 0.75 m, with a monitor and odds and ends.
  void bench(float x, float y, float length, float yaw) {
    const float c = std::cos(yaw), s = std::sin(yaw);
    const auto at = [&](float dx, float dy) { return Vec3(x + c * dx - s * dy, y + s * dx + c * dy, 0); };
    const auto put = [&](float dx, float dy, float up, const Vec3& size, const Material& m) {
      box(at(dx, dy).x(), at(dx, dy).y(), up, size, yaw, m);
    };
    put(0, 0, 0.71f, {0.8f, length, 0.04f}, {kWood, 1.5f, 1.15f});
    for (const float dx : {-0.36f, 0.36f})
      for (const float dy : {-0.5f, 0.5f})
        put(dx, dy * (length - 0.12f), 0, {0.05f, 0.05f, 0.71f}, {kPlain, 1.f, 0.35f});
    put(0.36f, 0, 0.30f, {0.02f, length - 0.2f, 0.35f}, {kPlain, 1.f, 0.55f});
    for (float dy = -length / 2 + 0.5f; dy < length / 2; dy += 1.1f) monitor(put, dy + between(-0.1, 0.1));
    put(-0.1f, length / 2 - 0.35f, 0.75f, {0.25f, 0.32f, between(0.1, 0.3)}, {kCardboard, 0.4f, 1.f});
    const bool across = std::abs(c) < 0.5f;
    shade(x, y, across ? length / 2 : 0.38f, across ? 0.38f : length / 2, 0.55);
  }
  void monitor(const auto& put, float dy) {
    put(0.15f, dy, 0.75f, {0.18f, 0.24f, 0.02f}, {kPlain, 1.f, 0.2f});
    put(0.18f, dy, 0.77f, {0.04f, 0.06f, 0.12f}, {kPlain, 1.f, 0.2f});
    put(0.15f, dy, 0.86f, {0.04f, 0.52f, 0.33f}, {kPlain, 1.f, 0.16f});
    put(0.128f, dy, 0.88f, {0.006f, 0.48f, 0.29f}, {kScreen, 0.48f, 1.f, 0.1f});
    put(-0.15f, dy, 0.75f, {0.14f, 0.44f, 0.02f}, {kPlain, 1.f, 0.28f});
  }

  void chair(float x, float y, float yaw) {
    const Material dark{kPlain, 1.f, 0.25f};
    const float c = std::cos(yaw), s = std::sin(yaw);
    box(x, y, 0.45f, {0.45f, 0.45f, 0.06f}, yaw, dark);
    box(x - 0.22f * c, y - 0.22f * s, 0.6f, {0.05f, 0.42f, 0.4f}, yaw, dark);
    box(x - 0.22f * c, y - 0.22f * s, 0.5f, {0.03f, 0.06f, 0.12f}, yaw, dark);
    box(x, y, 0.06f, {0.06f, 0.06f, 0.4f}, yaw, {kPlain, 1.f, 0.55f});
    for (int i = 0; i < 3; ++i) box(x, y, 0.03f, {0.55f, 0.05f, 0.03f}, yaw + static_cast<float>(i) * kPi / 3, dark);
    shade(x, y, 0.2f, 0.2f, 0.45);
  }

  void shelf(float x, float y, float length, float yaw) {
    const float c = std::cos(yaw), s = std::sin(yaw);
    for (int level = 0; level < 5; ++level) {
      const float up = 0.05f + 0.4f * static_cast<float>(level);
      box(x, y, up, {0.35f, length, 0.03f}, yaw, {kWood, 1.5f, 0.8f});
      if (level < 4)
        box(x + 0.06f * c, y + 0.06f * s, up + 0.03f, {0.22f, length - 0.1f, 0.28f}, yaw, {kBooks, 0.9f, 1.f});
    }
    for (const float end : {-0.5f, 0.5f})
      box(x - s * end * length, y + c * end * length, 0, {0.35f, 0.03f, 1.8f}, yaw, {kWood, 1.5f, 0.7f});
    shade(x, y, std::abs(c) > 0.5f ? 0.18f : length / 2, std::abs(c) > 0.5f ? length / 2 : 0.18f, 0.6);
  }

  void furniture() {
    bench(7.2f, -2.9f, 2.6f, 0);
    bench(7.2f, 1.2f, 2.2f, 0);
    bench(1.0f, -4.4f, 3.0f, -kPi / 2);
    bench(4.4f, -4.4f, 2.4f, -kPi / 2);
    bench(-1.0f, 4.4f, 3.0f, kPi / 2);
    bench(3.2f, 4.4f, 3.0f, kPi / 2);
    shelf(-3.7f, -1.5f, 2.0f, 0);
    shelf(5.9f, 4.7f, 1.4f, kPi / 2);
    shelf(-2.0f, -4.7f, 1.6f, -kPi / 2);
    for (const float y : {-2.6f, 1.4f}) chair(6.3f + between(-0.1, 0.1), y + between(-0.3, 0.3), between(-0.6, 0.6));
    for (const float x : {0.6f, 4.2f}) chair(x + between(-0.3, 0.3), -3.5f, between(-2.0, -1.2));
    for (const float x : {-0.8f, 3.0f}) chair(x + between(-0.3, 0.3), 3.5f, between(1.2, 2.0));
    box(7.5f, -4.5f, 0, {0.7f, 0.6f, 1.8f}, 0, {kPlain, 1.f, 0.22f});  // rack
    for (int i = 0; i < 8; ++i)
      box(7.14f, -4.5f, 0.15f + 0.2f * static_cast<float>(i), {0.02f, 0.5f, 0.12f}, 0, {kScreen, 0.5f, 0.5f});
    shade(7.5f, -4.5f, 0.35f, 0.3f, 0.6);
  }

  void cartons() {
    for (int i = 0; i < options_.cartons; ++i) {
      const Vec3 size(between(0.25, 0.6), between(0.25, 0.6), between(0.2, 0.55));
      const float reach = 0.5f * std::hypot(size.x(), size.y());
      float x = 0, y = 0;
      do {
        x = between(-3.2, 6.2), y = between(-3.0, 3.0);
      } while (std::hypot(x, y) < kLabFreeRadius_m + reach);
      const float yaw = between(-1.2, 1.2);
      box(x, y, 0, size, yaw, {kCardboard, std::fmax(size.x(), size.y()), between(0.75, 1.25)});
      shade(x, y, reach * 0.75f, reach * 0.75f, 0.4);
      if (i % 3 == 0) box(x, y, size.z(), size * 0.7f, yaw + 0.4f, {kCardboard, size.x(), between(0.7, 1.2)});
    }
  }

  LabOptions options_;
  Random random_;
  World world_;
  std::vector<FloorShadow> shadows_;
};

}  // namespace

World make_lab(const LabOptions& options) { return LabBuilder(options).build(); }

}  // namespace wasp::sim
