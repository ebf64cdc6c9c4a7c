// Camera geometry as data; the mathematics is vision/kernels/camera_model.h.
#pragma once

#include <array>
#include <cstdint>

#include "types/frames.h"

namespace wasp {

/// Pinhole intrinsics with radial-tangential distortion (D.12, D.13; OpenCV order k1 k2 p1 p2 k3).
struct Intrinsics {
  int width_px = 640, height_px = 480;
  float fx_px = 525.f, fy_px = 525.f;  ///< > 0
  float cx_px = 319.5f, cy_px = 239.5f;
  float k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
};

/// How pixels become directions. `kFisheye` is the equidistant model of Kannala and Brandt (2006) as OpenCV's fisheye
/// module has it: r = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8).
enum class LensKind : std::uint8_t { kPinhole, kFisheye };

struct Lens {
  LensKind kind = LensKind::kPinhole;
  Intrinsics intrinsics;             ///< k1 ... k3 are read for kPinhole only
  std::array<float, 4> fisheye_k{};  ///< k1 ... k4, read for kFisheye only
};

/// Where the camera sits on the body, and what it sees.
struct CameraGeometry {
  Intrinsics intrinsics;
  LensKind lens_kind = LensKind::kPinhole;
  std::array<float, 4> fisheye_k{};  ///< read for kFisheye only

  [[nodiscard]] Lens lens() const { return {lens_kind, intrinsics, fisheye_k}; }
  Mat3 R_body_cam = R_body_cam_from_pitch_down(Radians{0.0});
  Vec3 position_body_m = Vec3::Zero();  ///< camera centre in body axes [m]
};

}  // namespace wasp
