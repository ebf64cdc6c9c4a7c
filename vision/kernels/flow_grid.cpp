#include "vision/kernels/flow_grid.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "vision/kernels/flow_grid_centre.h"
#include "vision/kernels/flow_grid_solve.h"

namespace wasp::vision {
namespace {

constexpr int kFineAcross = 4, kCoarseAcross = 3;  // tiles a side at level 0, and above
constexpr int kFirstCoarseLevel = 1;               // from here on a level has its own, coarser grid ...
constexpr float kCoarsePitchPx = 40.f;             // ... of about this pitch
constexpr float kSameStartPx = 0.5f;               // starts closer than this lead to the same place
constexpr float kGoodCentreGray = 1.5f;            // a centre that matches this well needs no other guess
constexpr int kMinTiles = 4;

float distance2(const CellMotion& a, const CellMotion& b) noexcept {
  const float u = a.u_px - b.u_px, v = a.v_px - b.v_px;
  return u * u + v * v;
}

bool finite(const CellMotion& m) noexcept {
  return std::isfinite(m.u_px + m.v_px + m.du_dx + m.du_dy + m.dv_dx + m.dv_dy);
}

FlowGridParams checked(const FlowGridParams& p) {
  const bool good = p.columns >= 1 && p.columns <= FlowField::kMaxColumns && p.rows >= 1 &&
                    p.rows <= FlowField::kMaxRows && p.levels >= 1 && p.levels <= FlowPyramid::kMaxLevels &&
                    p.max_steps >= 1 && p.max_steps <= 16 && p.noise_gray > 0.f && p.slack_px >= 0.f &&
                    p.affine_sigma > 0.f && p.shift_sigma_px > 0.f && p.converged_px >= 0.f;
  if (!good) throw std::invalid_argument("flow_grid: parameter out of range");
  return p;
}

bool same_start(const CellMotion& a, const CellMotion& b) noexcept {
  return distance2(a, b) <= kSameStartPx * kSameStartPx;
}

}  // namespace

/// The grid of one level.
struct FlowGrid::Level {
  int columns = 1, rows = 1;
  float pitch_u_px = 1, pitch_v_px = 1;  ///< of that level's pixels
  [[nodiscard]] float u_px(int column) const noexcept {
    return (static_cast<float>(column) + 0.5f) * pitch_u_px - 0.5f;
  }
  [[nodiscard]] float v_px(int row) const noexcept { return (static_cast<float>(row) + 0.5f) * pitch_v_px - 0.5f; }
};

/// One block at one level while it is fitted.
struct FlowGrid::Fit {
  BlockSite site;
  TileBlock block;
  BlockErrors errors;
  BlockSums sums;
};

/// First guesses that differ, each tried at the cell's very centre; of equals the first added is best.
class FlowGrid::Guesses {
 public:
  Guesses(const GrayView& first, const GrayView& second, const BlockSite& site, const CellMotion& own) noexcept
      : first_(first),
        second_(second),
        u_px_(place(site.centre_u, kCentreWidthPx, first.width_px)),
        v_px_(place(site.centre_v, kCentreHeightPx, first.height_px)) {
    add(own);
  }
  void add(const CellMotion& guess) noexcept {
    for (int i = 0; i < count_; ++i)
      if (same_start(list_[static_cast<std::size_t>(i)], guess)) return;
    const float cost = centre_cost(first_, second_, u_px_, v_px_, guess.u_px, guess.v_px);
    if (count_ == 0 || cost < least_) best_ = count_, least_ = cost;
    list_[static_cast<std::size_t>(count_++)] = guess;
  }
  [[nodiscard]] int count() const noexcept { return count_; }
  [[nodiscard]] float least_cost() const noexcept { return least_; }
  [[nodiscard]] const CellMotion& best() const noexcept { return list_[static_cast<std::size_t>(best_)]; }

 private:
  static int place(float centre, int size, int image_size) noexcept {
    return std::clamp(static_cast<int>(centre + 1.f) - size / 2, 0, image_size - size);
  }
  const GrayView &first_, &second_;
  int u_px_, v_px_, count_ = 0, best_ = 0;
  float least_ = 0;
  std::array<CellMotion, kMaxGuesses> list_;
};

FlowGrid::FlowGrid(int width_px, int height_px, const FlowGridParams& params)
    : params_(checked(params)),
      pyramids_{FlowPyramid(width_px, height_px, params.levels), FlowPyramid(width_px, height_px, params.levels)} {
  if (pyramids_[0].levels() == 0) throw std::invalid_argument("flow_grid: image too small");
}

FlowGrid::Level FlowGrid::level_of(int level) const noexcept {
  const GrayView& image = pyramids_[0].level(0);
  const float scale = 1.f / static_cast<float>(1 << level);
  const float width = static_cast<float>(image.width_px) * scale, height = static_cast<float>(image.height_px) * scale;
  Level l{params_.columns, params_.rows};
  if (level >= kFirstCoarseLevel) {
    l.columns = std::clamp(static_cast<int>(std::lround(width / kCoarsePitchPx)), 1, params_.columns);
    l.rows = std::clamp(static_cast<int>(std::lround(height / kCoarsePitchPx)), 1, params_.rows);
  }
  l.pitch_u_px = width / static_cast<float>(l.columns);
  l.pitch_v_px = height / static_cast<float>(l.rows);
  return l;
}

FlowGridTrips FlowGrid::worst_case() const noexcept {
  FlowGridTrips most;
  for (int i = 0; i < pyramids_[0].levels(); ++i) {
    const Level l = level_of(i);
    const int blocks = l.columns * l.rows;
    const int steps = i < kFirstCoarseLevel ? params_.max_steps : 2 * params_.max_steps;
    most.blocks += blocks;
    most.passes += blocks * steps;
    most.guesses += i + 1 < pyramids_[0].levels() ? blocks * kMaxGuesses : 0;
  }
  const int runs = params_.max_backward_px > 0.f ? 2 : 1;
  return {most.blocks * runs, most.passes * runs, most.guesses * runs};
}

void FlowGrid::clear(FlowField& out) const noexcept {
  const Level cells = level_of(0);
  out.columns = params_.columns;
  out.rows = params_.rows;
  for (int r = 0; r < out.rows; ++r)
    for (int c = 0; c < out.columns; ++c) {
      out.at(c, r) = FlowCell{};
      out.at(c, r).x_px = cells.u_px(c);
      out.at(c, r).y_px = cells.v_px(r);
    }
}

void FlowGrid::track(const GrayView& first, const GrayView& second, FlowField& out) noexcept {
  solve(this->first().build(first), second, out);
}

void FlowGrid::follow(const GrayView& first, const GrayView& second, FlowField& out) noexcept {
  if (!kept_) return track(first, second, out);
  first_ = 1 - first_;
  solve(this->first().renew(first), second, out);
}

void FlowGrid::solve(bool built, const GrayView& second, FlowField& out) noexcept {
  trips_ = {};
  motions_ = {};
  clear(out);
  kept_ = built && this->second().build(second);
  if (!kept_) return;
  run(this->first(), this->second(), motions_, out);
  if (params_.max_backward_px > 0.f) check_backward(out);
}

void FlowGrid::run(const FlowPyramid& from, const FlowPyramid& to, Motions& motions, FlowField& out) noexcept {
  Fit fit;
  Level above;
  for (int i = from.levels() - 1; i >= 0; --i) {
    const Level level = level_of(i);
    const bool top = i == from.levels() - 1;
    const int steps = i < kFirstCoarseLevel ? params_.max_steps : 2 * params_.max_steps;
    for (std::size_t k = 0; !top && k < static_cast<std::size_t>(above.columns * above.rows); ++k) {
      above_[k] = motions[k];
      above_[k].u_px *= 2.f;
      above_[k].v_px *= 2.f;
    }
    for (int cell = 0; cell < level.columns * level.rows; ++cell) {
      fit.site.centre_u = level.u_px(cell % level.columns);
      fit.site.centre_v = level.v_px(cell / level.columns);
      fit.site.with_gray = i == 0;
      fit.site.across = i == 0 ? kFineAcross : kCoarseAcross;
      cut(from.level(i), fit);
      CellMotion& motion = motions[static_cast<std::size_t>(cell)];
      motion = top ? CellMotion{} : start(above, from.level(i), to.level(i), fit.site);
      refine(to.level(i), steps, motion, fit);
      if (i == 0) judge(fit, motion, out.cells[static_cast<std::size_t>(cell)]);
    }
    above = level;
  }
}

/// The motion of the nearest cell at the level above, extrapolated, unless one of its neighbours' fits the very centre
/// better.
CellMotion FlowGrid::start(const Level& above, const GrayView& first, const GrayView& second,
                           const BlockSite& site) noexcept {
  const float u = (site.centre_u + 0.5f) * 0.5f - 0.5f, v = (site.centre_v + 0.5f) * 0.5f - 0.5f;
  const int c0 = std::clamp(static_cast<int>((u + 0.5f) / above.pitch_u_px), 0, above.columns - 1);
  const int r0 = std::clamp(static_cast<int>((v + 0.5f) / above.pitch_v_px), 0, above.rows - 1);
  const auto extrapolated = [&](int c, int r) {
    CellMotion m = above_[static_cast<std::size_t>(r * above.columns + c)];
    const float x = 2.f * (u - above.u_px(c)), y = 2.f * (v - above.v_px(r));
    m.u_px += m.du_dx * x + m.du_dy * y;
    m.v_px += m.dv_dx * x + m.dv_dy * y;
    return m;
  };
  const CellMotion own = extrapolated(c0, r0);
  Guesses guesses(first, second, site, own);
  const int reach = guesses.least_cost() <= kGoodCentreGray ? 0 : 1;
  for (int r = std::max(r0 - reach, 0); r <= std::min(r0 + reach, above.rows - 1); ++r)
    for (int c = std::max(c0 - reach, 0); c <= std::min(c0 + reach, above.columns - 1); ++c)
      guesses.add(extrapolated(c, r));
  trips_.guesses += guesses.count();
  return guesses.best();
}

void FlowGrid::cut(const GrayView& first, Fit& fit) noexcept {
  ++trips_.blocks;
  const int size = fit.site.across * kTilePx;
  const auto place = [size](float centre, int image_size) {
    return std::clamp(static_cast<int>(centre + 1.f) - size / 2, 1, image_size - size - 1);
  };
  fit.site.u_px = place(fit.site.centre_u, first.width_px);
  fit.site.v_px = place(fit.site.centre_v, first.height_px);
  fit.site.noise_gray = params_.noise_gray;
  fit.site.slack_px = params_.slack_px;
  cut_block(first, fit.site, fit.block);
}

void FlowGrid::refine(const GrayView& second, int max_steps, CellMotion& motion, Fit& fit) noexcept {
  const CellMotion prior = motion;
  for (int i = 0; i < max_steps; ++i) {
    ++trips_.passes;
    compare_block(fit.block, second, motion, fit.errors, fit.sums);
    const CellMotion before = motion;
    if (!step(motion, prior, fit)) {
      motion = before;
      break;
    }
    if (distance2(before, motion) < params_.converged_px * params_.converged_px) break;
  }
}

/// One robust, regularised Gauss-Newton step. False when it has no finite solution.
bool FlowGrid::step(CellMotion& motion, const CellMotion& prior, Fit& fit) noexcept {
  const float noise = params_.noise_gray * params_.noise_gray;
  const float shift = noise / (params_.shift_sigma_px * params_.shift_sigma_px);
  const float affine = noise / (params_.affine_sigma * params_.affine_sigma * kAffineScalePx * kAffineScalePx);
  AffineStep step;
  if (!solve_affine_step(fit.sums, {motion.u_px - prior.u_px, motion.v_px - prior.v_px}, motion, shift, affine, step))
    return false;
  motion.u_px += step.u[0];
  motion.du_dx += step.u[1] / kAffineScalePx;
  motion.du_dy += step.u[2] / kAffineScalePx;
  motion.v_px += step.v[0];
  motion.dv_dx += step.v[1] / kAffineScalePx;
  motion.dv_dy += step.v[2] / kAffineScalePx;
  return finite(motion);
}

/// One sigma of the shift's worse direction, its affine terms known: the tiles' noise over the least eigenvalue.
float FlowGrid::shift_sigma_px(const BlockSums& sums, const BlockMatch& match) const noexcept {
  const float half = 0.5f * (sums.xx[0] - sums.yy[0]);
  const float least = 0.5f * (sums.xx[0] + sums.yy[0]) - std::sqrt(half * half + sums.xy[0] * sums.xy[0]);
  const float noise = std::max(params_.noise_gray * params_.noise_gray, match.squares);
  return std::sqrt(noise * match.trust / std::max(least, 1e-6f));
}

void FlowGrid::judge(const Fit& fit, const CellMotion& motion, FlowCell& cell) const noexcept {
  const BlockMatch match = match_of(fit.block, fit.errors);
  const float pixels = static_cast<float>(fit.block.tiles * kTilePixels);
  const float mean = fit.block.gray_sum / pixels;
  const float variance = fit.block.gray_squares / pixels - mean * mean;
  cell.u_px = motion.u_px;
  cell.v_px = motion.v_px;
  cell.residual = std::sqrt(match.squares);
  cell.quality = std::clamp(1.f - match.cost, 0.f, 1.f);
  const bool good = variance >= params_.min_variance && match.inside >= kMinTiles &&
                    shift_sigma_px(fit.sums, match) <= params_.max_flow_sigma_px;
  cell.valid = good ? 1 : 0;
}

/// Each valid cell must come back to where it started by the backward motion of the cell it lands in.
void FlowGrid::check_backward(FlowField& out) noexcept {
  clear(backward_field_);
  run(second(), first(), backward_, backward_field_);
  const Level cells = level_of(0);
  for (int i = 0; i < out.count(); ++i) {
    FlowCell& cell = out.cells[static_cast<std::size_t>(i)];
    if (cell.valid == 0) continue;
    const float u = cell.x_px + cell.u_px, v = cell.y_px + cell.v_px;
    const auto index = [](float at, float pitch, int count) {
      return static_cast<int>(std::clamp((at + 0.5f) / pitch, 0.f, static_cast<float>(count) - 0.5f));
    };
    const int c = index(u, cells.pitch_u_px, cells.columns), r = index(v, cells.pitch_v_px, cells.rows);
    const CellMotion& back = backward_[static_cast<std::size_t>(r * cells.columns + c)];
    const float x = u - cells.u_px(c), y = v - cells.v_px(r);
    const float du = cell.u_px + back.u_px + back.du_dx * x + back.du_dy * y;
    const float dv = cell.v_px + back.v_px + back.dv_dx * x + back.dv_dy * y;
    if (!(du * du + dv * dv <= params_.max_backward_px * params_.max_backward_px)) cell.valid = 0;
  }
}

}  // namespace wasp::vision
