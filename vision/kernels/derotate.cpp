#include "vision/kernels/derotate.h"

#include <algorithm>
#include <cmath>

namespace wasp::vision {
namespace {

constexpr float kMaxAngleRad = 0.5f;
constexpr float kMinForward = 0.05f;  // z over length: a pinhole does not see farther out than 87 degrees

float polynomial(const std::array<float, 4>& k, float t2) noexcept {
  return 1.f + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3])));
}

float slope(const std::array<float, 4>& k, float t2) noexcept {
  return 1.f + t2 * (3.f * k[0] + t2 * (5.f * k[1] + t2 * (7.f * k[2] + t2 * 9.f * k[3])));
}

/// Angle from the axis whose image radius (in focal lengths) is `radius`.
bool fisheye_angle(const std::array<float, 4>& k, float radius, float& theta) noexcept {
  theta = radius;
  for (int i = 0; i < kMaxNewton; ++i) {
    const float t2 = theta * theta, d = slope(k, t2);
    if (!(d > 0.05f)) return false;
    const float error = theta * polynomial(k, t2) - radius;
    if (std::abs(error) < 1e-6f) break;
    theta -= error / d;
  }
  return theta >= 0.f && theta < 3.1f && std::abs(theta * polynomial(k, theta * theta) - radius) < 1e-5f;
}

void invalidate(FlowField& field) noexcept {
  for (FlowCell& cell : field.cells) cell.valid = 0;
}

bool derotate_cell(const Lens& lens, const Mat3& R_first_second, FlowCell& cell) noexcept {
  Vec3 seen;
  Pixel still;
  const Pixel end{cell.x_px + cell.u_px, cell.y_px + cell.v_px};
  if (!direction_of(lens, end, seen) || !pixel_of(lens, R_first_second * seen, still)) return false;
  cell.u_px = still.u_px - cell.x_px;
  cell.v_px = still.v_px - cell.y_px;
  return std::isfinite(cell.u_px + cell.v_px);
}

}  // namespace

bool direction_of(const Lens& lens, Pixel pixel, Vec3& direction) noexcept {
  const Intrinsics& k = lens.intrinsics;
  if (!std::isfinite(pixel.u_px + pixel.v_px)) return false;
  if (lens.kind == LensKind::kPinhole) {
    Ray ray;
    if (!unproject(k, pixel, ray)) return false;
    direction = Vec3(ray.x, ray.y, 1.f).normalized();
    return true;
  }
  const float x = (pixel.u_px - k.cx_px) / k.fx_px, y = (pixel.v_px - k.cy_px) / k.fy_px;
  const float radius = std::sqrt(x * x + y * y);
  float theta = 0;
  if (!fisheye_angle(lens.fisheye_k, radius, theta)) return false;
  const float across = radius > 1e-6f ? std::sin(theta) / radius : 1.f;
  direction = {x * across, y * across, std::cos(theta)};
  return true;
}

bool pixel_of(const Lens& lens, const Vec3& direction, Pixel& pixel) noexcept {
  const Intrinsics& k = lens.intrinsics;
  const float length = direction.norm();
  if (!(length > 0.f)) return false;
  if (lens.kind == LensKind::kPinhole) {
    if (!(direction.z() > kMinForward * length)) return false;
    pixel = project(k, {direction.x() / direction.z(), direction.y() / direction.z()});
    return true;
  }
  const float across = std::sqrt(direction.x() * direction.x() + direction.y() * direction.y());
  const float theta = std::atan2(across, direction.z());
  const float factor = across > 1e-6f * length ? theta * polynomial(lens.fisheye_k, theta * theta) / across
                                               : 1.f / std::max(direction.z(), 1e-6f * length);
  pixel = {k.fx_px * factor * direction.x() + k.cx_px, k.fy_px * factor * direction.y() + k.cy_px};
  return true;
}

std::array<float, 2> rotational_flow(Ray e, const Vec3& rate) noexcept {
  const float x = rate.z(), y = rate.x(), z = rate.y();  // Markel's axes
  return {x * e.y + y * e.x * e.y - z * (1.f + e.x * e.x), -x * e.x - z * e.x * e.y + y * (1.f + e.y * e.y)};
}

void derotate(const Lens& lens, const FlowField& in, const Mat3& R_second_first, FlowField& out) noexcept {
  out = in;
  if (!usable(lens.intrinsics) || !R_second_first.allFinite() || in.columns < 0 || in.rows < 0 ||
      in.columns > FlowField::kMaxColumns || in.rows > FlowField::kMaxRows)
    return invalidate(out);
  const Mat3 R_first_second = R_second_first.transpose();
  for (int i = 0; i < out.count(); ++i) {
    FlowCell& cell = out.cells[static_cast<std::size_t>(i)];
    if (cell.valid != 0 && !derotate_cell(lens, R_first_second, cell)) cell.valid = 0;
  }
}

void derotate(const Lens& lens, const FlowField& in, const Vec3& rate_cam_rad_s, float interval_s,
              FlowField& out) noexcept {
  const Vec3 turn = rate_cam_rad_s * interval_s;
  const float angle = turn.norm();
  if (!(interval_s > 0.f) || !(angle < kMaxAngleRad)) {  // false for NaN too
    out = in;
    return invalidate(out);
  }
  const Vec3 axis = angle > 0.f ? Vec3(turn / angle) : Vec3(Vec3::UnitZ());
  // The camera turns by +angle, so a fixed direction turns by -angle in its axes.
  const Mat3 R_second_first = Eigen::AngleAxisf(-angle, axis).toRotationMatrix();
  derotate(lens, in, R_second_first, out);
}

}  // namespace wasp::vision
