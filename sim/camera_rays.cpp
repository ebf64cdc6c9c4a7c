#include "sim/camera_rays.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "vision/kernels/derotate.h"

namespace wasp::sim {

CameraRays::CameraRays(const Lens& lens, float field_of_view_rad) : lens_(lens) {
  const Intrinsics& k = lens.intrinsics;
  if (k.width_px <= 0 || k.height_px <= 0 || k.width_px % 4 != 0 || k.height_px % 4 != 0)
    throw std::runtime_error("renderer: image size " + std::to_string(k.width_px) + " x " +
                             std::to_string(k.height_px) + " is not a positive multiple of 4");
  if (!vision::usable(k)) throw std::runtime_error("renderer: the camera's intrinsics are not usable");
  packets_.resize(static_cast<std::size_t>(k.width_px / 4) * static_cast<std::size_t>(k.height_px / 4));
  for (int v = 0; v < k.height_px; ++v)
    for (int u = 0; u < k.width_px; ++u) aim(u, v, field_of_view_rad);
  for (int v = 0; v < k.height_px; v += 4)
    for (int u = 0; u < k.width_px; u += 4)
      measure(packets_[static_cast<std::size_t>(v / 4 * (k.width_px / 4) + u / 4)], u, v);
}

/// Slopes of the packet whose first pixel is (u, v), at the seen pixel nearest to its middle.
void CameraRays::measure(RayPacket& packet, int u, int v) const {
  constexpr int kFromTheMiddle[16] = {5, 6, 9, 10, 1, 2, 4, 7, 8, 11, 13, 14, 0, 3, 12, 15};
  packet.du = packet.dv = Vec3::Zero();
  for (const int i : kFromTheMiddle) {
    if (packet.seen[i] == 0) continue;
    packet.du = slope(u + i % 4, v + i / 4, 1, 0);
    packet.dv = slope(u + i % 4, v + i / 4, 0, 1);
    break;
  }
  // The side of the square that a pixel covers; a pinhole's ray is longer off the axis just as its pixel is larger.
  const float area = packet.du.cross(packet.dv).norm();
  packet.pixel = lens_.kind == LensKind::kPinhole || !(area > 0.f) ? 1.f / lens_.intrinsics.fx_px : std::sqrt(area);
}

void CameraRays::aim(int u, int v, float field_of_view_rad) {
  Vec3 d = Vec3::UnitZ();
  const bool has_direction = vision::direction_of(lens_, {static_cast<float>(u), static_cast<float>(v)}, d);
  const float angle = std::atan2(std::hypot(d.x(), d.y()), d.z());
  const bool seen = has_direction && angle <= 0.5f * field_of_view_rad;
  if (!seen) d = Vec3::UnitZ();
  if (lens_.kind == LensKind::kPinhole) d /= d.z();
  RayPacket& packet = packets_[static_cast<std::size_t>(v / 4 * (width_px() / 4) + u / 4)];
  const int i = v % 4 * 4 + u % 4;
  packet.x[i] = d.x(), packet.y[i] = d.y(), packet.z[i] = d.z();
  packet.seen[i] = seen ? -1 : 0;
}

Vec3 CameraRays::direction(int u, int v) const {
  const RayPacket& p = packet(v / 4, u / 4);
  const int i = v % 4 * 4 + u % 4;
  return {p.x[i], p.y[i], p.z[i]};
}

/// Change of direction for one pixel along (step_u, step_v), from the neighbours that the lens sees.
Vec3 CameraRays::slope(int u, int v, int step_u, int step_v) const {
  if (!seen(u, v)) return Vec3::Zero();
  const auto usable = [this](int a, int b) {
    return a >= 0 && b >= 0 && a < width_px() && b < height_px() && seen(a, b);
  };
  const int u0 = usable(u - step_u, v - step_v) ? u - step_u : u, v0 = usable(u - step_u, v - step_v) ? v - step_v : v;
  const int u1 = usable(u + step_u, v + step_v) ? u + step_u : u, v1 = usable(u + step_u, v + step_v) ? v + step_v : v;
  const int steps = u1 - u0 + v1 - v0;
  if (steps == 0) return Vec3::Zero();
  return (direction(u1, v1) - direction(u0, v0)) / static_cast<float>(steps);
}

float CameraRays::axis(int u, int v) const {
  if (!seen(u, v)) return 0;
  return lens_.kind == LensKind::kPinhole ? 1.f : std::fmax(direction(u, v).z(), 0.f);
}

}  // namespace wasp::sim
