#include "vision/kernels/kinect_depth.h"

#include <algorithm>
#include <cmath>

namespace wasp::vision {
namespace {

struct Gaussian {
  double a_cm, b, c;
};
constexpr Gaussian kFirst{3.169e4, 1338.0, 140.4}, kSecond{6.334e18, 2.035e4, 3154.0};

double at(const Gaussian& g, double raw) noexcept {
  const double t = (raw - g.b) / g.c;
  return g.a_cm * std::exp(-t * t);
}

double two_gaussians_m(int raw) noexcept { return 0.01 * (at(kFirst, raw) + at(kSecond, raw)); }

/// Negative beyond the pole at raw 1,093: out of range there.
double tangent_m(int raw) noexcept { return 0.1236 * std::tan(raw / 2842.5 + 1.1863); }

bool sane(const KinectRange& r) noexcept {
  return r.min_m > 0.f && r.min_m < r.max_m && r.max_m <= 60.f;  // false for NaN
}

}  // namespace

float kinect_depth_m(KinectModel model, int raw, const KinectRange& range) noexcept {
  if (raw < 0 || raw >= kKinectNoReading || !sane(range)) return 0.f;
  const auto depth_m = static_cast<float>(model == KinectModel::kTangent ? tangent_m(raw) : two_gaussians_m(raw));
  return depth_m >= range.min_m && depth_m <= range.max_m ? depth_m : 0.f;
}

KinectTable make_kinect_table(KinectModel model, const KinectRange& range) noexcept {
  KinectTable table;
  for (int raw = 0; raw < kKinectRawValues; ++raw)
    table.mm[static_cast<std::size_t>(raw)] =
        static_cast<std::uint16_t>(std::lround(1000.f * kinect_depth_m(model, raw, range)));
  return table;
}

bool kinect_depth(const KinectTable& table, const ImageView<std::uint16_t>& raw, std::uint16_t* out_mm,
                  int out_stride_px) noexcept {
  if (!raw.valid() || out_mm == nullptr || out_stride_px < raw.width_px) return false;
  for (int v = 0; v < raw.height_px; ++v, out_mm += out_stride_px) {
    const std::uint16_t* from = raw.row(v);
    for (int u = 0; u < raw.width_px; ++u)
      out_mm[u] = table.mm[std::min<std::size_t>(from[u], std::size_t{kKinectNoReading})];
  }
  return true;
}

}  // namespace wasp::vision
