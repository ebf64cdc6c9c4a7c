// Level view, focus, disc, growth, line, gates, hold.
#include "vision/time_to_contact.h"

#include <algorithm>
#include <cmath>

#include "vision/kernels/flow_view.h"
#include "vision/kernels/foe.h"
#include "vision/kernels/similarity_fit.h"
#include "vision/kernels/time_to_contact.h"

namespace wasp::vision {
namespace {

using Behaviour = TimeToContactFront;
using D = Behaviour::Detail;

constexpr DurationNs kLongestPause = 300 * kMillisecond;  // between pairs of one line
constexpr DurationNs kLongestTime = 20 * kSecond;         // every configured time is shorter

DurationNs from_seconds(float s) noexcept {
  return std::clamp(static_cast<DurationNs>(static_cast<double>(s) * 1e9), DurationNs{0}, kLongestTime);
}

/// `since` is not later than `now`, and not longer ago than `limit`. Halves cannot overflow.
bool within(TimeNs now_ns, TimeNs since_ns, DurationNs limit_ns) noexcept {
  return since_ns <= now_ns && now_ns / 2 - since_ns / 2 <= limit_ns / 2;
}

float focal_px(const Behaviour::Params& p) noexcept {
  return std::sqrt(p.camera.intrinsics.fx_px * p.camera.intrinsics.fy_px);
}

/// Both ends of a cell's flow are in the camera's axes at the first frame.
void view_ahead(const Behaviour::Params& p, const FlowMessage& message, const FlowFrames& frames,
                FlowField& ahead) noexcept {
  const Mat3 R_view_first =
      R_body_cam_from_pitch_down(Radians{0.0}).transpose() * frames.R_level_first * p.camera.R_body_cam;
  const FlowView view{.R_view_first = R_view_first,
                      .R_view_second = R_view_first,
                      .focal_px = focal_px(p),
                      .max_angle_rad = p.foe_angle_rad};
  view_flow(p.camera.lens(), message.still, view, ahead);
}

/// The focus found in this field moves the one kept; without one it stays for a while.
void update_foe(const Behaviour::Params& p, const FlowField& ahead, TimeNs now_ns, float interval_s,
                Behaviour::State& state) noexcept {
  const float focal = focal_px(p);
  const Foe found = find_foe({.max_sigma_px = p.max_foe_sigma_rad * focal}, ahead);
  if (state.has_foe && !within(now_ns, state.foe_at_ns, from_seconds(p.foe_memory_s))) state.has_foe = false;
  if (!state.has_foe) state.foe = {};
  const Ray ray{found.x_px / focal, found.y_px / focal};
  if (!found.valid || !found.expanding || !(std::sqrt(ray.x * ray.x + ray.y * ray.y) <= std::tan(p.max_drift_rad)))
    return;
  const float weight = p.foe_smoothing_s > 0.f ? 1.f - std::exp(-interval_s / p.foe_smoothing_s) : 1.f;
  state.foe = {state.foe.x + weight * (ray.x - state.foe.x), state.foe.y + weight * (ray.y - state.foe.y)};
  state.foe_at_ns = now_ns;
  state.has_foe = true;
}

/// Leaves the cells within the disc about the focus valid; returns how many. The disc grows in a few steps where the
/// grid is coarse, or the focus at the border of the image or beyond.
int cut_disc(const Behaviour::Params& p, const Ray& foe, FlowField& ahead) noexcept {
  constexpr int kSteps = 4;
  const float focal = focal_px(p);
  const Vec3 axis = Vec3(foe.x, foe.y, 1.f).normalized();
  std::array<float, FlowField::kMaxColumns * FlowField::kMaxRows> cosine{};
  for (std::size_t i = 0; i < cosine.size(); ++i)
    cosine[i] = Vec3(ahead.cells[i].x_px / focal, ahead.cells[i].y_px / focal, 1.f).normalized().dot(axis);
  int cells = 0;
  float least_cosine = 1.f;
  for (int step = 0; step <= kSteps && cells < p.wanted_cells; ++step) {
    const float wider = std::max(p.widest_angle_rad - p.ahead_angle_rad, 0.f);
    least_cosine = std::cos(p.ahead_angle_rad + wider * static_cast<float>(step) / kSteps);
    cells = 0;
    for (std::size_t i = 0; i < cosine.size(); ++i)
      cells += ahead.cells[i].valid != 0 && cosine[i] >= least_cosine ? 1 : 0;
  }
  for (std::size_t i = 0; i < cosine.size(); ++i)
    if (!(cosine[i] >= least_cosine)) ahead.cells[i].valid = 0;
  return cells;
}

/// Growth of the disc. Valid cue when it could be measured, whether or not it is significant.
TimeToContact measure(const Behaviour::Params& p, const FlowField& disc, const Ray& foe, CueBody& cue) noexcept {
  const float focal = focal_px(p);
  const SimilarityFit fit = fit_similarity({.centre_x_px = foe.x * focal,
                                            .centre_y_px = foe.y * focal,
                                            .min_cells = p.min_cells,
                                            .min_inlier_share = p.min_inlier_share},
                                           disc);
  if (fit.cells > 0) cue.detail[D::kInlierShare] = static_cast<float>(fit.inliers) / static_cast<float>(fit.cells);
  if (!fit.valid) return {};
  cue.validity = Validity::kValid;
  cue.quality = cue.detail[D::kInlierShare];
  return contact_from_scale({.significance = p.significance}, fit.log_scale, fit.log_scale_sigma, 1);
}

/// The line through the last pairs, in milliseconds; true: avoid.
bool decide(const Behaviour::Params& p, float contact_s, TimeNs now_ns, Behaviour::State& state,
            CueBody& cue) noexcept {
  if (!state.has_pair || !within(now_ns, state.last_pair_at_ns, kLongestPause)) state.monitor.reset();
  state.has_pair = true;
  state.last_pair_at_ns = now_ns;
  const AvoidDecision decision = state.monitor.add(now_ns / kMillisecond, contact_s * 1e3f);
  if (!decision.ready) return false;
  const float contact_frames = contact_s / p.frame_s;
  cue.detail[D::kPValue] = decision.line.p_value;
  cue.detail[D::kLineContact_frames] = decision.contact_in_frames * 1e-3f / p.frame_s;
  cue.detail[D::kSlope] = decision.line.slope;
  return decision.avoid && contact_frames > 0.f && contact_frames <= p.max_contact_frames &&
         decision.line.slope >= p.least_slope && decision.line.slope <= p.greatest_slope;
}

void hold(const Behaviour::Params& p, TimeNs now_ns, bool avoid, Behaviour::State& state, CueBody& cue) noexcept {
  if (avoid) state.has_avoid = true, state.avoided_at_ns = now_ns;
  if (state.has_avoid && !within(now_ns, state.avoided_at_ns, from_seconds(p.hold_s))) state.has_avoid = false;
  cue.avoid = state.has_avoid ? 1 : 0;
}

}  // namespace

TimeToContactFront::State::State(const Params& params) noexcept
    : monitor({.pairs = params.pairs,
               .frames_ahead = params.frames_ahead * params.frame_s * 1e3f,
               .max_p_value = params.max_p_value}) {}

CueBody TimeToContactFront::step(const Params& params, const BehaviourInput& input, State& state) noexcept {
  CueBody cue;
  cue.detail[kPValue] = 1.f;
  if (input.flow == nullptr) return cue;
  const FlowMessage& message = *input.flow;
  const TimeNs now_ns = message.exposed_at_ns;
  const FlowFrames frames = frames_of(message, params.camera.R_body_cam);
  if (!frames.valid || !(params.frame_s > 0.f)) return cue;
  if (state.has_last && now_ns < state.last_at_ns) state = State(params);  // another flight
  state.has_last = true;
  state.last_at_ns = now_ns;
  hold(params, now_ns, false, state, cue);
  if (message.derotated == 0) return cue;

  FlowField ahead;
  view_ahead(params, message, frames, ahead);
  update_foe(params, ahead, now_ns, frames.interval_s, state);
  cue.detail[kFoeRight_rad] = std::atan(state.foe.x);
  cue.detail[kFoeDown_rad] = std::atan(state.foe.y);
  cue.detail[kCells] = static_cast<float>(cut_disc(params, state.foe, ahead));
  const TimeToContact contact = measure(params, ahead, state.foe, cue);
  bool avoid = false;
  if (contact.valid) {
    const float contact_s = contact.frames * frames.interval_s;
    cue.detail[kContact_frames] = contact_s / params.frame_s;
    avoid = decide(params, contact_s, now_ns, state, cue);
  }
  hold(params, now_ns, avoid, state, cue);
  return cue;
}

}  // namespace wasp::vision
