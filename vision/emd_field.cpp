// Respond, convert, derotate.
#include "vision/emd_field.h"

#include <algorithm>
#include <cmath>

#include "vision/kernels/camera_model.h"
#include "vision/kernels/derotate.h"
#include "vision/kernels/frame_rotation.h"

namespace wasp::vision {
namespace {

bool follows(const EmdFlow::Params& p, const EmdFlow::State& state, TimeNs now_ns) noexcept {
  if (state.last_at_ns == kNever || now_ns <= state.last_at_ns) return false;
  const auto gap_ns = static_cast<std::uint64_t>(now_ns) - static_cast<std::uint64_t>(state.last_at_ns);  // no overflow
  return static_cast<double>(gap_ns) <= static_cast<double>(p.max_gap_s) * 1e9;
}

FlowCell flow_cell(const EmdFlow::Params& p, const EmdCell& response) noexcept {
  FlowCell cell;
  if (!(response.contrast >= std::max(p.min_contrast, 1e-3f))) return cell;
  cell.u_px = p.px_per_response * response.right / response.contrast;
  cell.v_px = p.px_per_response * response.down / response.contrast;
  cell.quality = std::min(1.f, response.contrast / std::max(p.good_contrast, p.min_contrast));
  cell.valid = std::isfinite(cell.u_px + cell.v_px) ? 1 : 0;
  return cell;
}

void convert(const EmdFlow::Params& p, const EmdField& response, FlowField& out) noexcept {
  const Intrinsics& k = p.camera.intrinsics;
  out.columns = response.columns;
  out.rows = response.rows;
  const float across_px = static_cast<float>(k.width_px) / static_cast<float>(out.columns);
  const float down_px = static_cast<float>(k.height_px) / static_cast<float>(out.rows);
  for (int row = 0; row < out.rows; ++row)
    for (int column = 0; column < out.columns; ++column) {
      FlowCell& cell = out.at(column, row);
      cell = flow_cell(p, response.cells[static_cast<std::size_t>(row * out.columns + column)]);
      cell.x_px = (static_cast<float>(column) + 0.5f) * across_px - 0.5f;
      cell.y_px = (static_cast<float>(row) + 0.5f) * down_px - 0.5f;
    }
}

void derotate_message(const EmdFlow::Params& p, const BehaviourInput& input, const EmdFlow::State& state,
                      FlowMessage& m) noexcept {
  const bool attitude = input.attitude_valid && attitude_usable(input.attitude.q_ned_body);
  m.q_ned_body = attitude ? input.attitude.q_ned_body : std::array{1.f, 0.f, 0.f, 0.f};
  m.derotated = attitude && state.has_attitude ? 1 : 0;
  Mat3 R = Mat3::Identity();
  if (m.derotated != 0) R = frame_rotation(p.camera.R_body_cam, state.last_q_ned_body, m.q_ned_body);
  for (int i = 0; i < 9; ++i) m.R_second_first[static_cast<std::size_t>(i)] = R(i / 3, i % 3);
  if (m.derotated != 0)
    derotate(p.camera.lens(), m.seen, R, m.still);
  else
    m.still = m.seen;
}

int fill_detail(const FlowMessage& m, const EmdFlow::Params& p, const EmdField& response, CueBody& cue) noexcept {
  std::array<float, 2> sum{};
  std::array<int, 2> cells{};
  float contrast = 0;
  for (int i = 0; i < m.seen.count(); ++i) {
    const FlowCell& cell = m.seen.cells[static_cast<std::size_t>(i)];
    contrast += response.cells[static_cast<std::size_t>(i)].contrast / static_cast<float>(m.seen.count());
    if (cell.valid == 0) continue;
    const std::size_t side = 2 * (i % m.seen.columns) >= m.seen.columns ? 1 : 0;
    sum[side] += (side == 1 ? 1.f : -1.f) * cell.u_px / p.px_per_response;
    ++cells[side];
  }
  const int valid = cells[0] + cells[1];
  using D = EmdFlow::Detail;
  cue.detail[D::kValidCells] = static_cast<float>(valid);
  cue.detail[D::kLeft] = cells[0] > 0 ? sum[0] / static_cast<float>(cells[0]) : 0.f;
  cue.detail[D::kRight] = cells[1] > 0 ? sum[1] / static_cast<float>(cells[1]) : 0.f;
  cue.detail[D::kContrast] = contrast;
  cue.detail[D::kInterval_s] = m.interval_s();
  cue.detail[D::kDerotated] = static_cast<float>(m.derotated);
  return valid;
}

}  // namespace

EmdFlow::State::State(const Params& params)
    : grid(params.camera.intrinsics.width_px, params.camera.intrinsics.height_px, params.grid) {}

CueBody EmdFlow::step(const Params& params, const BehaviourInput& input, State& state) noexcept {
  CueBody cue;
  state.made = false;
  const Intrinsics& k = params.camera.intrinsics;
  if (!usable(k) || !input.gray.valid() || input.gray.width_px != k.width_px || input.gray.height_px != k.height_px)
    return cue;
  const bool continues = follows(params, state, input.exposed_at_ns);
  if (!continues) state.grid.reset();
  state.grid.step(input.gray, state.response);
  FlowMessage& m = state.message;
  if (continues && state.response.valid) {
    m.exposed_at_ns = input.exposed_at_ns;
    m.first_exposed_at_ns = state.last_at_ns;
    m.frame_sequence = input.frame_sequence;
    convert(params, state.response, m.seen);
    derotate_message(params, input, state, m);
    state.made = true;
    const int valid = fill_detail(m, params, state.response, cue);
    if (valid >= std::max(params.min_valid_cells, 1)) {
      cue.validity = Validity::kValid;
      cue.quality = static_cast<float>(valid) / static_cast<float>(m.seen.count());
    }
  }
  state.last_at_ns = input.exposed_at_ns;
  state.has_attitude = input.attitude_valid && attitude_usable(input.attitude.q_ned_body);
  if (state.has_attitude) state.last_q_ned_body = input.attitude.q_ned_body;
  return cue;
}

}  // namespace wasp::vision
