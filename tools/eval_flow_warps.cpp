#include <algorithm>
#include <cmath>
#include <random>

#include "tools/eval_flow_pairs.h"

namespace wasp::tools {
namespace {

using Gray = drivers::Image<std::uint8_t>;

struct Point {
  double u, v;
};

double cubic(double x) {  // Catmull-Rom
  x = std::abs(x);
  if (x < 1) return 1 + x * x * (1.5 * x - 2.5);
  return x < 2 ? 2 + x * (-4 + x * (2.5 - 0.5 * x)) : 0;
}

double sample(const Gray& image, double u, double v) {
  const int u0 = static_cast<int>(std::floor(u)), v0 = static_cast<int>(std::floor(v));
  double sum = 0;
  for (int j = -1; j <= 2; ++j)
    for (int i = -1; i <= 2; ++i) {
      const int x = std::clamp(u0 + i, 0, image.width_px - 1), y = std::clamp(v0 + j, 0, image.height_px - 1);
      sum += cubic(u - (u0 + i)) * cubic(v - (v0 + j)) *
             image.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px) +
                          static_cast<std::size_t>(x)];
    }
  return sum;
}

}  // namespace

FlowPair make_flow_pair(const Gray& image, const FlowWarp& warp) {
  FlowPair pair{warp.name, image, image, {image.width_px, image.height_px, {}, {}, {}}};
  const double c = std::cos(warp.turn_deg * M_PI / 180), s = std::sin(warp.turn_deg * M_PI / 180);
  const Point centre{0.5 * (image.width_px - 1), 0.5 * (image.height_px - 1)};
  std::mt19937 random(1);
  std::normal_distribution<double> grain(0, 1);
  const auto grey = [](double x) { return static_cast<std::uint8_t>(std::clamp(std::lround(x), 0L, 255L)); };
  for (int v = 0; v < image.height_px; ++v)
    for (int u = 0; u < image.width_px; ++u) {
      const std::size_t at =
          static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width_px) + static_cast<std::size_t>(u);
      const double x = u - centre.u - warp.shift_u, y = v - centre.v - warp.shift_v;
      const double from_u = centre.u + (c * x + s * y) / warp.zoom, from_v = centre.v + (c * y - s * x) / warp.zoom;
      pair.second.pixels[at] = grey(sample(image, from_u, from_v) + warp.noise_gray * grain(random));
      pair.first.pixels[at] = grey(image.pixels[at] + warp.noise_gray * grain(random));
      const double to_u = warp.zoom * (c * (u - centre.u) - s * (v - centre.v)) + centre.u + warp.shift_u;
      const double to_v = warp.zoom * (s * (u - centre.u) + c * (v - centre.v)) + centre.v + warp.shift_v;
      pair.truth.u.push_back(static_cast<float>(to_u - u));
      pair.truth.v.push_back(static_cast<float>(to_v - v));
      const bool in = to_u >= 0 && to_v >= 0 && to_u < image.width_px && to_v < image.height_px;
      pair.truth.known.push_back(in ? 1 : 0);
    }
  return pair;
}

}  // namespace wasp::tools
