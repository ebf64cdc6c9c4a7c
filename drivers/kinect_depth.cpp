#include "drivers/kinect_depth.h"

#include <algorithm>
#include <cmath>

namespace wasp::drivers {
namespace {

struct Row {
  KinectModel kind;
  std::string_view name;
  int coefficients;
  const KinectDepthModel* published;
};
constexpr std::array<Row, 3> kRows{{{KinectModel::kTwoGaussians, "two-gaussians", 6, &kThesisGaussians},
                                    {KinectModel::kTangent, "tangent", 3, &kMagnenatTangent},
                                    {KinectModel::kLinear, "linear", 2, &kBurrusLinear}}};

const Row& row_of(KinectModel kind) noexcept { return kRows[static_cast<std::size_t>(kind)]; }

double gaussian_cm(const double* abc, double raw) noexcept {
  const double t = (raw - abc[1]) / abc[2];
  return abc[0] * std::exp(-t * t);
}

bool sane(const KinectRange& r) noexcept {
  return r.min_m > 0.f && r.min_m < r.max_m && r.max_m <= 60.f;  // false for NaN
}

}  // namespace

int coefficient_count(KinectModel kind) noexcept { return row_of(kind).coefficients; }
std::string_view name_of(KinectModel kind) noexcept { return row_of(kind).name; }

bool published_model(std::string_view name, KinectDepthModel& out) noexcept {
  for (const Row& row : kRows)
    if (row.name == name) return out = *row.published, true;
  return false;
}

double model_depth_m(const KinectDepthModel& model, double raw) noexcept {
  const double* c = model.coefficients.data();
  switch (model.kind) {
    case KinectModel::kTwoGaussians:
      return 0.01 * (gaussian_cm(c, raw) + gaussian_cm(c + 3, raw));
    case KinectModel::kTangent:
      return c[2] * std::tan(raw / c[1] + c[0]);  // negative beyond the pole (published: raw 1,093)
    case KinectModel::kLinear:
      break;
  }
  return 1 / (c[0] * raw + c[1]);
}

float kinect_depth_m(const KinectDepthModel& model, int raw) noexcept {
  if (raw < 0 || raw >= kKinectNoReading || !sane(model.range)) return 0.f;
  const auto depth_m = static_cast<float>(model_depth_m(model, raw));
  return depth_m >= model.range.min_m && depth_m <= model.range.max_m ? depth_m : 0.f;
}

KinectTable make_kinect_table(const KinectDepthModel& model) noexcept {
  KinectTable table;
  for (int raw = 0; raw < kKinectRawValues; ++raw)
    table.mm[static_cast<std::size_t>(raw)] =
        static_cast<std::uint16_t>(std::lround(1000.f * kinect_depth_m(model, raw)));
  return table;
}

std::uint16_t kinect_raw(const KinectTable& table, int depth_mm) noexcept {
  const auto valid = [](std::uint16_t mm) { return mm != 0; };
  const auto first = std::find_if(table.mm.begin(), table.mm.end(), valid);
  const auto last = std::find_if_not(first, table.mm.end(), valid);
  if (depth_mm <= 0 || last - first < 2) return kKinectNoReading;
  const int low_step = first[1] - first[0] + 1, high_step = last[-1] - last[-2] + 1;
  if (depth_mm < first[0] - low_step || depth_mm > last[-1] + high_step) return kKinectNoReading;
  auto at = std::lower_bound(first, last, depth_mm);
  if (at == last || (at != first && depth_mm - at[-1] < *at - depth_mm)) --at;
  return static_cast<std::uint16_t>(at - table.mm.begin());
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

}  // namespace wasp::drivers
