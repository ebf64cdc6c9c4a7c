#include "sim/defocus.h"

#include <algorithm>
#include <array>
#include <cmath>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define WASP_SIM_WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define WASP_SIM_WIDE
#endif

namespace wasp::sim {
namespace {

constexpr float kSky_m = 1e4f;          ///< distance of what is not hit
constexpr float kSameDepth = 1.f / 32;  ///< faces that differ by less in depth are one layer
constexpr float kCovered = 0.98f;

struct Disc {
  int reach = 0;
  double variance = 0;  ///< along one axis [px^2]
  std::vector<double> weights;
};

/// Share of a disc's area in each pixel around its centre.
Disc disc(double radius_px) {
  constexpr int kParts = 16;
  Disc d;
  d.reach = static_cast<int>(std::floor(radius_px + 0.5));
  const int side = 2 * d.reach + 1;
  d.weights.resize(static_cast<std::size_t>(side * side));
  double sum = 0;
  for (int i = 0; i < side * kParts; ++i)
    for (int j = 0; j < side * kParts; ++j) {
      const double y = (i + 0.5) / kParts - 0.5 * side, x = (j + 0.5) / kParts - 0.5 * side;
      if (x * x + y * y > radius_px * radius_px) continue;
      d.weights[static_cast<std::size_t>(i / kParts * side + j / kParts)] += 1;
      sum += 1;
    }
  for (int i = 0; i < side * side; ++i) {
    double& w = d.weights[static_cast<std::size_t>(i)];
    w /= sum;
    d.variance += w * (i % side - d.reach) * (i % side - d.reach);
  }
  return d;
}

/// Adds one row of a kernel. `z` and `face` are those of the light's origin.
WASP_SIM_WIDE void add_row(const float* weights, int count, float light, float z, std::uint32_t face,
                           const float* there_z, const std::uint32_t* there_face, float* own, float* own_light,
                           float* near, float* near_light) {
  for (int i = 0; i < count; ++i) {
    const float tolerance = kSameDepth * z;
    const bool same = (there_face[i] == face) | (std::fabs(there_z[i] - z) < tolerance);
    const bool nearer = !same & (z < there_z[i]);
    const float a = same ? weights[i] : 0.f, b = nearer ? weights[i] : 0.f;
    own[i] += a, own_light[i] += a * light;
    near[i] += b, near_light[i] += b * light;
  }
}

}  // namespace

float circle_of_confusion_px(float aperture_m, float fx_px, float focus_m, float z_m) {
  return aperture_m * fx_px * std::fabs(1.f / z_m - 1.f / focus_m);
}

/// Of two neighbouring discs' coverages that share which gives the variance of the wanted one, r^2 / 4.
std::vector<Defocus::Kernel> Defocus::make_kernels() {
  std::vector<Kernel> kernels(static_cast<std::size_t>(kLevels));
  double larger_px = 0.5;
  Disc small = disc(larger_px), large = small;
  for (int level = 0; level < kLevels; ++level) {
    const double wanted = 0.25 * std::pow(static_cast<double>(level) / kStepsPerPixel, 2);
    while (large.variance < wanted) {
      small = std::move(large);
      large = disc(larger_px += 1.0 / 16);
    }
    const double share = wanted > small.variance ? (wanted - small.variance) / (large.variance - small.variance) : 0;
    Kernel& k = kernels[static_cast<std::size_t>(level)];
    k.reach = level == 0 ? 0 : large.reach;
    const int side = 2 * k.reach + 1;
    k.weights.assign(static_cast<std::size_t>(side * side), level == 0 ? 1.f : 0.f);
    if (level == 0) continue;
    const auto add = [&](const Disc& d, double weight) {
      for (int y = -d.reach; y <= d.reach; ++y)
        for (int x = -d.reach; x <= d.reach; ++x)
          k.weights[static_cast<std::size_t>((y + k.reach) * side + x + k.reach)] += static_cast<float>(
              weight * d.weights[static_cast<std::size_t>((y + d.reach) * (2 * d.reach + 1) + x + d.reach)]);
    };
    add(small, 1 - share);
    add(large, share);
  }
  return kernels;
}

Defocus::Defocus(const OpticsParams& optics, float fx_px, int width_px, int height_px)
    : optics_(optics),
      fx_px_(fx_px),
      width_px_(width_px),
      height_px_(height_px),
      stride_(width_px + 2 * kMargin),
      kernels_(make_kernels()) {
  const auto count = static_cast<std::size_t>(stride_) * static_cast<std::size_t>(height_px + 2 * kMargin);
  light_.resize(count);
  range_.resize(count);
  face_.resize(count);
  level_.resize(count);
  landed_ = {std::vector<float>(count), std::vector<float>(count), std::vector<float>(count),
             std::vector<float>(count)};
}

void Defocus::pad(const CastFrame& frame) {
  for (int v = 0; v < height_px_; ++v)
    for (int u = 0; u < width_px_; ++u) {
      const auto from = static_cast<std::size_t>(v * width_px_ + u), to = static_cast<std::size_t>(padded(u, v));
      const float z = frame.range[from] > 0.f ? frame.range[from] : kSky_m;
      const float radius = 0.5f * circle_of_confusion_px(optics_.aperture_m, fx_px_, optics_.focus_m, z);
      const bool seen = frame.face[from] != CastFrame::kUnseen;  // beyond the lens' field there is no light to spread
      level_[to] = static_cast<std::uint8_t>(seen ? std::min(radius, kMaxRadius_px) * kStepsPerPixel + 0.5f : 0.f);
      light_[to] = frame.luminance[from];
      range_[to] = z;
      face_[to] = frame.face[from];
    }
}

void Defocus::spread(std::ptrdiff_t at) {
  const auto i = static_cast<std::size_t>(at);
  const Kernel& k = kernels_[level_[i]];
  if (k.reach == 0) {
    landed_.own[i] += 1;
    landed_.own_light[i] += light_[i];
    return;
  }
  const int side = 2 * k.reach + 1;
  for (int row = 0; row < side; ++row) {
    const std::ptrdiff_t to = at + (row - k.reach) * stride_ - k.reach;
    add_row(k.weights.data() + row * side, side, light_[i], range_[i], face_[i], range_.data() + to, face_.data() + to,
            landed_.own.data() + to, landed_.own_light.data() + to, landed_.near.data() + to,
            landed_.near_light.data() + to);
  }
}

float Defocus::merged(std::ptrdiff_t at) const {
  const auto i = static_cast<std::size_t>(at);
  const float own = landed_.own[i];
  float behind = landed_.own_light[i] / own, value = behind;
  if (own < kCovered && level_[i] > 0) {  // the farther ones within its own disc
    const Kernel& k = kernels_[level_[i]];
    float weight = 0, light = 0;
    for (int y = -k.reach, w = 0; y <= k.reach; ++y)
      for (int x = -k.reach; x <= k.reach; ++x, ++w) {
        const auto there = static_cast<std::size_t>(at + y * stride_ + x);
        const bool farther = face_[there] != face_[i] && range_[there] > range_[i] * (1 + kSameDepth);
        const float a = farther ? k.weights[static_cast<std::size_t>(w)] : 0.f;
        weight += a, light += a * light_[there];
      }
    if (weight > 0.f) value = own * behind + (1 - own) * light / weight;
  }
  const float near = landed_.near[i];
  if (near <= 0.f) return value;
  return near < 1.f ? (1 - near) * value + landed_.near_light[i] : landed_.near_light[i] / near;
}

void Defocus::apply(CastFrame& frame) {
  pad(frame);
  for (std::vector<float>* plane : {&landed_.own, &landed_.own_light, &landed_.near, &landed_.near_light})
    std::fill(plane->begin(), plane->end(), 0.f);
  for (int v = 0; v < height_px_; ++v)
    for (int u = 0; u < width_px_; ++u) spread(padded(u, v));
  for (int v = 0; v < height_px_; ++v)
    for (int u = 0; u < width_px_; ++u) {
      const auto at = static_cast<std::size_t>(v * width_px_ + u);
      if (frame.face[at] != CastFrame::kUnseen) frame.luminance[at] = merged(padded(u, v));
    }
}

}  // namespace wasp::sim
