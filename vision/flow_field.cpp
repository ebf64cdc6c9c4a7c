// Compare with the last frame, keep the new one; depth waits a frame, for it belongs to the first of a pair.
#include "vision/flow_field.h"

#include <cmath>
#include <cstring>

#include "vision/kernels/camera_model.h"
#include "vision/kernels/derotate.h"
#include "vision/kernels/flow_points.h"
#include "vision/kernels/frame_rotation.h"

namespace wasp::vision {
namespace {

using D = FlowFieldDetail;

bool has_attitude(const BehaviourInput& input) noexcept {
  return input.attitude_valid && attitude_usable(input.attitude.q_ned_body);
}

float median_length_px(const FlowField& flow) noexcept {
  FlowPoints points;
  collect_points(flow, 0.f, 0.f, points);
  std::array<float, kMaxFlowPoints> length;
  for (std::size_t i = 0; i < points.view().size(); ++i)
    length[i] = std::sqrt(points.points[i].u * points.points[i].u + points.points[i].v * points.points[i].v);
  return median_in_place({length.data(), points.view().size()});
}

float turn_angle(const std::array<float, 9>& R) noexcept {
  return std::acos(std::clamp(0.5f * (R[0] + R[4] + R[8] - 1.f), -1.f, 1.f));
}

void fill_detail(const FlowMessage& message, int cells_with_depth, CueBody& cue) noexcept {
  int valid = 0;
  float residual = 0;
  for (int i = 0; i < message.seen.count(); ++i) {
    const FlowCell& cell = message.seen.cells[static_cast<std::size_t>(i)];
    if (cell.valid == 0) continue;
    ++valid;
    residual += cell.residual;
  }
  cue.detail[D::kValidCells] = static_cast<float>(valid);
  cue.detail[D::kMedianSeen_px] = median_length_px(message.seen);
  cue.detail[D::kMedianStill_px] = median_length_px(message.still);
  cue.detail[D::kInterval_s] = message.interval_s();
  cue.detail[D::kDerotated] = static_cast<float>(message.derotated);
  cue.detail[D::kTurn_rad] = turn_angle(message.R_second_first);
  cue.detail[D::kCellsWithDepth] = static_cast<float>(cells_with_depth);
  cue.detail[D::kResidual] = valid > 0 ? residual / static_cast<float>(valid) : 0.f;
}

}  // namespace

FlowFieldState::FlowFieldState(const FlowFieldParams& params)
    : grid_(params.camera.intrinsics.width_px, params.camera.intrinsics.height_px, params.grid),
      width_px_(params.camera.intrinsics.width_px),
      height_px_(params.camera.intrinsics.height_px),
      cells_(params.grid.columns * params.grid.rows),
      pixels_(static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_)) {
  const auto centre = [](int index, int count, int size_px) {  // of flow_grid.cpp's cells, to the nearest pixel
    const float pitch_px = static_cast<float>(size_px) / static_cast<float>(count);
    return static_cast<std::int16_t>(std::lround((static_cast<float>(index) + 0.5f) * pitch_px - 0.5f));
  };
  for (int i = 0; i < cells_; ++i)
    centres_[static_cast<std::size_t>(i)] = {centre(i % params.grid.columns, params.grid.columns, width_px_),
                                             centre(i / params.grid.columns, params.grid.rows, height_px_)};
}

GrayView FlowFieldState::last() const noexcept { return {pixels_.data(), width_px_, height_px_, width_px_}; }

bool FlowFieldState::follows(const FlowFieldParams& params, TimeNs now_ns) const noexcept {
  if (!has_last_ || now_ns <= last_at_ns_) return false;
  const auto gap_ns = static_cast<std::uint64_t>(now_ns) - static_cast<std::uint64_t>(last_at_ns_);  // cannot overflow
  return static_cast<double>(gap_ns) <= static_cast<double>(params.max_gap_s) * 1e9;
}

void FlowFieldState::compare(const FlowFieldParams& params, const BehaviourInput& input) noexcept {
  FlowMessage& m = message_;
  // The grid's pyramid of the last frame is there only if the last step compared it.
  if (made_)
    grid_.follow(last(), input.gray, m.seen);
  else
    grid_.track(last(), input.gray, m.seen);
  m.exposed_at_ns = input.exposed_at_ns;
  m.first_exposed_at_ns = last_at_ns_;
  m.frame_sequence = input.frame_sequence;
  m.derotated = has_attitude_ && has_attitude(input) ? 1 : 0;
  Mat3 R = Mat3::Identity();
  m.q_ned_body = {1, 0, 0, 0};
  if (has_attitude(input)) m.q_ned_body = input.attitude.q_ned_body;
  if (m.derotated != 0) {
    R = frame_rotation(params.camera.R_body_cam, last_q_ned_body_, m.q_ned_body);
    derotate(params.camera.lens(), m.seen, R, m.still);
  } else {
    m.still = m.seen;
  }
  for (int i = 0; i < 9; ++i) m.R_second_first[static_cast<std::size_t>(i)] = R(i / 3, i % 3);
  cells_with_depth_ = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(cells_); ++i) {
    m.depth_m[i] = 0.001f * static_cast<float>(depth_mm_[i]);
    cells_with_depth_ += m.seen.cells[i].valid != 0 && depth_mm_[i] != 0 ? 1 : 0;
  }
}

void FlowFieldState::keep(const FlowFieldParams& params, const BehaviourInput& input) noexcept {
  for (int v = 0; v < height_px_; ++v)
    std::memcpy(pixels_.data() + static_cast<std::ptrdiff_t>(v) * width_px_, input.gray.row(v),
                static_cast<std::size_t>(width_px_));
  has_last_ = true;
  last_at_ns_ = input.exposed_at_ns;
  has_attitude_ = has_attitude(input);
  if (has_attitude_) last_q_ned_body_ = input.attitude.q_ned_body;
  const auto count = static_cast<std::size_t>(cells_);
  const bool registered = input.depth.width_px == width_px_ && input.depth.height_px == height_px_;
  if (!registered ||
      !median_5x5_at(input.depth, {centres_.data(), count}, params.min_depth_pixels, {depth_mm_.data(), count}))
    depth_mm_ = {};
}

bool FlowFieldState::take(const FlowFieldParams& params, const BehaviourInput& input) noexcept {
  if (!input.gray.valid() || input.gray.width_px != width_px_ || input.gray.height_px != height_px_) {
    // The last frame stays; its pyramid does too, but "made" is also what says that there is a message.
    made_ = false;
    return false;
  }
  const bool compared = follows(params, input.exposed_at_ns);
  if (compared) compare(params, input);
  made_ = compared;
  keep(params, input);
  return made_;
}

CueBody flow_field_step(const FlowFieldParams& params, const BehaviourInput& input, FlowFieldState& state) noexcept {
  CueBody cue;
  if (!state.take(params, input)) return cue;
  fill_detail(*state.message(), state.cells_with_depth(), cue);
  const float valid = cue.detail[D::kValidCells];
  if (valid < static_cast<float>(params.min_valid_cells)) return cue;
  cue.validity = Validity::kValid;
  cue.quality = valid / static_cast<float>(state.message()->seen.count());
  return cue;
}

}  // namespace wasp::vision
