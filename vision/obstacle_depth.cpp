// Level flow, own speed, ranges, map, path; beside it the printed forces.
#include "vision/obstacle_depth.h"

#include <algorithm>
#include <cmath>

#include "vision/kernels/flow_points.h"

namespace wasp::vision {
namespace {

using Params = ObstacleDepth::Params;
using State = ObstacleDepth::State;
using Ranges = std::array<float, kMaxFlowPoints>;
using Readings = std::array<MapReading, kMaxFlowPoints>;

constexpr float kLeastSine2 = 0.06f;  // cells nearer than 14 degrees to the heading say little about speed
constexpr int kLeastCells = 4;

/// Median of the speeds at which cells with flow and depth are passed.
void measure_speed(const Params& p, std::span<const MapReading> readings, float dt_s, State& s) noexcept {
  std::array<float, kMaxFlowPoints> speeds;
  std::size_t n = 0;
  for (const MapReading& r : readings)
    if (r.closing_weight > kLeastSine2 && std::isfinite(r.closing_mps)) speeds[n++] = r.closing_mps;
  if (p.use_depth_camera == 0 || n < 6) return;
  const float now_mps = std::clamp(median_in_place({speeds.data(), n}), 0.f, 10.f);
  const float share = s.speed_mps < 0.f || !(dt_s > 0.f) ? 1.f : 1.f - std::exp(-dt_s / 0.25f);
  s.speed_mps = std::max(0.f, s.speed_mps + share * (now_mps - s.speed_mps));
}

/// The vehicle's motion into the next field as the printed law needs it.
CameraStep camera_step(const Params& p, const FlowMessage& m, const LevelFlow& flow, float speed_mps) noexcept {
  const auto& a = m.q_ned_body;
  const Quat q = Quat(a[0], a[1], a[2], a[3]).normalized();
  const Mat3 R_ned_body = q.toRotationMatrix();
  const Vec3 heading_ned = Vec3(R_ned_body(0, 0), R_ned_body(1, 0), 0.f).normalized();
  const Vec3 ahead_cam = p.camera.R_body_cam.transpose() * (R_ned_body.transpose() * heading_ned);
  return {.velocity_cam_m_s = ahead_cam * speed_mps, .rate_cam_rad_s = Vec3::Zero(), .interval_s = flow.interval_s};
}

/// Focus of expansion of a vehicle that flies along its heading; the principal point if that is out of the picture.
Pixel focus_of(const Params& p, const CameraStep& step) noexcept {
  Pixel focus;
  if (pixel_of(p.camera.lens(), step.velocity_cam_m_s, focus)) return focus;
  return {p.camera.intrinsics.cx_px, p.camera.intrinsics.cy_px};
}

struct Printed {
  ImageForce gross, fine;
  int obstacles = 0;
};

/// (6.11) to (6.16) over the de-rotated field.
Printed printed_forces(const Params& p, const FlowMessage& m, const CameraStep& step, State& s) noexcept {
  Printed out;
  const Pixel focus = focus_of(p, step);
  const GrossForce gross = gross_force({}, m.still, focus.u_px, focus.v_px);
  out.gross = s.gross.add(gross.force);
  PrintedDepthGrid depth;
  flow_depth_printed(p.flow_depth, p.camera.lens(), m.still, step, depth);
  std::array<float, kMaxObservations> from_u, from_v, x_px, y_px;
  std::size_t n = 0;
  for (int i = 0; i < m.still.count(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const PrintedDepthCell& d = depth[k];
    if (!d.valid_u || !d.valid_v) continue;  // singular cells are gated there
    from_u[n] = d.from_u_m, from_v[n] = d.from_v_m;
    x_px[n] = m.still.cells[k].x_px, y_px[n++] = m.still.cells[k].y_px;
  }
  if (n == 0) return out;
  const Clusters clusters = cluster_points(p.cluster, {from_u.data(), n}, {from_v.data(), n});
  const Obstacles obstacles = obstacles_of(clusters, {x_px.data(), n}, {y_px.data(), n});
  out.fine = fine_force(p.fine, obstacles, focus.u_px, focus.v_px, out.gross);
  out.obstacles = obstacles.count;
  return out;
}

/// Distance along each cell's direction: the depth camera's, else from flow, which is long if nothing moves.
void ranges_of(const Params& p, const LevelFlow& flow, float speed_mps, Ranges& out) noexcept {
  const float noise_radps = 3.f * p.flow_depth.flow_sigma_px / (p.camera.intrinsics.fx_px * flow.interval_s);
  for (std::size_t k = 0; k < flow.view().size(); ++k) {
    const LevelCell& cell = flow.cells[k];
    out[k] = p.use_depth_camera != 0 ? cell.depth_m : 0.f;
    if (out[k] > 0.f || !cell.moved) continue;
    const float sine = std::sqrt(std::max(0.f, 1.f - cell.first.x() * cell.first.x()));
    const Vec3 motion = (cell.second - cell.first) / flow.interval_s;
    const Vec3 away = cell.first * cell.first.x() - Vec3::UnitX();  // where translation along the heading sends it
    const float along = sine > 0.05f ? motion.dot(away) / sine : 0.f;
    if (along > 2.f * noise_radps && along < 10.f) out[k] = speed_mps * sine / along;
  }
}

void carry_along(const Params& p, const LevelFlow& flow, float dt_s, State& s) noexcept {
  const float speed_mps = std::max(0.f, s.speed_mps), turn_rad = flow.yaw_rate_radps * dt_s;
  s.travel_rad = (s.travel_rad - turn_rad) * std::exp(-dt_s / std::max(0.02f, p.path.drift_s));
  s.travel_rad = std::clamp(s.travel_rad, -0.8f, 0.8f);
  const float forward_m = speed_mps * std::cos(s.travel_rad) * dt_s;
  advance(p.map, {dt_s, forward_m, speed_mps * std::sin(s.travel_rad) * dt_s, turn_rad}, s.map);
}

float nearest_m(const ObstacleMap& map) noexcept {
  float least = 0.f;
  for (const MapPoint& p : map.sector)
    if (p.known && p.x_m > 0.f)
      least = least > 0.f ? std::min(least, std::hypot(p.x_m, p.y_m)) : std::hypot(p.x_m, p.y_m);
  return least;
}

/// Time since the last field; 0, and a new start, after a gap or when time went backwards.
float time_step(TimeNs now_ns, State& s) noexcept {
  const float since_s = s.started ? elapsed_s(s.last_ns, now_ns) : 0.f;
  const bool follows = since_s > 0.f && since_s < kMaxFlowInterval_s;
  if (!follows) s = {};
  s.last_ns = now_ns;
  s.started = true;
  return follows ? since_s : 0.f;
}

/// Angle between neighbouring columns of cells, in the middle of the picture.
float spacing_of(const Intrinsics& k, const FlowField& field) noexcept {
  return static_cast<float>(k.width_px) / k.fx_px / static_cast<float>(field.columns);
}

PathChoice find_path(const Params& p, const LevelFlow& flow, std::span<const MapReading> readings, float spacing_rad,
                     float speed_mps, State& s) noexcept {
  observe(p.map, readings, spacing_rad, speed_mps, s.map);
  PathChoice path;
  if (speed_mps >= p.least_speed_mps)
    path = free_path(p.path, s.map, {speed_mps, flow.yaw_rate_radps, s.travel_rad}, s.first_rad);
  s.first_rad = path.first_rad;
  return path;
}

void speak(const Params& p, const PathChoice& path, const Printed& printed, std::size_t cells, const State& s,
           float speed_mps, CueBody& cue) noexcept {
  const float printed_radps = p.fine_gain * printed.fine.x;
  cue.heading_rate_radps =
      std::clamp(p.printed != 0 ? printed_radps : path.rate_radps, -p.path.max_rate_radps, p.path.max_rate_radps);
  if (!std::isfinite(cue.heading_rate_radps)) {
    cue = {};
    return;
  }
  cue.validity = Validity::kValid;
  cue.has_heading_rate = 1;
  if (p.printed == 0 && path.stuck) cue.has_pitch = 1, cue.pitch_rad = p.brake_rad;
  cue.quality = std::min(1.f, static_cast<float>(cells) / 60.f);
  cue.detail = {printed.gross.x,
                printed.fine.x,
                static_cast<float>(printed.obstacles),
                std::min(path.clearance_m, p.map.max_range_m),
                std::min(path.straight_clearance_m, p.map.max_range_m),
                speed_mps,
                path.first_rad,
                nearest_m(s.map)};
}

}  // namespace

CueBody ObstacleDepth::step(const Params& params, const BehaviourInput& input, State& state) noexcept {
  CueBody cue;
  LevelFlow flow;
  level_flow(params.camera, input.flow, FlowKind::kStill, flow);
  if (!flow.valid || !std::isfinite(flow.yaw_rate_radps)) return cue;
  const FlowMessage& m = *input.flow;
  const float dt_s = time_step(m.exposed_at_ns, state);
  carry_along(params, flow, dt_s, state);
  Ranges ranges;
  Readings readings;
  ranges_of(params, flow, state.speed_mps < 0.f ? params.speed_mps : state.speed_mps, ranges);
  const auto cells = static_cast<std::size_t>(
      map_readings(params.map, flow, {ranges.data(), static_cast<std::size_t>(flow.count)}, readings));
  if (cells < kLeastCells) return cue;
  const std::span<MapReading> seen(readings.data(), cells);
  const float spacing_rad = spacing_of(params.camera.intrinsics, m.still);
  drop_lone(spacing_rad, seen);
  measure_speed(params, seen, dt_s, state);
  const float speed_mps = state.speed_mps < 0.f ? params.speed_mps : state.speed_mps;
  const Printed printed = printed_forces(params, m, camera_step(params, m, flow, std::max(speed_mps, 0.05f)), state);
  const PathChoice path = find_path(params, flow, seen, spacing_rad, speed_mps, state);
  speak(params, path, printed, cells, state, speed_mps, cue);
  return cue;
}

}  // namespace wasp::vision
