// Candidates are ranked on a 256-sample preview; the best four different ones are fitted to all samples and ranked
// again; the winner is polished and has to pass the gates.
#include "vision/kernels/depth_plane.h"

#include <algorithm>
#include <cmath>

namespace wasp::vision {
namespace {

constexpr int kPreviewCount = 256;
constexpr int kGravityDraws = 32;  // one-point candidates with the normal straight up
/// Three-point draws, and how many of them at most reach the preview. Last frame's plane spares most of them while it
/// keeps its support; the rest suffice to leave a plane it should not have settled on within a few frames.
struct Draws {
  int tried, scored;
};
constexpr Draws kColdDraws{512, 112}, kWarmDraws{128, 32};
constexpr int kRounds = 3;  // of drawing and fitting, until something passes the gates
constexpr int kKept = 4;
constexpr int kPolishPasses = 4;
constexpr std::array kReachCells = {4, 7, 10, 16};  // of a three-point draw about its first point, in turn
constexpr int kBelowPenalty = 4;                    // one sample below outweighs four on the plane
constexpr float kSigmas = 3.f;
constexpr float kWarmSupport = 0.7f;      // of last frame's support that last frame's plane must keep
constexpr float kFirstFit = 2.f;          // tolerance of the first fit, in units of the final one
constexpr float kMinTripleArea = 0.004f;  // of the ray square; 640x480 at f 525 spans 1.1
constexpr float kMinHeight_m = 0.03f, kMaxHeight_m = 20.f;

struct Candidate {
  InversePlane plane;
  int score = -1'000'000;
};

/// Everything one frame needs, gathered once.
struct Frame {
  DepthSamples samples;
  alignas(32) std::array<float, kPreviewCount> x, y, w;  ///< every n-th sample, padded with points far above

  [[nodiscard]] InverseDepths all() const noexcept {
    const auto n = static_cast<std::size_t>(samples.count);
    return {{samples.x.data(), n}, {samples.y.data(), n}, {samples.w.data(), n}};
  }
  [[nodiscard]] InverseDepths preview() const noexcept { return {x, y, w}; }
};

struct Search {
  const Frame& frame;
  const GravityPrior& prior;
  PlaneTolerance tolerance;
  float cos_max_angle;
  std::array<Candidate, kKept> kept{};
};

void fill_preview(Frame& frame) noexcept {
  const int n = frame.samples.count;
  for (int i = 0; i < kPreviewCount; ++i) {
    const auto to = static_cast<std::size_t>(i);
    const bool real = n > kPreviewCount || i < n;
    const auto from = static_cast<std::size_t>(n > kPreviewCount ? i * n / kPreviewCount : std::min(i, n - 1));
    frame.x[to] = frame.samples.x[from];
    frame.y[to] = frame.samples.y[from];
    frame.w[to] = real ? frame.samples.w[from] : 1e6f;
  }
}

int score(const PlaneSupport& support) noexcept { return support.inliers - kBelowPenalty * support.below; }

bool plausible(const Search& search, const InversePlane& plane) noexcept {
  const float height_m = plane.height_m();
  return height_m > kMinHeight_m && height_m < kMaxHeight_m &&
         plane.normal_cam().dot(search.prior.up_cam) > search.cos_max_angle;
}

/// Closer than about 6 degrees and 10 % of height: the fit will bring both to the same place.
bool alike(const InversePlane& a, const InversePlane& b) noexcept {
  return (a.gradient() - b.gradient()).squaredNorm() < 0.01f * b.gradient().squaredNorm();
}

void keep(Search& search, const Candidate& candidate) noexcept {
  for (Candidate& old : search.kept)
    if (alike(candidate.plane, old.plane)) {
      if (candidate.score > old.score) old = candidate;
      return;
    }
  auto worst = std::min_element(search.kept.begin(), search.kept.end(),
                                [](const Candidate& a, const Candidate& b) { return a.score < b.score; });
  if (candidate.score > worst->score) *worst = candidate;
}

int preview_score(const Search& search, const InversePlane& plane) noexcept {
  return score(count_support(search.frame.preview(), plane, search.tolerance));
}

bool consider(Search& search, const InversePlane& plane) noexcept {
  if (!plausible(search, plane)) return false;
  keep(search, {plane, preview_score(search, plane)});
  return true;
}

/// How far a sample lies above the camera, along the prior's up.
float rise_m(const Search& search, int index) noexcept {
  const auto i = static_cast<std::size_t>(index);
  const DepthSamples& s = search.frame.samples;
  const Vec3& up = search.prior.up_cam;
  return (up.x() * s.x[i] + up.y() * s.y[i] + up.z()) / s.w[i];
}

/// The plane with normal `up` through sample i: n . X = -h, w = -(n . ray) / h, h = -(n . ray) / w.
void consider_gravity(Search& search, PseudoRandom& random) noexcept {
  const float height_m = -rise_m(search, random.below(search.frame.samples.count));
  if (!(height_m > kMinHeight_m)) return;
  const Vec3 gradient = -search.prior.up_cam / height_m;
  consider(search, {gradient.x(), gradient.y(), gradient.z()});
}

/// A valid sample at most `reach` cells from the cell of sample `centre`, or -1.
int draw_near(const DepthSamples& s, int centre, int reach, PseudoRandom& random) noexcept {
  const int cell = s.cell[static_cast<std::size_t>(centre)];
  const int column = cell % kSampleColumns + random.below(2 * reach + 1) - reach;
  const int row = cell / kSampleColumns + random.below(2 * reach + 1) - reach;
  if (column < 0 || column >= kSampleColumns || row < 0 || row >= kSampleRows) return -1;
  return s.of_cell[static_cast<std::size_t>(row * kSampleColumns + column)];
}

/// The lower of two random samples, going by the prior's up: floors are found at the bottom of things.
int draw_low(const Search& search, PseudoRandom& random) noexcept {
  const DepthSamples& s = search.frame.samples;
  const int first = random.below(s.count), second = random.below(s.count);
  return rise_m(search, first) < rise_m(search, second) ? first : second;
}

bool consider_triple(Search& search, int reach, PseudoRandom& random) noexcept {
  const DepthSamples& s = search.frame.samples;
  const int first = draw_low(search, random);
  const int second = draw_near(s, first, reach, random), third = draw_near(s, first, reach, random);
  InversePlane plane;
  return second >= 0 && third >= 0 &&
         plane_through(search.frame.all(), {first, second, third}, kMinTripleArea, plane) && consider(search, plane);
}

/// Whether last frame's plane is still there (and not just still conceivable, as after a cut).
bool still_there(const Search& search, const DepthPlaneState& state) noexcept {
  const int seen = std::min(search.frame.samples.count, kPreviewCount);
  return static_cast<float>(preview_score(search, state.last)) >=
         kWarmSupport * state.last_share * static_cast<float>(seen);
}

void draw_candidates(Search& search, DepthPlaneState& state) noexcept {
  const bool warm = state.warm && consider(search, state.last) && still_there(search, state);
  if (search.prior.measured)
    for (int i = 0; i < kGravityDraws; ++i) consider_gravity(search, state.random);
  const Draws draws = warm ? kWarmDraws : kColdDraws;
  for (int draw = 0, scored = 0; draw < draws.tried && scored < draws.scored; ++draw)
    scored +=
        consider_triple(search, kReachCells[static_cast<std::size_t>(draw) % kReachCells.size()], state.random) ? 1 : 0;
}

PlaneTolerance widened(const PlaneTolerance& t, float factor) noexcept {
  return {factor * t.sensor_per_m, factor * t.flatness_m};
}

/// Fits every kept candidate to all samples, wide first to be drawn in from afar, and returns the best of them.
Candidate best_fitted(const Search& search) noexcept {
  Candidate best;
  const InverseDepths all = search.frame.all();
  for (const Candidate& candidate : search.kept) {
    if (candidate.score == Candidate{}.score) continue;
    PlaneFit fit = fit_inliers(all, candidate.plane, widened(search.tolerance, kFirstFit));
    if (fit.valid) fit = fit_inliers(all, fit.plane, search.tolerance);
    if (!fit.valid || !plausible(search, fit.plane)) continue;
    const Candidate fitted{fit.plane, score(count_support(all, fit.plane, search.tolerance))};
    if (fitted.score > best.score) best = fitted;
  }
  return best;
}

PlaneEstimate describe(const PlaneFit& fit, const PlaneSupport& support, int valid_samples) noexcept {
  const auto n = static_cast<float>(valid_samples);
  return {.valid = true,
          .normal_cam = fit.plane.normal_cam(),
          .height_m = fit.plane.height_m(),
          .height_sigma_m = fit.height_sigma_m,
          .normal_sigma_rad = fit.normal_sigma_rad,
          .inlier_share = static_cast<float>(support.inliers) / n,
          .below_share = static_cast<float>(support.below) / n,
          .valid_share = n / static_cast<float>(kSampleCount),
          .rms_m = fit.rms_m};
}

bool passes(const DepthPlaneParams& params, const PlaneEstimate& e, const PlaneSupport& support) noexcept {
  return support.inliers >= params.min_inliers && e.inlier_share >= params.min_inlier_share &&
         e.below_share <= params.max_below_share && e.below_share <= params.max_below_ratio * e.inlier_share &&
         e.normal_sigma_rad <= params.max_normal_sigma_rad && std::isfinite(e.height_m + e.height_sigma_m + e.rms_m);
}

PlaneEstimate polish(const DepthPlaneParams& params, const Search& search, const InversePlane& start) noexcept {
  PlaneFit fit{.valid = true, .plane = start};
  for (int pass = 0; pass < kPolishPasses && fit.valid; ++pass)
    fit = fit_inliers(search.frame.all(), fit.plane, search.tolerance);
  if (!fit.valid || !plausible(search, fit.plane)) return {};
  const PlaneSupport support = count_support(search.frame.all(), fit.plane, search.tolerance);
  PlaneEstimate estimate = describe(fit, support, search.frame.samples.count);
  estimate.valid = passes(params, estimate, support);
  return estimate;
}

bool sane(const DepthPlaneParams& p, const GravityPrior& prior) noexcept {
  const float sum = p.range.min_m + p.range.max_m + p.sensor_sigma_per_m + p.flatness_m + p.min_inlier_share +
                    p.max_below_share + p.max_below_ratio + p.max_normal_sigma_rad + prior.max_angle_rad;
  return std::isfinite(sum) && p.range.min_m > 0.f && p.range.max_m > p.range.min_m && p.sensor_sigma_per_m > 0.f &&
         p.flatness_m >= 0.f && prior.max_angle_rad > 0.f && std::abs(prior.up_cam.squaredNorm() - 1.f) < 0.01f;
}

}  // namespace

PlaneEstimate estimate_floor(const DepthPlaneParams& params, const Intrinsics& intrinsics, const DepthView& depth,
                             const GravityPrior& prior, DepthPlaneState& state) noexcept {
  if (!sane(params, prior) || !depth.valid() || depth.width_px != intrinsics.width_px ||
      depth.height_px != intrinsics.height_px || !prepare(state.table, intrinsics)) {
    state.warm = false;
    return {};
  }
  Frame frame;
  gather(state.table, depth, params.range, frame.samples);
  if (frame.samples.count < std::max(params.min_inliers, 8)) {
    state.warm = false;
    return {};
  }
  fill_preview(frame);
  Search search{frame, prior, {kSigmas * params.sensor_sigma_per_m, params.flatness_m}, std::cos(prior.max_angle_rad)};
  PlaneEstimate estimate;
  for (int round = 0; round < kRounds && !estimate.valid; ++round) {
    draw_candidates(search, state);
    const Candidate best = best_fitted(search);
    if (best.score != Candidate{}.score) estimate = polish(params, search, best.plane);
    state.warm = false;  // another round starts from nothing
  }
  state.warm = estimate.valid;
  if (estimate.valid) {
    state.last_share = estimate.inlier_share;
    const Vec3 gradient = -estimate.normal_cam / estimate.height_m;
    state.last = {gradient.x(), gradient.y(), gradient.z()};
  }
  return estimate;
}

}  // namespace wasp::vision
