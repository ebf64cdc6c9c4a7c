// Pack, correlate, judge the gap, speak.
#include "vision/heading_log_polar.h"

#include <cmath>
#include <cstring>

namespace wasp::vision {
namespace {

/// Without padding: the tables of the map are for one stride.
GrayView pack(const GrayView& image, std::vector<std::uint8_t>& packed) noexcept {
  if (image.stride_px == image.width_px) return image;
  const auto width = static_cast<std::size_t>(image.width_px);
  for (int v = 0; v < image.height_px; ++v)
    std::memcpy(packed.data() + static_cast<std::size_t>(v) * width, image.row(v), width);
  return {packed.data(), image.width_px, image.height_px, image.width_px};
}

/// Time since the last frame [s]; 0 when there is none, or time does not increase.
double gap_s(const HeadingLogPolarDown::State& state, TimeNs now_ns) noexcept {
  if (!state.has_last || now_ns <= state.last_at_ns) return 0;
  return 1e-9 * static_cast<double>(static_cast<std::uint64_t>(now_ns) - static_cast<std::uint64_t>(state.last_at_ns));
}

}  // namespace

HeadingLogPolarDown::State::State(const Params& params)
    : maps(params.camera.intrinsics.width_px, params.camera.intrinsics.height_px, params.camera.intrinsics.width_px,
           params.regions),
      packed(static_cast<std::size_t>(params.camera.intrinsics.width_px) *
             static_cast<std::size_t>(params.camera.intrinsics.height_px)) {}

CueBody HeadingLogPolarDown::step(const Params& params, const BehaviourInput& input, State& state) noexcept {
  CueBody cue;
  const Intrinsics& k = params.camera.intrinsics;
  cue.detail[kHeading_rad] = static_cast<float>(state.heading_rad);
  if (!input.gray.valid() || input.gray.width_px != k.width_px || input.gray.height_px != k.height_px ||
      state.packed.size() != static_cast<std::size_t>(k.width_px) * static_cast<std::size_t>(k.height_px)) {
    state.maps.reset();
    state.has_last = false;
    return cue;
  }
  const double interval_s = gap_s(state, input.exposed_at_ns);
  state.has_last = true;
  state.last_at_ns = input.exposed_at_ns;
  if (!(interval_s > 0) || interval_s > static_cast<double>(params.max_gap_s)) state.maps.reset();
  const HeadingRate turn = state.maps.step(pack(input.gray, state.packed));
  if (!turn.valid || !(turn.yaw_sigma_rad <= params.max_sigma) || !(turn.height_ratio_sigma <= params.max_sigma))
    return cue;
  state.heading_rad += static_cast<double>(params.scale * turn.yaw_rad);
  cue.detail[kHeading_rad] = static_cast<float>(state.heading_rad);
  cue.quality = 1.f - turn.yaw_sigma_rad / params.max_sigma;
  speak_heading(turn, params.scale, params.gain, static_cast<float>(interval_s), cue);
  return cue;
}

}  // namespace wasp::vision
