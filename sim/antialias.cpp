// Renderer::antialias. An edge whose two sides look alike needs no smoothing, so pixels count only where the values
// differ too: most borders between faces of one wall or floor drop out. Two passes: mark both pixels of every such
// pair, then four rays for each, four pixels to a packet.
#include <algorithm>
#include <cmath>

#include "sim/packet_cast.h"
#include "sim/renderer.h"

namespace wasp::sim {
namespace {

constexpr float kLeastStep = 3;  ///< pixel values
/// A rotated grid: four places with distinct rows and columns, so that an edge of either direction gets four shades.
constexpr float kOffset_px[4][2] = {{-0.125f, -0.375f}, {0.375f, -0.125f}, {0.125f, 0.375f}, {-0.375f, 0.125f}};

/// Marks pixels of a row that have an edge with the pixel `step` further on.
void mark(const float* luminance, const std::uint32_t* face, std::ptrdiff_t step, int count, std::uint8_t* marks) {
  for (int u = 0; u < count; ++u) {
    const bool differs = (face[u] != face[u + step]) & (std::fabs(luminance[u] - luminance[u + step]) > kLeastStep);
    marks[u] |= differs ? 1 : 0;
  }
}

}  // namespace

void Renderer::find_edges(const CastFrame& frame) {
  const int width = width_px(), height = height_px();
  edges_.clear();
  for (int v = 0; v < height; ++v) {
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(v) * width;
    const float* luminance = frame.luminance.data() + at;
    const std::uint32_t* face = frame.face.data() + at;
    std::fill(marks_.begin(), marks_.end(), std::uint8_t{0});
    mark(luminance, face, 1, width - 1, marks_.data());
    mark(luminance + 1, face + 1, -1, width - 1, marks_.data() + 1);
    if (v + 1 < height) mark(luminance, face, width, width, marks_.data());
    if (v > 0) mark(luminance, face, -width, width, marks_.data());
    for (int u = 0; u < width; ++u)
      if (marks_[static_cast<std::size_t>(u)] != 0 && face[u] != CastFrame::kUnseen)
        edges_.push_back(static_cast<std::uint32_t>(at + u));
  }
}

/// Rays 4 k ... 4 k + 3 of a packet for pixel `at`; how wide the pixel is.
float Renderer::aim(RayPacket& rays, std::uint32_t at, std::size_t k, bool used) const {
  const int u = static_cast<int>(at) % width_px(), v = static_cast<int>(at) / width_px();
  const RayPacket& from = rays_.packet(v / 4, u / 4);
  const Vec3 centre = rays_.direction(u, v);
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 d = centre + kOffset_px[i][0] * from.du + kOffset_px[i][1] * from.dv;
    rays.x[4 * k + i] = d.x(), rays.y[4 * k + i] = d.y(), rays.z[4 * k + i] = d.z();
    rays.seen[4 * k + i] = used ? -1 : 0;
  }
  return from.pixel;
}

void Renderer::antialias(const CameraPose& pose, CastFrame& frame) {
  const FlushDenormals flush;
  find_edges(frame);
  PacketCast cast(*scene_, pose);
  RayPacket rays;
  for (std::size_t first = 0; first < edges_.size(); first += 4) {
    const std::size_t count = std::min<std::size_t>(4, edges_.size() - first);
    float pixel = 0;
    for (std::size_t i = 0; i < 4; ++i) pixel = aim(rays, edges_[first + std::min(i, count - 1)], i, i < count);
    cast.cast(rays, 0.5f * pixel);
    for (std::size_t i = 0; i < count; ++i) {
      const float* l = cast.luminance + 4 * i;
      frame.luminance[edges_[first + i]] = 0.25f * ((l[0] + l[1]) + (l[2] + l[3]));
    }
  }
}

}  // namespace wasp::sim
