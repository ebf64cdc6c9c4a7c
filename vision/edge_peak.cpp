// Edges by row, the peak among them, its angle below the horizon, the wish.
#include "vision/edge_peak.h"

#include <algorithm>
#include <cmath>

#include "vision/kernels/camera_model.h"
#include "vision/kernels/derotate.h"

namespace wasp::vision {
namespace {

constexpr DurationNs kLongestHold = 20 * kSecond;

EdgePeakMode mode_of(const EdgePeak::Params& p) noexcept { return static_cast<EdgePeakMode>(p.mode); }

/// Columns [first, first + width) of a view.
template <class View>
View columns_of(View view, int first, int width) noexcept {
  view.data += first;
  view.width_px = width;
  return view;
}

/// A row histogram: `spacing_px` and `offset_px` say which image row an entry is.
struct Histogram {
  bool valid = false;
  std::span<const std::int32_t> counts;
  float offset_px = 0, spacing_px = 1;
  std::int64_t total = 0;
  float threshold = 0;
};

Histogram count_gradients(const EdgePeak::Params& p, const BehaviourInput& input, EdgeRows& rows) noexcept {
  const GrayView& gray = input.gray;
  const bool near = mode_of(p) == EdgePeakMode::kNear;
  const DepthView& depth = input.depth;
  if (near && (!depth.valid() || depth.width_px != gray.width_px || depth.height_px != gray.height_px)) return {};
  const int width = std::clamp(static_cast<int>(p.centre_share * static_cast<float>(gray.width_px)), 3, gray.width_px);
  const int first = (gray.width_px - width) / 2;
  EdgeRowsParams params{.min_threshold = p.min_threshold, .fixed_threshold = p.fixed_threshold};
  if (mode_of(p) == EdgePeakMode::kSharp) params.fixed_threshold = p.sharp_threshold;
  if (near) params.mask_beyond_m = p.max_depth_m, params.mask_unknown = true;
  count_edge_rows(params, columns_of(gray, first, width), near ? columns_of(depth, first, width) : DepthView{}, rows);
  return {rows.valid, {rows.count.data(), static_cast<std::size_t>(rows.height_px)},
          0.f,        1.f,
          rows.total, static_cast<float>(rows.threshold)};
}

Histogram count_motion(const EdgePeak::Params& p, const BehaviourInput& input, EdgePeak::State& state) noexcept {
  if (!state.emd) return {};
  EmdField field;
  state.emd->step(input.gray, field);
  if (!field.valid) return {};
  EmdRows& f = state.fired;
  state.emd->fire(p.emd_min_response, f);
  const auto pitch = static_cast<float>(f.pitch_px);
  return {f.rows > 0, {f.count.data(), static_cast<std::size_t>(f.rows)}, pitch - 0.5f, pitch, f.total, f.threshold};
}

/// Rows of the image's middle column as angles below the horizon, roll taken as small.
struct RowAngles {
  const Lens lens;
  const float tilt_rad;  ///< optical axis below the horizon

  RowAngles(const CameraGeometry& camera, const Vec3& up_cam) noexcept
      : lens(camera.lens()), tilt_rad(std::atan2(-up_cam.z(), -up_cam.y())) {}

  [[nodiscard]] float of_row(float row_px) const noexcept {
    Vec3 d;
    if (!direction_of(lens, {lens.intrinsics.cx_px, row_px}, d)) return NAN;
    return tilt_rad + std::atan2(d.y(), d.z());
  }
  /// The image's first or last row where the angle is outside the image.
  [[nodiscard]] float row_of(float angle_rad) const noexcept {
    const float below = angle_rad - tilt_rad;
    const auto last = static_cast<float>(lens.intrinsics.height_px - 1);
    Pixel pixel;
    if (!pixel_of(lens, {0.f, std::sin(below), std::cos(below)}, pixel)) return below > 0.f ? last : 0.f;
    return std::clamp(pixel.v_px, 0.f, last);
  }
};

float setpoint_rad(const EdgePeak::Params& p) noexcept {
  const Intrinsics& k = p.camera.intrinsics;
  return p.setpoint_rad > 0.f ? p.setpoint_rad : std::atan(0.25f * static_cast<float>(k.height_px) / k.fy_px);
}

/// Seconds from `then` to now; false when there is no telling.
bool since(TimeNs then_ns, TimeNs now_ns, double& seconds) noexcept {
  if (then_ns == kNever || now_ns < then_ns || now_ns / 2 - then_ns / 2 > kLongestHold / 2) return false;
  seconds = to_seconds(now_ns - then_ns);  // halves cannot overflow
  return true;
}

/// What the edges ask for, limited, with two kinds of patience. As a roof comes nearer, its edge sinks in the image
/// even if the vehicle does not climb, and Delta goes to zero too early: a wish to climb only fades. And a roof leaves
/// the image before it has been passed: no sinking just after it.
float wish(const EdgePeak::Params& p, bool near, float asked_mps, TimeNs now_ns, EdgePeak::State& state) noexcept {
  double age_s = 0;
  const bool follows = since(state.wished_at_ns, now_ns, age_s);
  const float fading = follows && p.release_s > 0.f
                           ? std::max(state.climb_mps, 0.f) * std::exp(-static_cast<float>(age_s) / p.release_s)
                           : 0.f;
  float climb_mps = asked_mps;
  if (fading > 0.05f) climb_mps = std::max(climb_mps, fading);
  if (near) state.near_at_ns = now_ns;
  if (!near && since(state.near_at_ns, now_ns, age_s) && age_s < static_cast<double>(p.hold_s))
    climb_mps = std::max(climb_mps, 0.f);
  state.climb_mps = std::clamp(climb_mps, near ? -p.max_sink_mps : -p.idle_sink_mps, p.max_climb_mps);
  state.wished_at_ns = now_ns;
  return state.climb_mps;
}

bool fits(const EdgePeak::Params& p, const GrayView& gray) noexcept {
  const Intrinsics& k = p.camera.intrinsics;
  return usable(k) && gray.valid() && gray.width_px == k.width_px && gray.height_px == k.height_px &&
         std::isfinite(p.gain_mps_rad + p.idle_sink_mps) && p.max_sink_mps >= 0.f && p.idle_sink_mps >= 0.f &&
         p.max_climb_mps >= 0.f;
}

std::optional<EmdGrid> detectors(const EdgePeak::Params& p) {
  const Intrinsics& k = p.camera.intrinsics;
  const int pitch = p.emd_pitch_px;
  const bool possible = pitch >= 2 && pitch <= 64 && k.width_px >= 2 * pitch && k.height_px >= 2 * pitch;
  if (mode_of(p) != EdgePeakMode::kMoving || !possible) return {};
  return EmdGrid(k.width_px, k.height_px, {.columns = 1, .rows = 1, .pitch_px = pitch, .mean_frames = 10.f});
}

}  // namespace

EdgePeak::State::State(const Params& params) : emd(detectors(params)) {}

CueBody EdgePeak::step(const Params& params, const BehaviourInput& input, State& state) noexcept {
  CueBody cue;
  if (!fits(params, input.gray)) return cue;
  const Histogram h = mode_of(params) == EdgePeakMode::kMoving ? count_motion(params, input, state)
                                                               : count_gradients(params, input, state.rows);
  if (!h.valid) return cue;
  const bool attitude = input.attitude_valid && attitude_usable(input.attitude.q_ned_body);
  const RowAngles angles(params.camera, up_in_camera(params.camera, attitude ? input.attitude.q_ned_body
                                                                             : std::array{1.f, 0.f, 0.f, 0.f}));
  const float wanted_rad = setpoint_rad(params);
  cue.detail[kSetpointRow_px] = angles.row_of(wanted_rad);
  cue.detail[kEdges] = static_cast<float>(h.total);
  cue.detail[kThreshold] = h.threshold;
  float climb_mps = -params.idle_sink_mps;
  const PeakRow peak = find_peak_row({params.window_rows, params.share}, h.counts);
  const bool near = peak.valid && h.total >= std::max(params.min_edges, 1);
  if (near) {
    const float row_px = h.offset_px + h.spacing_px * static_cast<float>(peak.row);
    const float delta_rad = wanted_rad - angles.of_row(row_px);
    if (!std::isfinite(delta_rad)) return CueBody{};
    climb_mps = params.gain_mps_rad * delta_rad;
    cue.detail[kPeakRow_px] = row_px;
    cue.detail[kDelta_px] = cue.detail[kSetpointRow_px] - row_px;
    cue.detail[kDelta_rad] = delta_rad;
    cue.detail[kPeakShare] = peak.count / peak.most;
    cue.detail[kPeakCount] = peak.count;
  }
  cue.validity = Validity::kValid;
  cue.has_climb = 1;
  cue.climb_mps = wish(params, near, climb_mps, input.exposed_at_ns, state);
  cue.quality = near ? 1.f : 0.5f;
  return cue;
}

}  // namespace wasp::vision
