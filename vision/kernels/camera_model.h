// Pinhole camera with radial-tangential distortion (thesis D.12, D.13; OpenCV's k1 k2 p1 p2 k3): pixel to ray and back.
// Distortion has no closed inverse: a Newton iteration of at most kMaxNewton steps, which reports when it did not land.
// Camera axes: x right, y down, z forward. A ray (x, y) stands for the direction (x, y, 1).
// Realtime-safe: yes, all of it.
#pragma once

#include <array>

#include "types/camera.h"
#include "types/realtime.h"

namespace wasp::vision {

/// Normalised image coordinates x = X/Z, y = Y/Z [-].
struct Ray {
  float x = 0, y = 0;
};
/// Pixel coordinates [px]; (0, 0) is the centre of the top left pixel.
struct Pixel {
  float u_px = 0, v_px = 0;
};

inline constexpr int kMaxNewton = 8;

/// True when sizes and focal lengths are positive and everything is finite.
bool usable(const Intrinsics& k) WASP_REALTIME;

/// True when any distortion coefficient is not zero.
bool distorted(const Intrinsics& k) WASP_REALTIME;

/// (D.12, D.13): ideal ray to the ray the lens makes of it.
Ray distort(const Intrinsics& k, Ray ideal) WASP_REALTIME;

/// Inverse of distort. False (and the best guess so far) when Newton did not converge to 1e-6, as it cannot beyond the
/// radius where the polynomial folds back.
bool undistort(const Intrinsics& k, Ray seen, Ray& ideal) WASP_REALTIME;

/// Ray to pixel.
Pixel project(const Intrinsics& k, Ray ray) WASP_REALTIME;

/// Pixel to ray; false as for undistort.
bool unproject(const Intrinsics& k, Pixel pixel, Ray& ray) WASP_REALTIME;

/// World "up" (-z of NED) in camera axes, unit. `q_ned_body` is w x y z and need not be normalised; level when it is
/// zero or not finite.
Vec3 up_in_camera(const CameraGeometry& geometry, const std::array<float, 4>& q_ned_body) WASP_REALTIME;

/// True when the quaternion is finite and of unit length within 5 %.
bool attitude_usable(const std::array<float, 4>& q_ned_body) WASP_REALTIME;

/// Where the horizon crosses the vertical line through the principal point, undistorted [px]; `valid` is false when
/// the camera looks so steeply up or down (beyond 80 degrees) that there is no such row.
struct HorizonRow {
  float v_px = 0;
  bool valid = false;
};
HorizonRow horizon_row(const Intrinsics& k, const Vec3& up_cam) WASP_REALTIME;

}  // namespace wasp::vision
