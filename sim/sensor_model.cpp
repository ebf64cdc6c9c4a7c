#include "sim/sensor_model.h"

#include <algorithm>
#include <cmath>

#include "sim/random.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define WASP_SIM_WIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define WASP_SIM_WIDE
#endif

namespace wasp::sim {
namespace {

constexpr drivers::KinectDepthModel kModel = drivers::kBurrusLinear;
constexpr auto kRawOffset = static_cast<float>(kModel.coefficients[1]);  ///< 1/z = offset - scale * raw
constexpr auto kRawScale = static_cast<float>(-kModel.coefficients[0]);
constexpr float kBaseline_m = 0.075f;

WASP_SIM_WIDE void quantise(const float* depth_m, std::int32_t* raw, int width, std::uint32_t key, float noise_steps,
                            float dropout) {
  for (int u = 0; u < width; ++u) {
    const std::uint32_t hash = mix(key + static_cast<std::uint32_t>(u));
    const float z = std::max(depth_m[u], 0.05f);
    const float exact = (kRawOffset - 1.f / z) * (1.f / kRawScale);
    const float noisy = exact + noise_steps * rough_normal_of(hash);
    const float far = z * (1.f / 7.f);
    const float lost = dropout * (1.f + 9.f * far * far * far * far);
    const bool dropped = uniform_of(hash * 0x9e3779b9u) < lost || depth_m[u] <= 0.f;
    const auto value = static_cast<std::int32_t>(std::min(std::max(noisy + 0.5f, 0.f), 2046.f));
    raw[u] = dropped ? drivers::kKinectNoReading : value;
  }
}

WASP_SIM_WIDE void expose(const float* luminance, std::uint8_t* out, int width, std::uint32_t key, float gain,
                          float read_variance, float photon_noise) {
  for (int u = 0; u < width; ++u) {
    const float signal = gain * luminance[u];
    const float sigma = std::sqrt(read_variance + photon_noise * std::max(signal, 0.f));
    const float value = signal + sigma * rough_normal_of(mix(key + static_cast<std::uint32_t>(u)));
    out[u] = static_cast<std::uint8_t>(static_cast<std::int32_t>(std::min(std::max(value + 0.5f, 0.f), 255.f)));
  }
}

}  // namespace

SensorModel::SensorModel(const SensorParams& params, int width_px, float fx_px, std::uint32_t seed)
    : params_(params),
      width_px_(width_px),
      projector_px_m_(fx_px * kBaseline_m),
      seed_(mix(seed)),
      to_mm_(drivers::make_kinect_table({kModel.kind, kModel.coefficients, {params.min_range_m, params.max_range_m}})),
      raw_(static_cast<std::size_t>(width_px)),
      seen_(static_cast<std::size_t>(width_px)) {}

std::uint32_t SensorModel::row_key(std::uint32_t frame, int row, std::uint32_t stream) const {
  return mix(mix(seed_ + stream, frame), static_cast<std::uint32_t>(row));
}

/// The projector's column of what is seen at u is p = u - f B / z. Going left, p must fall: where it does not,
/// something nearer stands in the light. Where it falls by less than a fifth of a pixel the light grazes.
void SensorModel::mark_shadows(const float* depth_m) {
  float least = 1e9f;
  for (int u = width_px_ - 1; u >= 0; --u) {
    const auto i = static_cast<std::size_t>(u);
    // Where nothing is hit there is nothing to cast a shadow, nor to be in one.
    const float disparity_px = depth_m[u] > 0.f ? projector_px_m_ / std::max(depth_m[u], 0.05f) : 0.f;
    const float p = static_cast<float>(u) - disparity_px;
    seen_[i] = p < least - 0.2f;
    least = std::min(least, p);
  }
}

void SensorModel::exact_row(const float* depth_m, std::uint16_t* out_mm) const {
  for (int u = 0; u < width_px_; ++u) {
    const float z = depth_m[u];
    const bool in_range = z >= params_.min_range_m && z <= params_.max_range_m;
    out_mm[u] = in_range ? static_cast<std::uint16_t>(std::lround(z * 1000)) : std::uint16_t{0};
  }
}

void SensorModel::depth_row(std::uint32_t frame, int row, const float* depth_m, std::uint16_t* out_mm) {
  if (!params_.noise) return exact_row(depth_m, out_mm);
  quantise(depth_m, raw_.data(), width_px_, row_key(frame, row, 1), params_.depth_noise_steps, params_.dropout);
  mark_shadows(depth_m);
  for (std::size_t u = 0; u < raw_.size(); ++u)
    out_mm[u] = seen_[u] != 0 ? to_mm_.mm[static_cast<std::size_t>(raw_[u])] : std::uint16_t{0};
}

void SensorModel::gray_row(std::uint32_t frame, int row, const float* luminance, std::uint8_t* out) const {
  const float on = params_.noise ? 1.f : 0.f;
  expose(luminance, out, width_px_, row_key(frame, row, 2), params_.gain, on * params_.read_noise * params_.read_noise,
         on * params_.photon_noise);
}

}  // namespace wasp::sim
