#include "sim/scene_bytes.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace wasp::sim {
namespace {

constexpr int kMaxTexturePx = 16384;

[[noreturn]] void refuse(const char* what) { throw std::runtime_error(std::string("scene: ") + what); }

class Writer {
 public:
  template <class T>
  void value(const T& v) {
    raw(&v, sizeof v);
  }
  template <class Container>
  void array(const Container& values) {
    value(static_cast<std::uint64_t>(values.size()));
    raw(values.data(), values.size() * sizeof values[0]);
  }
  void raw(const void* from, std::size_t n) {
    const auto* bytes = static_cast<const std::uint8_t*>(from);
    out.insert(out.end(), bytes, bytes + n);
  }
  std::vector<std::uint8_t> out;
};

class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  template <class T>
  T value() {
    T v{};
    raw(&v, sizeof v);
    return v;
  }
  template <class Container>
  void array(Container& values) {
    const std::size_t n = count(sizeof values[0]);
    values.resize(n);
    raw(values.data(), n * sizeof values[0]);
  }
  /// Of things that take `each` bytes at least, so never more than there are bytes.
  std::size_t count(std::size_t each) {
    const auto n = value<std::uint64_t>();
    if (n > rest_.size() / each) refuse("bytes are missing");
    return static_cast<std::size_t>(n);
  }
  std::span<const std::uint8_t> take(std::size_t n) {
    if (n > rest_.size()) refuse("bytes are missing");
    const auto taken = rest_.first(n);
    rest_ = rest_.subspan(n);
    return taken;
  }
  void finish() const {
    if (!rest_.empty()) refuse("bytes are left over");
  }

 private:
  void raw(void* to, std::size_t n) {
    const auto from = take(n);
    if (n > 0) std::memcpy(to, from.data(), n);
  }
  std::span<const std::uint8_t> rest_;
};

/// The finest level alone: the others follow from it.
void write_texture(Writer& w, const Texture& texture) {
  const auto n = static_cast<std::size_t>(texture.size_px());
  w.value(static_cast<std::int32_t>(texture.size_px()));
  for (std::size_t row = 0; row < n; ++row) w.raw(texture.texels() + row * (n + 1), n);
}

Texture read_texture(Reader& r) {
  const auto side = r.value<std::int32_t>();
  if (side < 1 || side > kMaxTexturePx || !std::has_single_bit(static_cast<unsigned>(side)))
    refuse("a texture of impossible size");
  const auto n = static_cast<std::size_t>(side);
  const auto texels = r.take(n * n);
  return Texture(side, [&](int u, int v) {
    return texels[static_cast<std::size_t>(v) * n + static_cast<std::size_t>(u)] / 255.0;
  });
}

Mover read_mover(Reader& r) {
  Mover mover;
  r.array(mover.name);
  mover.first_quad = r.value<std::uint32_t>(), mover.quad_count = r.value<std::uint32_t>();
  r.array(mover.keys);
  mover.looped = r.value<std::uint8_t>() != 0;
  return mover;
}

bool finite(const Surface& s) {
  return s.u_axis.allFinite() && s.v_axis.allFinite() && s.normal.allFinite() &&
         std::isfinite(s.u0 + s.v0 + s.brightness + s.glow + s.texels_per_m);
}

void check(const Mover& mover) {
  if (mover.keys.empty() || !(mover.keys.front().at_s >= 0)) refuse("a moving part without a path");
  float before_s = 0;
  for (const MoverKey& key : mover.keys) {
    if (!(key.at_s >= before_s && key.at_s < 1e9f) || !key.place.position_ned_m.allFinite() ||
        !std::isfinite(key.place.yaw_rad))
      refuse("a moving part off its path");
    before_s = key.at_s;
  }
}

void check(const World& world) {
  if (world.surfaces.size() != world.quads.size()) refuse("a face without its surface");
  for (const Vec3& v : world.vertices_ned_m)
    if (!v.allFinite()) refuse("a vertex that is not finite");
  for (const auto& quad : world.quads)
    for (const std::uint32_t i : quad)
      if (i >= world.vertices_ned_m.size()) refuse("a face without its corner");
  for (const Surface& s : world.surfaces)
    if (!finite(s) || s.texture < 0 || static_cast<std::size_t>(s.texture) >= world.textures.size())
      refuse("a surface without its texture");
  std::uint64_t next = world.still_quads();
  for (const Mover& mover : world.movers) {
    check(mover);
    if (mover.first_quad != next) refuse("a moving part without its faces");
    next += mover.quad_count;
  }
  if (next != world.quads.size()) refuse("a moving part without its faces");
}

}  // namespace

std::vector<std::uint8_t> scene_bytes(const Scene& scene) {
  Writer w;
  const World& world = scene.world;
  w.array(scene.title);
  w.value(scene.start_ned_m), w.value(scene.start_yaw_rad);
  w.value(world.sky), w.value(static_cast<std::uint8_t>(world.smooth));
  w.array(world.vertices_ned_m), w.array(world.quads), w.array(world.surfaces);
  w.value(static_cast<std::uint64_t>(world.textures.size()));
  for (const Texture& texture : world.textures) write_texture(w, texture);
  w.value(static_cast<std::uint64_t>(world.movers.size()));
  for (const Mover& mover : world.movers) {
    w.array(mover.name);
    w.value(mover.first_quad), w.value(mover.quad_count);
    w.array(mover.keys);
    w.value(static_cast<std::uint8_t>(mover.looped));
  }
  return std::move(w.out);
}

Scene scene_of_bytes(std::span<const std::uint8_t> bytes) {
  Reader r(bytes);
  Scene scene;
  World& world = scene.world;
  r.array(scene.title);
  scene.start_ned_m = r.value<Vec3>(), scene.start_yaw_rad = r.value<float>();
  world.sky = r.value<float>(), world.smooth = r.value<std::uint8_t>() != 0;
  r.array(world.vertices_ned_m), r.array(world.quads), r.array(world.surfaces);
  for (std::size_t n = r.count(sizeof(std::int32_t)); n > 0; --n) world.textures.push_back(read_texture(r));
  for (std::size_t n = r.count(1); n > 0; --n) world.movers.push_back(read_mover(r));
  r.finish();
  if (!scene.start_ned_m.allFinite() || !std::isfinite(scene.start_yaw_rad + world.sky)) refuse("a start nowhere");
  check(world);
  return scene;
}

}  // namespace wasp::sim
