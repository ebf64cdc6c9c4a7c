#include "vision/kernels/emd_grid.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace wasp::vision {
namespace {

EmdParams checked(const EmdParams& p, int width_px, int height_px) {
  const bool good = p.columns >= 1 && p.columns <= FlowField::kMaxColumns && p.rows >= 1 &&
                    p.rows <= FlowField::kMaxRows && p.pitch_px >= 2 && p.pitch_px <= 64 && p.delay_frames > 0.f &&
                    p.mean_frames > p.delay_frames && width_px / p.pitch_px >= 2 * p.columns &&
                    height_px / p.pitch_px >= 2 * p.rows;
  if (!good) throw std::invalid_argument("emd_grid: parameter out of range");
  return p;
}

/// Share of the new value in a first-order low-pass, exactly discretised.
float gain(float frames) { return 1.f - std::exp(-1.f / frames); }

}  // namespace

EmdGrid::EmdGrid(int width_px, int height_px, const EmdParams& params)
    : params_(checked(params, width_px, height_px)),
      width_px_(width_px),
      height_px_(height_px),
      across_(width_px / params.pitch_px),
      down_(height_px / params.pitch_px),
      delay_gain_(gain(params.delay_frames)),
      mean_gain_(gain(params.mean_frames)),
      receptors_(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_)) {}

void EmdGrid::see(const GrayView& image) noexcept {
  const int pitch = params_.pitch_px;
  for (int r = 0; r < down_; ++r)
    for (int c = 0; c < across_; ++c) {
      int sum = 0;
      for (int v = r * pitch; v < (r + 1) * pitch; ++v) {
        const std::uint8_t* p = image.row(v) + c * pitch;
        for (int u = 0; u < pitch; ++u) sum += p[u];
      }
      Receptor& receptor = receptors_[static_cast<std::size_t>(r * across_ + c)];
      const float gray = static_cast<float>(sum) / static_cast<float>(pitch * pitch);
      if (frames_ == 0) receptor = {gray, 0.f, 0.f};
      receptor.mean += mean_gain_ * (gray - receptor.mean);
      receptor.delayed += delay_gain_ * (receptor.signal - receptor.delayed);  // of the frames before this one
      receptor.signal = gray - receptor.mean;
    }
}

void EmdGrid::correlate(EmdField& out) const noexcept {
  for (int row = 0; row < params_.rows; ++row)
    for (int column = 0; column < params_.columns; ++column) {
      const int c0 = column * across_ / params_.columns, c1 = (column + 1) * across_ / params_.columns;
      const int r0 = row * down_ / params_.rows, r1 = (row + 1) * down_ / params_.rows;
      EmdCell cell;
      for (int r = r0; r < r1; ++r)
        for (int c = c0; c < c1; ++c) {
          const Receptor& a = at(c, r);
          const Receptor& right = at(std::min(c + 1, c1 - 1), r);  // itself at the cell's end: adds nothing
          const Receptor& below = at(c, std::min(r + 1, r1 - 1));
          cell.right += a.delayed * right.signal - a.signal * right.delayed;
          cell.down += a.delayed * below.signal - a.signal * below.delayed;
          cell.contrast += a.signal * a.signal;
        }
      const int columns = c1 - c0, rows = r1 - r0;
      cell.right /= static_cast<float>((columns - 1) * rows);
      cell.down /= static_cast<float>(columns * (rows - 1));
      cell.contrast /= static_cast<float>(columns * rows);
      out.cells[static_cast<std::size_t>(row * params_.columns + column)] = cell;
    }
}

void EmdGrid::fire(float min_response, EmdRows& out) const noexcept {
  out = {};
  if (frames_ < 2 || down_ - 1 > EmdRows::kMax) return;
  out.rows = down_ - 1;
  out.columns = across_;
  out.pitch_px = params_.pitch_px;
  float squares = 0.f;
  for (int r = 0; r < out.rows; ++r)
    for (int c = 0; c < across_; ++c) squares += down(c, r) * down(c, r);
  out.threshold = std::max(min_response, std::sqrt(squares / static_cast<float>(across_ * out.rows)));
  for (int r = 0; r < out.rows; ++r) {
    std::int32_t count = 0;
    for (int c = 0; c < across_; ++c) count += std::abs(down(c, r)) >= out.threshold ? 1 : 0;
    out.count[static_cast<std::size_t>(r)] = count;
    out.total += count;
  }
}

void EmdGrid::step(const GrayView& image, EmdField& out) noexcept {
  out = {};
  out.columns = params_.columns;
  out.rows = params_.rows;
  if (!image.valid() || image.width_px != width_px_ || image.height_px != height_px_) return;
  see(image);
  frames_ = std::min(frames_ + 1, 2);
  out.valid = frames_ >= 2;
  if (out.valid) correlate(out);
}

}  // namespace wasp::vision
