#include "sim/renderer.h"

#include <cmath>
#include <cstring>
#include <numbers>
#include <utility>

#include "sim/packet_cast.h"

namespace wasp::sim {

Renderer::Renderer(std::shared_ptr<const WorldScene> scene, const Lens& lens, float field_of_view_rad)
    : scene_(std::move(scene)), rays_(lens, field_of_view_rad) {
  const auto pixels = static_cast<std::size_t>(width_px()) * static_cast<std::size_t>(height_px());
  marks_.resize(static_cast<std::size_t>(width_px()));
  edges_.reserve(pixels);
  if (lens.kind == LensKind::kPinhole) return;
  for (int v = 0; v < height_px(); ++v)
    for (int u = 0; u < width_px(); ++u) axis_.push_back(rays_.axis(u, v));
}

Renderer::Renderer(World world, const Intrinsics& intrinsics)
    : Renderer(std::make_shared<const WorldScene>(std::move(world)), Lens{LensKind::kPinhole, intrinsics, {}},
               std::numbers::pi_v<float>) {}

CastFrame Renderer::frame() const {
  return CastFrame(static_cast<std::size_t>(width_px()) * static_cast<std::size_t>(height_px()));
}

void Renderer::cast_band(const CameraPose& pose, int first_row, float right_px, float down_px, const Band& to) const {
  PacketCast packet(*scene_, pose);
  const auto width = static_cast<std::size_t>(width_px());
  for (std::size_t column = 0; column < width / 4; ++column) {
    const RayPacket& rays = rays_.packet(first_row / 4, static_cast<int>(column));
    packet.cast(rays, rays.pixel, right_px * rays.du + down_px * rays.dv);
    for (std::size_t row = 0; row < 4; ++row) {
      const std::size_t at = row * width + column * 4;
      std::memcpy(to.luminance + at, packet.luminance + 4 * row, 4 * sizeof(float));
      std::memcpy(to.range + at, packet.range + 4 * row, 4 * sizeof(float));
      if (to.face != nullptr) std::memcpy(to.face + at, packet.face + 4 * row, 4 * sizeof(float));
    }
  }
}

void Renderer::cast(const CameraPose& pose, CastFrame& frame, float right_px, float down_px) const {
  const FlushDenormals flush;
  for (int row = 0; row < height_px(); row += kBandRows) {
    const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(width_px());
    cast_band(pose, row, right_px, down_px,
              {frame.luminance.data() + at, frame.range.data() + at, frame.face.data() + at});
  }
}

void Renderer::render_band(const CameraPose& pose, int first_row, float* luminance, float* depth_m) const {
  const FlushDenormals flush;
  cast_band(pose, first_row, 0, 0, {luminance, depth_m, nullptr});
  for (int i = 0; i < kBandRows; ++i) {
    float* row = depth_m + i * width_px();
    depth_row(first_row + i, row, row);
  }
}

void Renderer::depth_row(int v, const float* range, float* depth_m) const {
  const auto width = static_cast<std::size_t>(width_px());
  if (axis_.empty()) {
    if (depth_m != range) std::memcpy(depth_m, range, width * sizeof(float));
    return;
  }
  const float* axis = axis_.data() + static_cast<std::size_t>(v) * width;
  for (std::size_t u = 0; u < width; ++u) depth_m[u] = range[u] * axis[u];
}

}  // namespace wasp::sim
