// Flow messages of a camera that moves in a world of planes, exact through its lens, with noise and outliers on
// request; and pictures of a far, textured sphere for the behaviours that make flow.
#pragma once

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "types/behaviour.h"
#include "types/camera.h"
#include "vision/kernels/derotate.h"

namespace wasp::vision::test {

/// n . p = d in NED.
struct FlowPlane {
  Vec3 normal_ned;
  float distance_m;
};

struct BodyAt {
  Vec3 position_ned_m = Vec3::Zero();
  Euler attitude;

  [[nodiscard]] Mat3 R_ned_cam(const CameraGeometry& camera) const {
    return quat_from_euler(attitude).toRotationMatrix() * camera.R_body_cam;
  }
  [[nodiscard]] Vec3 camera_ned_m(const CameraGeometry& camera) const {
    return position_ned_m + quat_from_euler(attitude) * camera.position_body_m;
  }
  [[nodiscard]] std::array<float, 4> q_ned_body() const {
    const Quat q = quat_from_euler(attitude);
    return {q.w(), q.x(), q.y(), q.z()};
  }
};

inline CameraGeometry pinhole(int width_px, int height_px, float hfov_rad, double pitch_down_rad) {
  CameraGeometry camera;
  camera.intrinsics = {.width_px = width_px, .height_px = height_px};
  camera.intrinsics.fx_px = camera.intrinsics.fy_px = 0.5f * static_cast<float>(width_px) / std::tan(hfov_rad / 2);
  camera.intrinsics.cx_px = 0.5f * static_cast<float>(width_px - 1);
  camera.intrinsics.cy_px = 0.5f * static_cast<float>(height_px - 1);
  camera.R_body_cam = R_body_cam_from_pitch_down(Radians{pitch_down_rad});
  return camera;
}

/// Equidistant, 170 degrees across the width, straight down.
inline CameraGeometry fisheye_down(int width_px = 640, int height_px = 480) {
  CameraGeometry camera = pinhole(width_px, height_px, 1.f, 1.5707963);
  camera.lens_kind = LensKind::kFisheye;
  camera.fisheye_k = {0.01f, -0.003f, 0.f, 0.f};
  camera.intrinsics.fx_px = camera.intrinsics.fy_px = 0.5f * static_cast<float>(width_px) / 1.48f;
  return camera;
}

struct FlowScene {
  CameraGeometry camera;
  std::vector<FlowPlane> planes;
  float noise_px = 0.f, outliers = 0.f;
  bool attitude = true;

  /// Motion of the camera from `a` to `b` over `interval_ns` until `now_ns`.
  [[nodiscard]] FlowMessage message(const BodyAt& a, const BodyAt& b, TimeNs now_ns, unsigned seed = 1,
                                    DurationNs interval_ns = 33 * kMillisecond) const {
    std::mt19937 random(seed);
    std::normal_distribution<float> noise(0.f, 1.f);
    std::uniform_real_distribution<float> pick(0.f, 1.f), large(-20.f, 20.f);
    FlowMessage m;
    m.exposed_at_ns = now_ns, m.first_exposed_at_ns = now_ns - interval_ns;
    m.derotated = attitude ? 1 : 0;
    if (attitude) m.q_ned_body = b.q_ned_body();
    const Mat3 R1 = a.R_ned_cam(camera), R2 = b.R_ned_cam(camera);
    const Vec3 c1 = a.camera_ned_m(camera), c2 = b.camera_ned_m(camera);
    const Lens lens = camera.lens();
    for (int i = 0; i < m.seen.count(); ++i) {
      FlowCell& cell = m.seen.cells[static_cast<std::size_t>(i)];
      const auto& k = camera.intrinsics;
      cell.x_px = (static_cast<float>(i % m.seen.columns) + 0.5f) * static_cast<float>(k.width_px) / 12.f - 0.5f;
      cell.y_px = (static_cast<float>(i / m.seen.columns) + 0.5f) * static_cast<float>(k.height_px) / 9.f - 0.5f;
      Vec3 d;
      if (!direction_of(lens, {cell.x_px, cell.y_px}, d)) continue;
      float range = 1e9f;
      for (const FlowPlane& p : planes) {
        const float along = p.normal_ned.dot(R1 * d), r = (p.distance_m - p.normal_ned.dot(c1)) / along;
        if (r > 0.05f && r < range) range = r;
      }
      Pixel end;
      if (range > 1e8f || !pixel_of(lens, R2.transpose() * (c1 + R1 * d * range - c2), end)) continue;
      cell.u_px = end.u_px - cell.x_px + noise_px * noise(random);
      cell.v_px = end.v_px - cell.y_px + noise_px * noise(random);
      if (pick(random) < outliers) cell.u_px += large(random), cell.v_px += large(random);
      cell.valid = 1, cell.quality = 1.f;
      m.depth_m[static_cast<std::size_t>(i)] = range * d.z();
    }
    const Mat3 R = attitude ? Mat3(R2.transpose() * R1) : Mat3(Mat3::Identity());
    for (int i = 0; i < 9; ++i) m.R_second_first[static_cast<std::size_t>(i)] = R(i / 3, i % 3);
    m.still = m.seen;
    if (attitude) derotate(lens, m.seen, R, m.still);
    return m;
  }
};

inline FlowPlane ground() { return {Vec3(0, 0, 1), 0.f}; }
inline FlowPlane wall_ahead(float north_m) { return {Vec3(1, 0, 0), north_m}; }
/// Floor, ceiling, two walls, far end.
inline std::vector<FlowPlane> corridor(float half_width_m = 1.2f, float end_m = 30.f) {
  return {ground(),
          {Vec3(0, 0, 1), -2.6f},
          {Vec3(0, 1, 0), half_width_m},
          {Vec3(0, 1, 0), -half_width_m},
          wall_ahead(end_m)};
}

inline BehaviourInput input_of(const FlowMessage& message) {
  BehaviourInput input;
  input.exposed_at_ns = message.exposed_at_ns;
  input.flow = &message;
  return input;
}

/// To the bit, but for padding.
inline bool same(const FlowField& a, const FlowField& b) {
  if (a.columns != b.columns || a.rows != b.rows) return false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(a.count()); ++i) {
    const FlowCell &p = a.cells[i], &q = b.cells[i];
    if (p.x_px != q.x_px || p.y_px != q.y_px || p.u_px != q.u_px || p.v_px != q.v_px || p.quality != q.quality ||
        p.residual != q.residual || p.valid != q.valid)
      return false;
  }
  return true;
}
inline bool same(const FlowMessage& a, const FlowMessage& b) {
  return a.exposed_at_ns == b.exposed_at_ns && a.first_exposed_at_ns == b.first_exposed_at_ns &&
         a.frame_sequence == b.frame_sequence && a.derotated == b.derotated && a.R_second_first == b.R_second_first &&
         a.q_ned_body == b.q_ned_body && same(a.seen, b.seen) && same(a.still, b.still) && a.depth_m == b.depth_m;
}

/// What is seen of a textured sphere at infinity: a sum of waves over the direction in NED.
class Sky {
 public:
  explicit Sky(unsigned seed, float finest_rad = 0.012f) {
    std::mt19937 random(seed);
    std::normal_distribution<float> normal(0.f, 1.f);
    std::uniform_real_distribution<float> size(1.f, 4.f), phase(0.f, 6.28f);
    for (Wave& w : waves_)
      w = {Vec3(normal(random), normal(random), normal(random)).normalized() * (1.f / (finest_rad * size(random))),
           phase(random)};
  }
  [[nodiscard]] std::uint8_t gray(const Vec3& direction_ned) const {
    float sum = 0;
    for (const Wave& w : waves_) sum += std::sin(w.number.dot(direction_ned) + w.phase);
    return static_cast<std::uint8_t>(std::fmin(255.f, std::fmax(0.f, 128.f + 14.f * sum)));
  }
  [[nodiscard]] std::vector<std::uint8_t> picture(const CameraGeometry& camera, const Euler& attitude) const {
    const auto& k = camera.intrinsics;
    const Mat3 R_ned_cam = quat_from_euler(attitude).toRotationMatrix() * camera.R_body_cam;
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(k.width_px * k.height_px));
    for (int v = 0; v < k.height_px; ++v)
      for (int u = 0; u < k.width_px; ++u) {
        Vec3 d;
        if (direction_of(camera.lens(), {static_cast<float>(u), static_cast<float>(v)}, d))
          pixels[static_cast<std::size_t>(v * k.width_px + u)] = gray(R_ned_cam * d);
      }
    return pixels;
  }

 private:
  struct Wave {
    Vec3 number;
    float phase;
  };
  std::array<Wave, 12> waves_;
};

}  // namespace wasp::vision::test
