// Depth from flow and the camera's own motion. `printed` is (6.11): one depth from the horizontal and one from the
// vertical component, each singular on the focus of expansion's column or row. The default takes both components
// together: with e = (x/z, y/z) of the cell and the de-rotated motion known, X (e' - e) = -t_perp is solved for X by
// least squares, singular at the focus alone, and gated by how uncertain the quotient is. The flow across the lines
// through the focus owes nothing to depth: it corrects the rotation first, within its own uncertainty (a gyro's bias,
// its delay, a rolling shutter), because at small translation every milliradian left over is a large error of depth.
#pragma once

#include <array>

#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/camera_model.h"
#include "vision/kernels/derotate.h"
#include "vision/kernels/flow_field.h"

namespace wasp::vision {

struct FlowDepthParams {
  float flow_sigma_px = 0.3f;       ///< one sigma of a component of the flow
  float max_relative_sigma = 0.2f;  ///< a depth less certain than this is no depth
  float turn_sigma_rad = 0.00033f;  ///< one sigma of the given rotation between the frames; 0: it is exact. Default: a
                                    ///< gyro bias of 0.01 rad/s over 1/30 s
  float min_depth_m = 0.05f, max_depth_m = 100.f;
  float max_off_line_sigmas = 4.f;  ///< flow that far off the line through the focus belongs to no still point
};

/// One cell. Depth is along the optical axis (Markel's X), at the time of the first frame.
struct DepthCell {
  float depth_m = 0, sigma_m = 0;
  bool valid = false;
};

/// (6.11) as mended: a depth by each component.
struct PrintedDepthCell {
  float from_u_m = 0, from_v_m = 0;
  bool valid_u = false, valid_v = false;
};

/// What the camera did from the first frame to the second.
struct CameraStep {
  Vec3 velocity_cam_m_s = Vec3::Zero();  ///< the camera's own: right, down, forward
  Vec3 rate_cam_rad_s = Vec3::Zero();    ///< right, down, forward
  float interval_s = 0;                  ///< > 0
};

using DepthGrid = std::array<DepthCell, FlowField::kMaxColumns * FlowField::kMaxRows>;
using PrintedDepthGrid = std::array<PrintedDepthCell, FlowField::kMaxColumns * FlowField::kMaxRows>;

/// Index as in `flow`. All invalid for a bad camera step (see derotate) or one without translation.
/// Realtime-safe: yes.
void flow_depth(const FlowDepthParams& params, const Lens& lens, const FlowField& flow, const CameraStep& camera,
                DepthGrid& out) WASP_REALTIME;

/// (6.11) with the corrected signs, to first order in the rotation. A denominator within `max_relative_sigma` of zero
/// gives no depth. Realtime-safe: yes.
void flow_depth_printed(const FlowDepthParams& params, const Lens& lens, const FlowField& flow,
                        const CameraStep& camera, PrintedDepthGrid& out) WASP_REALTIME;

}  // namespace wasp::vision
