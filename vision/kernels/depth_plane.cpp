// Candidates are ranked on a 256-sample preview; the best four different ones are fitted to all samples and ranked
// again; the winner is polished and has to pass the gates.
#include "vision/kernels/depth_plane.h"

#include <algorithm>
#include <cmath>

namespace wasp::vision {
namespace {

constexpr int kPreviewCount = 256;
constexpr int kGravityDraws = 32;  // one-point candidates with the normal straight up
constexpr int kBatch = 64;         // three-point draws between two looks at whether they suffice
constexpr int kMaxBatches = 8, kMostScored = 112;
/// Enough batches for a plane of this share: a better one would have a larger share and have been drawn as well.
constexpr std::array kEnoughShare = {2.f, 0.5f, 0.4f, 0.2f, 0.2f, 0.2f, 0.2f, 0.f};
/// Last frame's plane spares the draws while it keeps its support and nothing lies below it; one batch remains, to
/// leave within a few frames a plane it should not have settled on.
constexpr float kHeldBelow = 0.01f;
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
  alignas(64) std::array<float, kPreviewCount> x, y, w;  ///< every n-th sample, padded with points far above

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
  const Vec3 gradient = plane.gradient();  // -n / h
  const float norm = gradient.norm();
  return norm * kMinHeight_m < 1.f && norm * kMaxHeight_m > 1.f &&
         -gradient.dot(search.prior.up_cam) > search.cos_max_angle * norm;
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

/// Rise of a sample's ray above the camera, along the prior's up, for each metre of depth.
float slope_up(const Search& search, int index) noexcept {
  const auto i = static_cast<std::size_t>(index);
  const DepthSamples& s = search.frame.samples;
  const Vec3& up = search.prior.up_cam;
  return up.x() * s.x[i] + up.y() * s.y[i] + up.z();
}

float w_of(const Search& search, int index) noexcept { return search.frame.samples.w[static_cast<std::size_t>(index)]; }

/// The plane with normal `up` through sample i: n . X = -h, w = -(n . ray) / h, h = -(n . ray) / w.
void consider_gravity(Search& search, PseudoRandom& random) noexcept {
  const int index = random.below(search.frame.samples.count);
  const float height_m = -slope_up(search, index) / w_of(search, index);
  if (!(height_m > kMinHeight_m)) return;
  const Vec3 gradient = -search.prior.up_cam / height_m;
  consider(search, {gradient.x(), gradient.y(), gradient.z()});
}

/// The lower of two random samples, going by the prior's up: floors are found at the bottom of things.
int draw_low(const Search& search, PseudoRandom& random) noexcept {
  const DepthSamples& s = search.frame.samples;
  const int first = random.below(s.count), second = random.below(s.count);
  const bool first_is_lower =
      slope_up(search, first) * w_of(search, second) < slope_up(search, second) * w_of(search, first);
  return first_is_lower ? first : second;
}

struct Triples {
  std::array<std::array<std::int16_t, 3>, kBatch> sample;
  int count = 0;
};

/// The sample of a cell at most `reach` cells from `cell`, or -1. No branches: which way they go would be a guess.
int draw_near(const DepthSamples& s, int cell, int reach, PseudoRandom& random) noexcept {
  const int column = cell % kSampleColumns + random.below(2 * reach + 1) - reach;
  const int row = cell / kSampleColumns + random.below(2 * reach + 1) - reach;
  const int inside = static_cast<int>(static_cast<unsigned>(column) < static_cast<unsigned>(kSampleColumns)) &
                     static_cast<int>(static_cast<unsigned>(row) < static_cast<unsigned>(kSampleRows));
  return (s.of_cell[static_cast<std::size_t>(-inside & (row * kSampleColumns + column))] | (inside - 1));
}

Triples draw_triples(const Search& search, PseudoRandom& random) noexcept {
  const DepthSamples& s = search.frame.samples;
  Triples triples;
  for (std::size_t draw = 0; draw < kBatch; ++draw) {
    const int first = draw_low(search, random), cell = s.cell[static_cast<std::size_t>(first)];
    const int reach = kReachCells[draw % kReachCells.size()];
    const int second = draw_near(s, cell, reach, random), third = draw_near(s, cell, reach, random);
    triples.sample[static_cast<std::size_t>(triples.count)] = {
        static_cast<std::int16_t>(first), static_cast<std::int16_t>(second), static_cast<std::int16_t>(third)};
    triples.count += static_cast<int>((second | third) >= 0);
  }
  return triples;
}

/// Scores the planes through one batch of triples; returns how many there were.
int consider_triples(Search& search, PseudoRandom& random) noexcept {
  const Triples triples = draw_triples(search, random);
  const InverseDepths all = search.frame.all();
  std::array<InversePlane, kBatch + 1> planes;
  int count = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(triples.count); ++i) {
    const auto& t = triples.sample[i];
    InversePlane& plane = planes[static_cast<std::size_t>(count)];
    const bool spans = plane_through(all, {t[0], t[1], t[2]}, kMinTripleArea, plane);
    count += static_cast<int>(spans) & static_cast<int>(plausible(search, plane));
  }
  for (int i = 0; i < count; ++i) {
    const InversePlane& plane = planes[static_cast<std::size_t>(i)];
    keep(search, {plane, preview_score(search, plane)});
  }
  return count;
}

/// How much of last frame's plane is left: still there (and not just still conceivable, as after a cut), or even held,
/// with nothing below it, so that no other plane can be the floor.
enum class Last { kGone, kThere, kHeld };

Last consider_last(Search& search, const DepthPlaneState& state) noexcept {
  if (!state.warm || !plausible(search, state.last)) return Last::kGone;
  const PlaneSupport support = count_support(search.frame.preview(), state.last, search.tolerance);
  keep(search, {state.last, score(support)});
  const auto seen = static_cast<float>(std::min(search.frame.samples.count, kPreviewCount));
  if (static_cast<float>(score(support)) < kWarmSupport * state.last_share * seen) return Last::kGone;
  return static_cast<float>(support.below) <= kHeldBelow * seen ? Last::kHeld : Last::kThere;
}

int best_score(const Search& search) noexcept {
  int best = 0;
  for (const Candidate& c : search.kept) best = std::max(best, c.score);
  return best;
}

/// `thorough`: all the draws, because what an earlier round stopped for did not pass the gates.
void draw_candidates(Search& search, DepthPlaneState& state, bool thorough) noexcept {
  const Last last = consider_last(search, state);
  if (search.prior.measured)
    for (int i = 0; i < kGravityDraws; ++i) consider_gravity(search, state.random);
  const auto seen = static_cast<float>(std::min(search.frame.samples.count, kPreviewCount));
  const int batches = last == Last::kHeld ? 1 : last == Last::kThere ? 2 : kMaxBatches;
  for (int batch = 0, scored = 0; batch < batches && scored < kMostScored; ++batch) {
    scored += consider_triples(search, state.random);
    const float enough = kEnoughShare[static_cast<std::size_t>(batch)] * seen;
    if (!thorough && static_cast<float>(best_score(search)) >= enough) break;
  }
}

PlaneTolerance widened(const PlaneTolerance& t, float factor) noexcept {
  return {factor * t.sensor_per_m, factor * t.flatness_m};
}

/// Fits every kept candidate to all samples, wide first to be drawn in from afar, and returns the best of them.
Candidate best_fitted(const Search& search) noexcept {
  Candidate best;
  const InverseDepths all = search.frame.all();
  const int worth_it = std::max(best_score(search), 0) / 2;
  for (const Candidate& candidate : search.kept) {
    if (candidate.score == Candidate{}.score || candidate.score < worth_it) continue;
    InversePlane plane = candidate.plane;
    if (!refine(all, widened(search.tolerance, kFirstFit), plane) || !refine(all, search.tolerance, plane) ||
        !plausible(search, plane))
      continue;
    const Candidate fitted{plane, score(count_support(all, plane, search.tolerance))};
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
  InversePlane plane = start;
  for (int pass = 0; pass + 1 < kPolishPasses; ++pass)
    if (!refine(search.frame.all(), search.tolerance, plane)) return {};
  const PlaneFit fit = fit_inliers(search.frame.all(), plane, search.tolerance);
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
    draw_candidates(search, state, round > 0);
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
