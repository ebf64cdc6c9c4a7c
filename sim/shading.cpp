#include "sim/shading.h"

#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/shading.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
// clang-format on

#ifndef WASP_SIM_SHADING_CONSTANTS
#define WASP_SIM_SHADING_CONSTANTS
namespace wasp::sim {
namespace {

constexpr float kDetailRepeat_m = 0.4f, kDetailTexels_pm = 256 / kDetailRepeat_m, kDetailGone_px = 12;
constexpr float kSlant = 0.05f;  ///< keeps the footprint finite at grazing sight

}  // namespace
}  // namespace wasp::sim
#endif

HWY_BEFORE_NAMESPACE();
namespace wasp::sim::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using Ints = hn::RebindToSigned<Floats>;
using F = hn::Vec<Floats>;
using I = hn::Vec<Ints>;
constexpr Floats kF;
constexpr Ints kI;

HWY_INLINE F plus_dot(F start, const Vec3& a, F x, F y, F z) {
  return hn::Add(start, hn::Add(hn::Add(hn::Mul(hn::Set(kF, a.x()), x), hn::Mul(hn::Set(kF, a.y()), y)),
                                hn::Mul(hn::Set(kF, a.z()), z)));
}

/// Halvings that bring a footprint to kSharpest_px or less: the exponent of their ratio, rounded up.
HWY_INLINE I level_of(F footprint_px, int levels) {
  const I bits = hn::BitCast(kI, hn::Mul(footprint_px, hn::Set(kF, 1.f / Texture::kSharpest_px)));
  const I up = hn::ShiftRight<23>(hn::Add(bits, hn::Set(kI, (1 << 23) - 1)));
  return hn::Min(hn::Max(hn::Sub(up, hn::Set(kI, 127)), hn::Zero(kI)), hn::Set(kI, levels - 1));
}

/// Texture::sample of each lane.
HWY_INLINE F sample(const Texture& texture, F u, F v, F footprint_px) {
  const auto levels = static_cast<int>(texture.offsets().size());
  if (levels == 1) return hn::Set(kF, static_cast<float>(texture.texels()[0]));
  const I level = level_of(footprint_px, levels);
  const I n = hn::Shr(hn::Set(kI, texture.size_px()), level), one = hn::Set(kI, 1), mask = hn::Sub(n, one);
  const F size = hn::ConvertTo(kF, n), half = hn::Set(kF, 0.5f);
  const F x = hn::Sub(hn::Mul(u, size), half), y = hn::Sub(hn::Mul(v, size), half);
  const F fx = hn::Floor(x), fy = hn::Floor(y);
  const F ax = hn::Sub(x, fx), ay = hn::Sub(y, fy);
  const I x0 = hn::And(hn::ConvertTo(kI, fx), mask), y0 = hn::And(hn::ConvertTo(kI, fy), mask);
  const I y1 = hn::And(hn::Add(y0, one), mask), stride = hn::Add(n, one);
  const I first = hn::Add(hn::GatherIndex(kI, texture.offsets().data(), level), x0);
  const auto* texels = reinterpret_cast<const std::int32_t*>(texture.texels());
  const I above = hn::GatherOffset(kI, texels, hn::Add(first, hn::Mul(y0, stride)));
  const I below = hn::GatherOffset(kI, texels, hn::Add(first, hn::Mul(y1, stride)));
  const I byte = hn::Set(kI, 0xff);
  const F a = hn::ConvertTo(kF, hn::And(above, byte)), b = hn::ConvertTo(kF, hn::And(hn::ShiftRight<8>(above), byte));
  const F c = hn::ConvertTo(kF, hn::And(below, byte)), d = hn::ConvertTo(kF, hn::And(hn::ShiftRight<8>(below), byte));
  const F top = hn::Add(a, hn::Mul(hn::Sub(b, a), ax)), bottom = hn::Add(c, hn::Mul(hn::Sub(d, c), ax));
  return hn::Add(top, hn::Mul(hn::Sub(bottom, top), ay));
}

HWY_INLINE F grain(const World& world, const Surface& s, F u, F v, F footprint_m) {
  const Texture& base = world.textures[static_cast<std::size_t>(s.texture)];
  const F scale = hn::Set(kF, static_cast<float>(base.size_px()) / (s.texels_per_m * kDetailRepeat_m));
  const F value = sample(world.textures[1], hn::Mul(u, scale), hn::Mul(v, scale),
                         hn::Mul(footprint_m, hn::Set(kF, kDetailTexels_pm)));
  return hn::Add(hn::Set(kF, 0.85f), hn::Mul(hn::Set(kF, 0.3f / 255), value));
}

void shade(const World& world, const Surface& s, const PacketHits& hits, std::uint32_t lanes, float* out) {
  const std::size_t width = hn::Lanes(kF);
  const float u_eye = s.u_axis.dot(hits.eye_ned_m) + s.u0, v_eye = s.v_axis.dot(hits.eye_ned_m) + s.v0;
  const F near_enough = hn::Set(kF, kDetailGone_px / kDetailTexels_pm);
  for (std::size_t i = 0; i < 16; i += width) {
    const std::uint32_t ours = lanes >> i & ((1u << width) - 1u);
    if (ours == 0) continue;
    const F dx = hn::Load(kF, hits.dir_x + i), dy = hn::Load(kF, hits.dir_y + i), dz = hn::Load(kF, hits.dir_z + i);
    const F t = hn::Load(kF, hits.range + i);
    const F u = hn::Add(hn::Set(kF, u_eye), hn::Mul(t, plus_dot(hn::Zero(kF), s.u_axis, dx, dy, dz)));
    const F v = hn::Add(hn::Set(kF, v_eye), hn::Mul(t, plus_dot(hn::Zero(kF), s.v_axis, dx, dy, dz)));
    // Seen at a slant a pixel covers more: the mean of its two widths sets the level.
    const F cosine = hn::Add(hn::Abs(plus_dot(hn::Zero(kF), s.normal, dx, dy, dz)), hn::Set(kF, kSlant));
    const F half = hn::Set(kF, 0.5f), stretch = hn::Add(half, hn::Div(half, cosine));
    const F footprint_m = hn::Mul(hn::Mul(t, hn::Set(kF, hits.pixel)), stretch);
    const Texture& base = world.textures[static_cast<std::size_t>(s.texture)];
    F value = sample(base, u, v, hn::Mul(footprint_m, hn::Set(kF, s.texels_per_m)));
    const auto close = hn::Lt(footprint_m, near_enough);
    if (!hn::AllFalse(kF, close))
      value = hn::IfThenElse(close, hn::Mul(value, grain(world, s, u, v, footprint_m)), value);
    value = hn::Add(hn::Mul(value, hn::Set(kF, s.brightness)), hn::Set(kF, s.glow));
    const auto bit = hn::Shl(hn::Set(kI, 1), hn::Iota(kI, 0));
    const auto mine = hn::MaskFromVec(
        hn::BitCast(kF, hn::VecFromMask(kI, hn::Ne(hn::And(hn::Set(kI, static_cast<int>(ours)), bit), hn::Zero(kI)))));
    hn::Store(hn::IfThenElse(mine, value, hn::Load(kF, out + i)), kF, out + i);
  }
}

}  // namespace wasp::sim::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wasp::sim {

HWY_EXPORT(shade);

void shade_lanes(const World& world, const Surface& surface, const PacketHits& hits, std::uint32_t lanes,
                 float* out) noexcept {
  HWY_DYNAMIC_DISPATCH(shade)(world, surface, hits, lanes, out);
}

float shade_reference(const World& world, const Surface& s, const Vec3& o, const Vec3& d, float t, float pixel) {
  const float u = s.u_axis.dot(o) + s.u0 + t * s.u_axis.dot(d);
  const float v = s.v_axis.dot(o) + s.v0 + t * s.v_axis.dot(d);
  const float cosine = std::fabs(s.normal.dot(d)) + kSlant;
  const float footprint_m = t * pixel * (0.5f + 0.5f / cosine);
  const Texture& base = world.textures[static_cast<std::size_t>(s.texture)];
  float value = base.sample(u, v, footprint_m * s.texels_per_m);
  if (footprint_m * kDetailTexels_pm < kDetailGone_px) {  // fine grain, gone in the distance
    const float scale = static_cast<float>(base.size_px()) / (s.texels_per_m * kDetailRepeat_m);
    value *= 0.85f + 0.3f / 255 * world.textures[1].sample(u * scale, v * scale, footprint_m * kDetailTexels_pm);
  }
  return value * s.brightness + s.glow;
}

}  // namespace wasp::sim
#endif
