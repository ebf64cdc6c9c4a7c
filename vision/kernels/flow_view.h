// A flow field as a pinhole camera with other axes would have it: each cell's two viewing directions, through whatever
// lens, become points of the plane at unit distance before the view's axis. There the flow of a translating camera is
// linear in inverse depth, and the flow over a plane at right angles to the axis a similarity, exactly. Also the frames
// of a FlowMessage: what its attitudes say of level and heading.
#pragma once

#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/flow_field.h"

namespace wasp::vision {

/// Axes of a view: x right, y down, z along its axis, as a camera's. The same twice unless the camera's own turn is to
/// be taken out by it.
struct FlowView {
  Mat3 R_view_first = Mat3::Identity();   ///< from the camera's axes at the first frame
  Mat3 R_view_second = Mat3::Identity();  ///< and at the second
  float focal_px = 525.f;                 ///< > 0: a point is focal_px (x/z, y/z), the axis at (0, 0)
  float max_angle_rad = 1.f;              ///< cells farther from the axis are invalid, 0 ... 1.4
};

/// Cell by cell, the same shape as `in`; a cell without a direction in the view becomes invalid, every cell does for a
/// bad view, lens or shape. `out` may be `in`. Realtime-safe: yes.
void view_flow(const Lens& lens, const FlowField& in, const FlowView& view, FlowField& out) WASP_REALTIME;

/// Level axes (x along the heading, y right, z down) from body axes: roll and pitch, not yaw. `q_ned_body` must be
/// usable (attitude_usable). Realtime-safe: yes.
Mat3 R_level_body_of(const std::array<float, 4>& q_ned_body) WASP_REALTIME;

/// Body axes of the two frames of a message.
struct FlowFrames {
  bool valid = false;  ///< the field has a shape, the interval is 0 ... 1 s, everything is finite
  float interval_s = 0;
  Mat3 R_second_first_body = Mat3::Identity();  ///< v_second = R v_first, body axes
  Mat3 R_level_first = Mat3::Identity();        ///< level axes of each frame from its body axes
  Mat3 R_level_second = Mat3::Identity();
};

/// Level and without turn where the message says the turn is unknown. Realtime-safe: yes.
FlowFrames frames_of(const FlowMessage& message, const Mat3& R_body_cam) WASP_REALTIME;

}  // namespace wasp::vision
