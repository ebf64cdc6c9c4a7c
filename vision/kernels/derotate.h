// Takes the flow that the camera's own rotation makes out of a flow grid. (6.10) gives that part to first order for an
// undistorted pinhole; here each cell's end point becomes a viewing direction through the lens model, is turned back by
// the finite rotation of the frame interval, and becomes a pixel again. To first order, and with the signs of (6.11),
// that is (6.10); over a large angle or a distorted lens it stays exact.
#pragma once

#include <array>

#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/camera_model.h"
#include "vision/kernels/flow_field.h"

namespace wasp::vision {

using wasp::Lens;
using wasp::LensKind;

/// Unit viewing direction of a pixel, camera axes (x right, y down, z forward). False where the model has no inverse.
/// At most kMaxNewton steps. Realtime-safe: yes.
bool direction_of(const Lens& lens, Pixel pixel, Vec3& direction) WASP_REALTIME;

/// Pixel of a direction. False behind a pinhole camera (z below 5 % of the length) or for a zero vector.
/// Realtime-safe: yes.
bool pixel_of(const Lens& lens, const Vec3& direction, Pixel& pixel) WASP_REALTIME;

/// Rate of the ray (eps_y, eps_z) = (x/z, y/z) of a point at rest at infinity [1/s], for `rate_cam_rad_s` = (right,
/// down, forward): the rotational part of (6.10) with the signs of (6.11); Markel's omega_x, omega_y, omega_z are
/// forward, right, down. Realtime-safe: yes.
std::array<float, 2> rotational_flow(Ray ray, const Vec3& rate_cam_rad_s) WASP_REALTIME;

/// Copies `in` and removes from each valid cell the motion due to `rate_cam_rad_s`, constant over `interval_s`, camera
/// axes. Cells whose pixels have no direction become invalid; all cells do for a rate or interval that is not finite,
/// an interval <= 0, a rotation beyond 0.5 rad or unusable intrinsics. `in` and `out` may be the same.
/// Realtime-safe: yes.
void derotate(const Lens& lens, const FlowField& in, const Vec3& rate_cam_rad_s, float interval_s,
              FlowField& out) WASP_REALTIME;

/// The same with the rotation from the first frame to the second given: a point at rest at infinity seen along d in the
/// first frame is seen along R_second_first d in the second. Realtime-safe: yes.
void derotate(const Lens& lens, const FlowField& in, const Mat3& R_second_first, FlowField& out) WASP_REALTIME;

}  // namespace wasp::vision
