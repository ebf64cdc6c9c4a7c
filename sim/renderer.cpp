#include "sim/renderer.h"

#include <embree3/rtcore.h>
#include <xmmintrin.h>

#include <cmath>
#include <stdexcept>

namespace wasp::sim {
namespace {

/// Embree is fast only while denormals count as zero; the thread's own mode comes back afterwards.
class FlushDenormals {
 public:
  FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | 0x8040u); }
  ~FlushDenormals() { _mm_setcsr(saved_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned saved_;
};

/// (D.12, D.13) inverted by fixed-point iteration: normalised coordinates of the ray that lands on (xd, yd).
Eigen::Vector2d undistort(double xd, double yd, const Intrinsics& k) {
  double x = xd, y = yd;
  for (int i = 0; i < 20; ++i) {
    const double r2 = x * x + y * y;
    const double radial =
        1 + r2 * (static_cast<double>(k.k1) + r2 * (static_cast<double>(k.k2) + r2 * static_cast<double>(k.k3)));
    const double p1 = static_cast<double>(k.p1), p2 = static_cast<double>(k.p2);
    x = (xd - 2 * p1 * x * y - p2 * (r2 + 2 * x * x)) / radial;
    y = (yd - p1 * (r2 + 2 * y * y) - 2 * p2 * x * y) / radial;
  }
  return {x, y};
}

void aim(RTCRayHit16& packet, const CameraPose& pose, const float* x, const float* y) {
  const Mat3& R = pose.R_ned_cam;
  const Vec3& o = pose.position_ned_m;
  RTCRay16& ray = packet.ray;
  for (int i = 0; i < 16; ++i) {
    ray.org_x[i] = o.x(), ray.org_y[i] = o.y(), ray.org_z[i] = o.z();
    ray.dir_x[i] = R(0, 0) * x[i] + R(0, 1) * y[i] + R(0, 2);
    ray.dir_y[i] = R(1, 0) * x[i] + R(1, 1) * y[i] + R(1, 2);
    ray.dir_z[i] = R(2, 0) * x[i] + R(2, 1) * y[i] + R(2, 2);
    ray.tnear[i] = 0.01f, ray.tfar[i] = 1e3f, ray.time[i] = 0;
    ray.mask[i] = ~0u, ray.id[i] = 0, ray.flags[i] = 0;
    packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
}

/// Pixel value of surface `s` seen along `d` from `o` at depth t. `pixel` is the pixel's width at unit depth.
float shade(const World& world, const Surface& s, const Vec3& o, const Vec3& d, float t, float pixel) {
  const float u = s.u_axis.dot(o) + s.u0 + t * s.u_axis.dot(d);
  const float v = s.v_axis.dot(o) + s.v0 + t * s.v_axis.dot(d);
  // Seen at a slant a pixel covers more: the mean of its two widths sets the level.
  const float cosine = std::fabs(s.normal.dot(d)) + 0.05f;
  const float footprint_m = t * pixel * (0.5f + 0.5f / cosine);
  const Texture& base = world.textures[static_cast<std::size_t>(s.texture)];
  float value = base.sample(u, v, footprint_m * s.texels_per_m);
  constexpr float kDetailRepeat_m = 0.4f, kDetailTexels_pm = 256 / kDetailRepeat_m;
  if (footprint_m * kDetailTexels_pm < 12) {  // fine grain, gone in the distance
    const float scale = static_cast<float>(base.size_px()) / (s.texels_per_m * kDetailRepeat_m);
    value *= 0.85f + 0.3f / 255 * world.textures[1].sample(u * scale, v * scale, footprint_m * kDetailTexels_pm);
  }
  return value * s.brightness + s.glow;
}

}  // namespace

Renderer::Renderer(World world, const Intrinsics& intrinsics)
    : Renderer(std::make_shared<const WorldScene>(std::move(world)), intrinsics) {}

Renderer::Renderer(std::shared_ptr<const WorldScene> scene, const Intrinsics& intrinsics)
    : scene_(std::move(scene)), intrinsics_(intrinsics) {
  if (intrinsics.width_px <= 0 || intrinsics.height_px <= 0 || intrinsics.width_px % 4 != 0 ||
      intrinsics.height_px % 4 != 0)
    throw std::runtime_error("renderer: image size " + std::to_string(intrinsics.width_px) + " x " +
                             std::to_string(intrinsics.height_px) + " is not a positive multiple of 4");
  build_rays();
}

void Renderer::build_rays() {
  const Intrinsics& k = intrinsics_;
  const int columns = k.width_px / 4, rows = k.height_px / 4;
  packets_.resize(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      for (int i = 0; i < 16; ++i) {
        const int u = column * 4 + i % 4, v = row * 4 + i / 4;
        const Eigen::Vector2d ray = undistort((u - static_cast<double>(k.cx_px)) / static_cast<double>(k.fx_px),
                                              (v - static_cast<double>(k.cy_px)) / static_cast<double>(k.fy_px), k);
        Packet& packet = packets_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                                  static_cast<std::size_t>(column)];
        packet.x[i] = static_cast<float>(ray.x());
        packet.y[i] = static_cast<float>(ray.y());
      }
}

void Renderer::render_band(const CameraPose& pose, int first_row, float* luminance, float* depth_m) const {
  const FlushDenormals flush;
  const World& world = scene_->world();
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  alignas(64) static constexpr int kAll[16] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
  alignas(64) RTCRayHit16 hits;
  const int columns = intrinsics_.width_px / 4;
  const float pixel = 1.f / intrinsics_.fx_px;
  const Packet* packet = packets_.data() + static_cast<std::size_t>(first_row / 4) * static_cast<std::size_t>(columns);
  for (int column = 0; column < columns; ++column, ++packet) {
    aim(hits, pose, packet->x, packet->y);
    rtcIntersect16(kAll, scene_->handle(), &context, &hits);
    for (int i = 0; i < 16; ++i) {
      const int at = i / 4 * intrinsics_.width_px + column * 4 + i % 4;
      const bool hit = hits.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
      depth_m[at] = hit ? hits.ray.tfar[i] : 0.f;
      luminance[at] = hit ? shade(world, scene_->surface(hits.hit.geomID[i], hits.hit.primID[i]), pose.position_ned_m,
                                  {hits.ray.dir_x[i], hits.ray.dir_y[i], hits.ray.dir_z[i]}, hits.ray.tfar[i], pixel)
                          : world.sky;
    }
  }
}

}  // namespace wasp::sim
