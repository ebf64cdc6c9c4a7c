// Candidates are ranked on a 256-sample preview; the best four different ones are fitted to all samples and ranked
// again; the winner is polished and has to pass the gates.
#include "vision/kernels/depth_plane.h"

#include <algorithm>
#include <cmath>

namespace wasp::vision {
namespace {

constexpr int kPreviewCount = 256;
constexpr int kGravityDraws = 32;  // one-point candidates with the normal straight up
constexpr int kRounds = 3;         // of drawing and fitting, until something passes the gates
constexpr int kBatch = 64;         // three-point draws between two looks at whether they suffice
constexpr int kMaxBatches = 8, kMostScored = 112;
static_assert(kRounds * kMaxBatches * kBatch == kMaxPlaneDraws);
/// Enough batches for a plane of this share: a better one would have a larger share and have been drawn as well.
constexpr std::array kEnoughShare = {2.f, 0.5f, 0.4f, 0.2f, 0.2f, 0.2f, 0.2f, 0.f};
/// Last frame's plane spares the draws while it keeps its support and nothing lies below it; one batch remains, to
/// leave within a few frames a plane it should not have settled on.
constexpr float kHeldBelow = 0.01f;
constexpr int kKept = 4;
constexpr int kPolishPasses = 4;
constexpr float kSettled = 1e-10f;  // squared relative change of a plane that its inliers no longer move
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
  explicit Frame(const SampleTable& t) noexcept : table(t) {}  // leaves the arrays to gather() and fill_preview()

  const SampleTable& table;
  DepthSamples samples;
  alignas(64) std::array<float, kPreviewCount> x, y, w;  ///< every n-th valid sample

  [[nodiscard]] InverseDepths all() const noexcept { return {table.x, table.y, samples.w}; }
  [[nodiscard]] InverseDepths preview() const noexcept { return {x, y, w}; }
};

struct Search {
  const Frame& frame;
  const GravityPrior& prior;
  PlaneTolerance tolerance;
  float cos_max_angle;
  std::array<Candidate, kKept> kept{};
  int draws = 0;
};

void fill_preview(Frame& frame) noexcept {
  const int n = frame.samples.count;
  for (int i = 0; i < kPreviewCount; ++i) {
    const auto to = static_cast<std::size_t>(i);
    const int nth = n > kPreviewCount ? i * n / kPreviewCount : std::min(i, n - 1);
    const auto cell = static_cast<std::size_t>(frame.samples.valid[static_cast<std::size_t>(nth)]);
    frame.x[to] = frame.table.x[cell];
    frame.y[to] = frame.table.y[cell];
    frame.w[to] = i < n ? frame.samples.w[cell] : kAbsent_per_m;
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
float slope_up(const Search& search, int cell) noexcept {
  const auto i = static_cast<std::size_t>(cell);
  const SampleTable& s = search.frame.table;
  const Vec3& up = search.prior.up_cam;
  return up.x() * s.x[i] + up.y() * s.y[i] + up.z();
}

float w_of(const Search& search, int cell) noexcept { return search.frame.samples.w[static_cast<std::size_t>(cell)]; }

/// The cell of a random valid sample.
int draw_any(const Search& search, PseudoRandom& random) noexcept {
  const DepthSamples& s = search.frame.samples;
  return s.valid[static_cast<std::size_t>(random.below(s.count))];
}

/// The plane with normal `up` through sample i: n . X = -h, w = -(n . ray) / h, h = -(n . ray) / w.
void consider_gravity(Search& search, PseudoRandom& random) noexcept {
  const int cell = draw_any(search, random);
  const float height_m = -slope_up(search, cell) / w_of(search, cell);
  if (!(height_m > kMinHeight_m)) return;
  const Vec3 gradient = -search.prior.up_cam / height_m;
  consider(search, {gradient.x(), gradient.y(), gradient.z()});
}

/// The lower of two random samples, going by the prior's up: floors are found at the bottom of things.
int draw_low(const Search& search, PseudoRandom& random) noexcept {
  const int first = draw_any(search, random), second = draw_any(search, random);
  const bool first_is_lower =
      slope_up(search, first) * w_of(search, second) < slope_up(search, second) * w_of(search, first);
  return first_is_lower ? first : second;
}

struct Triples {
  std::array<std::array<std::int16_t, 3>, kBatch> cell;
  int count = 0;
};

/// A cell at most `reach` cells from `cell`, -1 where that is outside. No branches: which way they go would be a guess.
int draw_near(int cell, int reach, PseudoRandom& random) noexcept {
  const int column = cell % kSampleColumns + random.below(2 * reach + 1) - reach;
  const int row = cell / kSampleColumns + random.below(2 * reach + 1) - reach;
  const int inside = static_cast<int>(static_cast<unsigned>(column) < static_cast<unsigned>(kSampleColumns)) &
                     static_cast<int>(static_cast<unsigned>(row) < static_cast<unsigned>(kSampleRows));
  return (row * kSampleColumns + column) | (inside - 1);
}

Triples draw_triples(const Search& search, PseudoRandom& random) noexcept {
  Triples triples;
  for (std::size_t draw = 0; draw < kBatch; ++draw) {
    const int reach = kReachCells[draw % kReachCells.size()], first = draw_low(search, random);
    const int second = draw_near(first, reach, random), third = draw_near(first, reach, random);
    triples.cell[static_cast<std::size_t>(triples.count)] = {
        static_cast<std::int16_t>(first), static_cast<std::int16_t>(second), static_cast<std::int16_t>(third)};
    const bool present =
        w_of(search, std::max(second, 0)) < kAbsent_per_m && w_of(search, std::max(third, 0)) < kAbsent_per_m;
    triples.count += static_cast<int>((second | third) >= 0) & static_cast<int>(present);
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
    const auto& t = triples.cell[i];
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

/// `thorough`: all the draws, because what an earlier round stopped for did not pass the gates. Returns whether last
/// frame's plane is held.
bool draw_candidates(Search& search, DepthPlaneState& state, bool thorough) noexcept {
  const Last last = consider_last(search, state);
  if (search.prior.measured)
    for (int i = 0; i < kGravityDraws; ++i) consider_gravity(search, state.random);
  const auto seen = static_cast<float>(std::min(search.frame.samples.count, kPreviewCount));
  const int batches = last == Last::kHeld ? 1 : last == Last::kThere ? 2 : kMaxBatches;
  for (int batch = 0, scored = 0; batch < batches && scored < kMostScored; ++batch) {
    scored += consider_triples(search, state.random);
    search.draws += kBatch;
    const float enough = kEnoughShare[static_cast<std::size_t>(batch)] * seen;
    if (!thorough && static_cast<float>(best_score(search)) >= enough) break;
  }
  return last == Last::kHeld;
}

PlaneTolerance widened(const PlaneTolerance& t, float factor) noexcept {
  return {factor * t.sensor_per_m, factor * t.flatness_m};
}

/// Fits the kept candidates to all samples, wide first to be drawn in from afar, and returns the best of them. Only
/// those are fitted that a fit may lift above the best: beside a held plane none, else those with half its score.
Candidate best_fitted(const Search& search, bool held) noexcept {
  Candidate best;
  const InverseDepths all = search.frame.all();
  const int top = best_score(search), worth_it = held ? top : top > 0 ? top / 2 : Candidate{}.score;
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
  bool moved = true;
  for (int pass = 0; pass + 1 < kPolishPasses && moved; ++pass) {
    const Vec3 before = plane.gradient();
    if (!refine(search.frame.all(), search.tolerance, plane)) return {};
    moved = (plane.gradient() - before).squaredNorm() > kSettled * before.squaredNorm();
  }
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
  Frame frame(state.table);
  gather(state.table, depth, params.range, frame.samples);
  if (frame.samples.count < std::max(params.min_inliers, 8)) {
    state.warm = false;
    return {};
  }
  fill_preview(frame);
  Search search{frame, prior, {kSigmas * params.sensor_sigma_per_m, params.flatness_m}, std::cos(prior.max_angle_rad)};
  PlaneEstimate estimate;
  for (int round = 0; round < kRounds && !estimate.valid; ++round) {
    const bool held = draw_candidates(search, state, round > 0);
    const Candidate best = best_fitted(search, held);
    if (best.score != Candidate{}.score) estimate = polish(params, search, best.plane);
    state.warm = false;  // another round starts from nothing
  }
  estimate.draws = search.draws;
  state.warm = estimate.valid;
  if (estimate.valid) {
    state.last_share = estimate.inlier_share;
    const Vec3 gradient = -estimate.normal_cam / estimate.height_m;
    state.last = {gradient.x(), gradient.y(), gradient.z()};
  }
  return estimate;
}

}  // namespace wasp::vision
