// A corridor with things and walking people in it, a vehicle that flies along it by what behaviours say, and the flow
// fields its camera would give: ray casting at the cells' centres, motion of the points hit, noise of flow, depth and
// gyro, cells that drop out. Kinematic and light: a flight of half a minute takes a fraction of a second, so that a
// test flies dozens. Everything follows from the seed.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "types/behaviour.h"
#include "types/camera.h"
#include "vision/kernels/derotate.h"

namespace wasp::vision::test {

/// A box that stands on the floor; people are boxes that walk along the corridor and turn round at its ends.
struct Box {
  float x_m = 0, y_m = 0, half_x_m = 0.2f, half_y_m = 0.2f, tall_m = 2.f;
  float walk_mps = 0;          ///< towards -x when negative; 0: stands
  float from_m = 0, to_m = 0;  ///< the stretch walked to and fro
};

struct Corridor {
  float width_m = 2.5f, length_m = 24.f, ceiling_m = 2.6f;
  bool open = false;                          ///< no walls, floor only
  float blank_left = 0.f, blank_right = 0.f;  ///< share of a wall's cells that have no texture
  std::vector<Box> boxes;
};

struct FlightParams {
  int width_px = 320, height_px = 240, columns = 12, rows = 9;
  float hfov_rad = 1.5708f, pitch_down_rad = 0.f;
  float rate_hz = 30.f, cue_age_s = 0.06f, control_hz = 20.f;
  float speed_mps = 0.8f, height_m = 1.f;
  float start_y_m = 0, start_heading_rad = 0;
  float yaw_lag_s = 0.3f, speed_lag_s = 1.f, drift_lag_s = 0.7f;
  float flow_noise_px = 0.08f, dropout = 0.1f, wild = 0.01f;  ///< wild: share of cells with a wrong match
  float gyro_noise_radps = 0.004f, gyro_bias_radps = 0.005f;
  float depth_noise = 1.42e-3f, depth_dropout = 0.05f;  ///< sigma over z^2
  float least_depth_m = 0.4f, greatest_depth_m = 7.f;
  bool depth = true, derotated = true;
  float gust_mps2 = 0.15f;  ///< standard deviation of sideways acceleration, correlated over a second
  float half_width_m = 0.3f;
};

struct Vehicle {
  float x_m = 0, y_m = 0, heading_rad = 0, yaw_rate_radps = 0;
  float vx_mps = 0, vy_mps = 0;  ///< over ground, along and across the corridor
  float roll_rad = 0, pitch_rad = 0;
  float height_m = 1;
  [[nodiscard]] Quat attitude() const { return quat_from_euler({roll_rad, pitch_rad, heading_rad}); }
  [[nodiscard]] float forward_mps() const { return vx_mps * std::cos(heading_rad) + vy_mps * std::sin(heading_rad); }
  [[nodiscard]] float right_mps() const { return vy_mps * std::cos(heading_rad) - vx_mps * std::sin(heading_rad); }
};

/// One flight. `wish(message)` is asked at each field and answers with heading rate and pitch.
struct SteeringWish {
  float heading_rate_radps = 0, pitch_rad = 0;
};

struct FlightLog {
  std::vector<float> time_s, x_m, y_m, heading_rad, speed_mps, clearance_m, rate_radps;
  bool collided = false, arrived = false;
  float collided_at_m = 0, least_clearance_m = 1e6f;

  /// RMS of y beyond `from_m` along the corridor.
  [[nodiscard]] float lateral_rms_m(float from_m) const {
    double sum = 0;
    int n = 0;
    for (std::size_t i = 0; i < y_m.size(); ++i)
      if (x_m[i] >= from_m) sum += static_cast<double>(y_m[i]) * static_cast<double>(y_m[i]), ++n;
    return n > 0 ? static_cast<float>(std::sqrt(sum / n)) : 0.f;
  }
  /// Largest |y| between two places along the corridor.
  [[nodiscard]] float largest_m(float from_m, float to_m) const {
    float most = 0;
    for (std::size_t i = 0; i < y_m.size(); ++i)
      if (x_m[i] >= from_m && x_m[i] < to_m) most = std::max(most, std::abs(y_m[i]));
    return most;
  }
};

class CorridorFlight {
 public:
  CorridorFlight(const FlightParams& params, Corridor world, unsigned seed)
      : p_(params), world_(std::move(world)), random_(seed), geometry_(geometry_of(params)) {
    now_.y_m = p_.start_y_m, now_.heading_rad = p_.start_heading_rad, now_.height_m = p_.height_m;
    now_.vx_mps = p_.speed_mps * std::cos(now_.heading_rad), now_.vy_mps = p_.speed_mps * std::sin(now_.heading_rad);
    bias_radps_ = p_.gyro_bias_radps * (2.f * uniform() - 1.f);
  }

  static CameraGeometry geometry_of(const FlightParams& p) {
    CameraGeometry g;
    const float f = 0.5f * static_cast<float>(p.width_px) / std::tan(0.5f * p.hfov_rad);
    g.intrinsics = {.width_px = p.width_px,
                    .height_px = p.height_px,
                    .fx_px = f,
                    .fy_px = f,
                    .cx_px = 0.5f * static_cast<float>(p.width_px - 1),
                    .cy_px = 0.5f * static_cast<float>(p.height_px - 1)};
    g.R_body_cam = R_body_cam_from_pitch_down(Radians{static_cast<double>(p.pitch_down_rad)});
    return g;
  }
  [[nodiscard]] const CameraGeometry& geometry() const { return geometry_; }
  [[nodiscard]] const Vehicle& vehicle() const { return now_; }
  [[nodiscard]] float time_s() const { return static_cast<float>(tick_) / kTick_hz; }
  Vehicle& set_vehicle() { return now_; }

  /// Flies until the end of the corridor, a collision, or `seconds` are over.
  template <class Wish>
  FlightLog fly(float seconds, Wish wish) {
    FlightLog log;
    const auto frame_ticks = static_cast<long>(kTick_hz / p_.rate_hz),
               control_ticks = static_cast<long>(kTick_hz / p_.control_hz);
    while (time_s() < seconds) {
      if (tick_ % frame_ticks == 0) {
        take_frame();
        if (message_.exposed_at_ns > message_.first_exposed_at_ns && frames_ > 1)
          waiting_.push_back({time_s() + p_.cue_age_s, wish(message_)});
        note(log);
        if (log.collided || log.arrived) return log;
      }
      if (tick_ % control_ticks == 0) control();
      move(1.f / kTick_hz);
      ++tick_;
    }
    return log;
  }

  /// Advances the vehicle by one frame with this wish and returns the field; for open-loop tests.
  const FlowMessage& next_field() {
    take_frame();
    const auto frame_ticks = static_cast<long>(kTick_hz / p_.rate_hz);
    for (long i = 0; i < frame_ticks; ++i) move(1.f / kTick_hz), ++tick_;
    return message_;
  }
  void command(const SteeringWish& wish) { command_ = wish; }

 private:
  static constexpr float kTick_hz = 600.f;
  struct Waiting {
    float from_s;
    SteeringWish wish;
  };
  struct Hit {
    float range_m = 1e6f;
    int box = -1;  ///< index, or -1: corridor
    int wall = 0;  ///< -1 left, 1 right, 0 other
  };

  float uniform() { return std::uniform_real_distribution<float>(0.f, 1.f)(random_); }
  float normal() { return std::normal_distribution<float>(0.f, 1.f)(random_); }

  [[nodiscard]] Vec3 camera_position() const { return {now_.x_m, now_.y_m, -now_.height_m}; }

  /// Nearest surface along a unit direction, world axes (x along, y right, z down).
  [[nodiscard]] Hit cast(const Vec3& o, const Vec3& d) const {
    Hit hit;
    const auto plane = [&](float at, float from, float along, int wall) {
      if (std::abs(along) < 1e-6f) return;
      const float t = (at - from) / along;
      if (t > 1e-3f && t < hit.range_m) hit.range_m = t, hit.box = -1, hit.wall = wall;
    };
    plane(0.f, o.z(), d.z(), 0);
    if (!world_.open) {
      plane(-world_.ceiling_m, o.z(), d.z(), 0);
      plane(-0.5f * world_.width_m, o.y(), d.y(), -1);
      plane(0.5f * world_.width_m, o.y(), d.y(), 1);
      plane(world_.length_m, o.x(), d.x(), 0);
      plane(-3.f, o.x(), d.x(), 0);
    }
    for (std::size_t i = 0; i < world_.boxes.size(); ++i) {
      const Box& b = world_.boxes[i];
      const Vec3 low(b.x_m - b.half_x_m, b.y_m - b.half_y_m, -b.tall_m),
          high(b.x_m + b.half_x_m, b.y_m + b.half_y_m, 0.f);
      float in = 1e-3f, out = hit.range_m;
      for (int axis = 0; axis < 3; ++axis) {
        const float inverse = 1.f / (std::abs(d[axis]) < 1e-9f ? 1e-9f : d[axis]);
        const float a = (low[axis] - o[axis]) * inverse, c = (high[axis] - o[axis]) * inverse;
        in = std::max(in, std::min(a, c)), out = std::min(out, std::max(a, c));
      }
      if (in < out) hit.range_m = in, hit.box = static_cast<int>(i), hit.wall = 0;
    }
    return hit;
  }

  /// What one cell of the previous frame sees, and where that is now.
  struct Seen {
    bool hit = false, blank = false;
    Vec3 point = Vec3::Zero();
    float depth_m = 0;
    int box = -1;
    float box_x_m = 0;
  };

  void look_through_cells(std::vector<Seen>& out) {
    out.assign(static_cast<std::size_t>(p_.columns * p_.rows), {});
    const Mat3 R = now_.attitude().toRotationMatrix() * geometry_.R_body_cam;
    for (int r = 0; r < p_.rows; ++r)
      for (int c = 0; c < p_.columns; ++c) {
        Seen& s = out[static_cast<std::size_t>(r * p_.columns + c)];
        Vec3 d;
        if (!direction_of(geometry_.lens(), centre(c, r), d)) continue;
        const Hit hit = cast(camera_position(), R * d);
        if (hit.range_m > 100.f) continue;
        s.hit = true;
        s.point = camera_position() + R * d * hit.range_m;
        s.depth_m = hit.range_m * d.z();
        s.box = hit.box;
        if (hit.box >= 0) s.box_x_m = world_.boxes[static_cast<std::size_t>(hit.box)].x_m;
        const float blank = hit.wall < 0 ? world_.blank_left : hit.wall > 0 ? world_.blank_right : 0.f;
        s.blank = blank > 0.f && uniform() < blank;
      }
  }

  [[nodiscard]] Pixel centre(int c, int r) const {
    return {(static_cast<float>(c) + 0.5f) * static_cast<float>(p_.width_px) / static_cast<float>(p_.columns) - 0.5f,
            (static_cast<float>(r) + 0.5f) * static_cast<float>(p_.height_px) / static_cast<float>(p_.rows) - 0.5f};
  }

  /// Field from the frame before to this one; then this one becomes the one before.
  void take_frame() {
    const Mat3 R_world_cam = now_.attitude().toRotationMatrix() * geometry_.R_body_cam;
    const TimeNs now_ns = kSecond + from_seconds(static_cast<double>(tick_) / static_cast<double>(kTick_hz));
    message_ = {};
    message_.exposed_at_ns = now_ns;
    message_.first_exposed_at_ns = frames_ > 0 ? last_ns_ : now_ns;
    message_.frame_sequence = static_cast<std::uint32_t>(frames_);
    const Quat q = now_.attitude();
    message_.q_ned_body = {q.w(), q.x(), q.y(), q.z()};
    message_.seen.columns = message_.still.columns = p_.columns;
    message_.seen.rows = message_.still.rows = p_.rows;
    if (frames_ > 0) fill_cells(R_world_cam);
    last_R_ = R_world_cam;
    last_ns_ = now_ns;
    look_through_cells(last_seen_);
    ++frames_;
  }

  void fill_cells(const Mat3& R_world_cam) {
    for (int r = 0; r < p_.rows; ++r)
      for (int c = 0; c < p_.columns; ++c) fill_cell(c, r, R_world_cam);
    const float dt_s = message_.interval_s();
    const Vec3 error = Vec3(normal(), normal(), normal()) * p_.gyro_noise_radps * dt_s +
                       Vec3(bias_radps_, bias_radps_, bias_radps_) * dt_s;
    Mat3 R = R_world_cam.transpose() * last_R_;
    if (error.norm() > 0.f) R = Eigen::AngleAxisf(error.norm(), error.normalized()).toRotationMatrix() * R;
    message_.still = message_.seen;
    if (!p_.derotated) return;
    message_.derotated = 1;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) message_.R_second_first[static_cast<std::size_t>(3 * i + j)] = R(i, j);
    derotate(geometry_.lens(), message_.seen, R, message_.still);
  }

  void fill_cell(int c, int r, const Mat3& R_world_cam) {
    const auto k = static_cast<std::size_t>(r * p_.columns + c);
    const Seen& s = last_seen_[k];
    FlowCell& cell = message_.seen.cells[k];
    const Pixel at = centre(c, r);
    cell.x_px = at.u_px, cell.y_px = at.v_px;
    if (!s.hit) return;
    Vec3 point = s.point;
    if (s.box >= 0) point.x() += world_.boxes[static_cast<std::size_t>(s.box)].x_m - s.box_x_m;
    Pixel to;
    const float z_m = s.depth_m + p_.depth_noise * s.depth_m * s.depth_m * normal();
    if (p_.depth && uniform() >= p_.depth_dropout && z_m >= p_.least_depth_m && z_m <= p_.greatest_depth_m)
      message_.depth_m[k] = z_m;
    if (uniform() < p_.dropout || s.blank ||
        !pixel_of(geometry_.lens(), R_world_cam.transpose() * (point - camera_position()), to))
      return;
    cell.u_px = to.u_px - at.u_px + p_.flow_noise_px * normal();
    cell.v_px = to.v_px - at.v_px + p_.flow_noise_px * normal();
    if (uniform() < p_.wild) cell.u_px += 8.f * normal(), cell.v_px += 8.f * normal();
    cell.quality = 1.f, cell.valid = 1;
  }

  void control() {
    std::optional<SteeringWish> newest;
    while (!waiting_.empty() && waiting_.front().from_s <= time_s())
      newest = waiting_.front().wish, waiting_.erase(waiting_.begin());
    if (newest) command_ = *newest;
    const float wanted = std::clamp(command_.heading_rate_radps, -0.8f, 0.8f);
    sent_radps_ += std::clamp(wanted - sent_radps_, -4.f / p_.control_hz, 4.f / p_.control_hz);
  }

  void move(float dt_s) {
    constexpr float kGravity = 9.81f;
    now_.yaw_rate_radps += (sent_radps_ - now_.yaw_rate_radps) * dt_s / p_.yaw_lag_s;
    gust_mps2_ += -gust_mps2_ * dt_s + p_.gust_mps2 * std::sqrt(2.f * dt_s) * normal();
    const float ahead =
        std::clamp((p_.speed_mps - now_.forward_mps()) / p_.speed_lag_s, -2.f, 2.f) - kGravity * command_.pitch_rad;
    const float right = std::clamp(-now_.right_mps() / p_.drift_lag_s, -2.f, 2.f);
    const float c = std::cos(now_.heading_rad), s = std::sin(now_.heading_rad);
    now_.vx_mps += (ahead * c - right * s) * dt_s;
    now_.vy_mps += (ahead * s + right * c + gust_mps2_) * dt_s;
    now_.roll_rad += (right / kGravity - now_.roll_rad) * dt_s / 0.15f;
    now_.pitch_rad += (-ahead / kGravity - now_.pitch_rad) * dt_s / 0.15f;
    now_.x_m += now_.vx_mps * dt_s, now_.y_m += now_.vy_mps * dt_s;
    now_.heading_rad += now_.yaw_rate_radps * dt_s;
    for (Box& b : world_.boxes) walk(b, dt_s);
  }

  /// People turn round at the ends of their stretch and do not walk into the vehicle's back.
  void walk(Box& b, float dt_s) const {
    if (b.walk_mps == 0.f) return;
    const bool behind = b.x_m < now_.x_m + 0.1f;
    if (behind && b.walk_mps > 0.f) return;
    b.x_m += b.walk_mps * dt_s;
    if (b.x_m < b.from_m) b.walk_mps = std::abs(b.walk_mps);
    if (b.x_m > b.to_m) b.walk_mps = -std::abs(b.walk_mps);
  }

  /// Distance from the vehicle's rim to the nearest surface at its height.
  [[nodiscard]] float clearance_m() const {
    float least = world_.open ? 1e6f : 0.5f * world_.width_m - std::abs(now_.y_m);
    if (!world_.open) least = std::min(least, world_.length_m - now_.x_m);
    for (const Box& b : world_.boxes) {
      if (b.tall_m < now_.height_m - 0.15f) continue;
      const float dx = std::max(0.f, std::abs(now_.x_m - b.x_m) - b.half_x_m),
                  dy = std::max(0.f, std::abs(now_.y_m - b.y_m) - b.half_y_m);
      least = std::min(least, std::hypot(dx, dy));
    }
    return least - p_.half_width_m;
  }

  void note(FlightLog& log) const {
    const float clearance = clearance_m();
    log.time_s.push_back(time_s()), log.x_m.push_back(now_.x_m), log.y_m.push_back(now_.y_m);
    log.heading_rad.push_back(now_.heading_rad), log.speed_mps.push_back(now_.forward_mps());
    log.clearance_m.push_back(clearance), log.rate_radps.push_back(sent_radps_);
    log.least_clearance_m = std::min(log.least_clearance_m, clearance);
    if (clearance < 0.f) log.collided = true, log.collided_at_m = now_.x_m;
    log.arrived = now_.x_m > world_.length_m - 3.f;
  }

  FlightParams p_;
  Corridor world_;
  std::mt19937 random_;
  CameraGeometry geometry_;
  Vehicle now_;
  FlowMessage message_;
  std::vector<Seen> last_seen_;
  std::vector<Waiting> waiting_;
  Mat3 last_R_ = Mat3::Identity();
  TimeNs last_ns_ = 0;
  long tick_ = 0, frames_ = 0;
  float bias_radps_ = 0, gust_mps2_ = 0, sent_radps_ = 0;
  SteeringWish command_;
};

/// 2.4 ... 2.6 m wide; things along the walls, 3 ... 5 m apart, that leave at least 1.3 m; two people who walk towards
/// the vehicle and back in stretches without things and leave at least 1.2 m.
inline Corridor busy_corridor(unsigned seed) {
  std::mt19937 random(seed * 7919u + 1u);
  const auto between = [&random](float a, float b) { return std::uniform_real_distribution<float>(a, b)(random); };
  Corridor c;
  c.width_m = between(2.4f, 2.6f), c.length_m = 36.f;
  float side = between(0.f, 1.f) < 0.5f ? -1.f : 1.f;
  const float free_from[2] = {between(9.f, 11.f), between(21.f, 23.f)};
  for (float x = 4.f; x < c.length_m - 4.f; x += between(3.f, 5.f)) {
    if (between(0.f, 1.f) < 0.7f) side = -side;
    const float reach = between(0.35f, c.width_m - 1.3f), half_x = between(0.15f, 0.35f), tall = between(0.6f, 2.2f);
    const bool walked =
        (x > free_from[0] - 1.5f && x < free_from[0] + 7.5f) || (x > free_from[1] - 1.5f && x < free_from[1] + 7.5f);
    if (!walked) c.boxes.push_back({x, side * 0.5f * (c.width_m - reach), half_x, 0.5f * reach, tall});
  }
  for (const float from : free_from) {
    const float half_y = between(0.2f, 0.27f), side_p = between(0.f, 1.f) < 0.5f ? -1.f : 1.f;
    const float gap = between(1.2f, c.width_m - 2.f * half_y - 0.05f);  // free on the other side
    const float y = side_p * (gap + half_y - 0.5f * c.width_m);
    c.boxes.push_back(
        {between(from + 2.f, from + 6.f), y, 0.15f, half_y, 1.75f, -between(0.3f, 0.8f), from, from + 6.f});
  }
  return c;
}

}  // namespace wasp::vision::test
