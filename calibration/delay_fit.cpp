#include "calibration/delay_fit.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace wasp::calibration {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

constexpr double kCoarse_s = 0.002, kFine_s = 0.00025;
constexpr int kBlocks = 8;
constexpr double kFarthest = 4.5;  ///< robust deviations of a residual, beyond which a pair is left out

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The pairs that take part at every delay of the search, and what was seen in them; recordings one after the other.
struct Data {
  std::span<const DelayRun> runs;
  std::vector<TimeNs> from_ns, until_ns;
  std::vector<std::size_t> run;                  ///< of each pair
  MatrixXd in_run;                               ///< 1 where the pair (row) is of the recording (column)
  bool axes_known = true, over_floor = true;     ///< in all of them
  std::array<std::array<VectorXd, 6>, 2> image;  ///< by estimate (rotation, epipolar) and channel [1/s]
  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(from_ns.size()); }
};

/// The sensor's record reaches over the pair at every delay up to `reach_ns`.
bool comparable(const ImageTurn& turn, const TurnSource& source, bool over_floor, DurationNs reach_ns) {
  return turn.valid && (!over_floor || turn.centre.allFinite()) &&
         source.mean_rate(turn.first_ns - reach_ns, turn.second_ns - reach_ns) &&
         source.mean_rate(turn.first_ns + reach_ns, turn.second_ns + reach_ns) &&
         source.mean_rate(turn.first_ns - reach_ns, turn.second_ns + reach_ns);
}

Data gather(std::span<const DelayRun> runs, DurationNs reach_ns) {
  Data data;
  data.runs = runs;
  for (const DelayRun& run : runs) {
    data.axes_known = data.axes_known && run.source.axes_known();
    data.over_floor = data.over_floor && run.source.over_floor();
  }
  std::vector<const ImageTurn*> used;
  for (std::size_t r = 0; r < runs.size(); ++r)
    for (const ImageTurn& turn : runs[r].turns)
      if (comparable(turn, runs[r].source, data.over_floor, reach_ns)) used.push_back(&turn), data.run.push_back(r);
  const auto n = static_cast<Eigen::Index>(used.size());
  data.in_run = MatrixXd::Zero(n, static_cast<Eigen::Index>(runs.size()));
  for (auto& estimate : data.image)
    for (VectorXd& axis : estimate) axis.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const ImageTurn& turn = *used[static_cast<std::size_t>(i)];
    const double dt = to_seconds(turn.second_ns - turn.first_ns);
    data.from_ns.push_back(turn.first_ns);
    data.until_ns.push_back(turn.second_ns);
    data.in_run(i, static_cast<Eigen::Index>(data.run[static_cast<std::size_t>(i)])) = 1;
    for (int a = 0; a < 3; ++a) {
      data.image[0][static_cast<std::size_t>(a)][i] = turn.rotation_rad[a] / dt;
      data.image[1][static_cast<std::size_t>(a)][i] = turn.epipolar_rad[a] / dt;
      data.image[0][static_cast<std::size_t>(a + 3)][i] = turn.centre[a] / dt;
    }
  }
  return data;
}

/// Mean rates of the sensor over the pairs at a delay; one row a pair.
MatrixXd gyro_at(const Data& data, double delay_s) {
  const DurationNs delay_ns = from_seconds(delay_s);
  MatrixXd rates(data.size(), 6);
  for (Eigen::Index i = 0; i < data.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const TurnSource& source = data.runs[data.run[k]].source;
    const auto rate = source.mean_rate(data.from_ns[k] - delay_ns, data.until_ns[k] - delay_ns);
    rates.row(i) = rate.value_or(MotionRates::Zero()).transpose();
  }
  return rates;
}

struct Regression {
  double residual_squares = 0, total_squares = 0;
  VectorXd fitted, residual;
  double scale = 0, bias = 0;
};

/// y on the gyro's own axis (known axes; a scale below zero is none) or on all three, and a constant for each
/// recording; rows by weight.
Regression regress(const VectorXd& y, const MatrixXd& gyro, int axis, const Data& data, const VectorXd& weights) {
  const Eigen::Index runs = data.in_run.cols();
  MatrixXd X(y.size(), runs + (data.axes_known ? 1 : 3));
  X.leftCols(runs) = data.in_run;
  if (data.axes_known)
    X.col(runs) = gyro.col(axis);
  else
    X.rightCols(3) = gyro.leftCols(3);
  const VectorXd root = weights.cwiseSqrt();
  const VectorXd sums = (data.in_run.transpose() * weights).cwiseMax(1e-9);
  const VectorXd means = data.in_run * (data.in_run.transpose() * weights.cwiseProduct(y)).cwiseQuotient(sums);
  Regression r;
  r.total_squares = (weights.array() * (y - means).array().square()).sum();
  const VectorXd beta = (root.asDiagonal() * X).colPivHouseholderQr().solve(root.asDiagonal() * y);
  const bool follows = !data.axes_known || beta[runs] > 0;
  r.fitted = follows ? VectorXd(X * beta) : means;
  r.residual = y - r.fitted;
  r.residual_squares = (weights.array() * r.residual.array().square()).sum();
  r.scale = data.axes_known ? beta[runs] : std::nan("");
  r.bias = beta.head(runs).mean();
  return r;
}

/// One series of image rates that may take part.
struct Channel {
  int axis = 0;
  std::size_t estimate = 0;
  VectorXd weights;  ///< 0: an outlier
  double effective_share = 1;
};

class Profile {
 public:
  explicit Profile(const Data& data) : data_(data) {}

  [[nodiscard]] Regression fit(const Channel& c, const MatrixXd& gyro) const {
    return regress(image(c), gyro, c.axis, data_, c.weights);
  }
  /// Log likelihood of a delay over no relation.
  [[nodiscard]] double at(double delay_s, const std::vector<Channel>& channels) const {
    const MatrixXd gyro = gyro_at(data_, delay_s);
    double sum = 0;
    for (const Channel& c : channels) {
      const Regression r = fit(c, gyro);
      sum -= 0.5 * c.effective_share * c.weights.sum() *
             std::log(std::max(r.residual_squares, 1e-12) / std::max(r.total_squares, 1e-12));
    }
    return sum;
  }
  [[nodiscard]] const VectorXd& image(const Channel& c) const {
    return data_.image[c.estimate][static_cast<std::size_t>(c.axis)];
  }

 private:
  const Data& data_;
};

struct Peak {
  double delay_s = 0, height = 0;
};

/// The highest of a function on a grid, refined by a finer grid and a parabola.
template <class Function>
Peak refine(const Function& f, double about_s) {
  Peak best{about_s, -1e300};
  for (double d = about_s - 2 * kCoarse_s; d <= about_s + 2 * kCoarse_s; d += kFine_s)
    if (const double h = f(d); h > best.height) best = {d, h};
  const double low = f(best.delay_s - kFine_s), high = f(best.delay_s + kFine_s);
  const double bend = low - 2 * best.height + high;
  if (bend < 0) best.delay_s += std::clamp(0.5 * (low - high) / bend, -1.0, 1.0) * kFine_s;
  return best;
}

/// Effective share of samples whose neighbours agree by r: (1 - r) / (1 + r).
double effective_share(const VectorXd& residual) {
  const Eigen::Index n = residual.size();
  if (n < 4) return 1;
  const double all = residual.squaredNorm(), next = residual.head(n - 1).dot(residual.tail(n - 1));
  const double r = std::clamp(all > 0 ? next / all : 0, 0.0, 0.9);
  return (1 - r) / (1 + r);
}

/// Weights 1, or 0 for residuals far beyond their robust deviation.
VectorXd inliers(const VectorXd& residual) {
  std::vector<double> sizes;
  for (const double r : residual) sizes.push_back(std::abs(r));
  const double limit = std::max(kFarthest * 1.4826 * median(sizes), 1e-9);
  return (residual.array().abs() <= limit).cast<double>();
}

/// Of both estimates of an axis the one that follows the gyro better at its own best delay.
std::vector<Channel> choose(const Data& data, const Profile& profile, const std::vector<double>& grid,
                            const ChannelChoice& choice) {
  std::vector<Channel> chosen;
  for (int axis = 0; axis < (data.over_floor ? 6 : 3); ++axis) {
    if (!choice[static_cast<std::size_t>(axis)]) continue;
    Channel best;
    double highest = -1e300;
    for (std::size_t estimate = 0; estimate < (axis < 3 ? 2 : 1); ++estimate) {
      Channel c{axis, estimate, VectorXd::Ones(data.size())};
      for (const double d : grid)
        if (const double h = profile.at(d, {c}); h > highest) highest = h, best = c;
    }
    chosen.push_back(best);
  }
  return chosen;
}

Peak highest(const Profile& profile, const std::vector<Channel>& channels, const std::vector<double>& grid) {
  Peak best{0, -1e300};
  for (const double d : grid)
    if (const double h = profile.at(d, channels); h > best.height) best = {d, h};
  return refine([&](double d) { return profile.at(d, channels); }, best.delay_s);
}

/// Outliers and effective shares from the residuals at a delay.
void settle(const Profile& profile, const MatrixXd& gyro, std::vector<Channel>& channels) {
  for (Channel& c : channels) {
    c.weights = inliers(profile.fit(c, gyro).residual);
    const VectorXd residual = profile.fit(c, gyro).residual.cwiseProduct(c.weights);
    c.effective_share = effective_share(residual);
  }
}

/// One standard deviation by leaving out one eighth of the record after the other.
double jackknife(const Data& data, const Profile& profile, const std::vector<Channel>& channels, double delay_s) {
  std::vector<double> delays;
  for (int block = 0; block < kBlocks; ++block) {
    std::vector<Channel> rest = channels;
    const Eigen::Index first = data.size() * block / kBlocks, last = data.size() * (block + 1) / kBlocks;
    for (Channel& c : rest) c.weights.segment(first, last - first).setZero();
    Peak best{delay_s, -1e300};
    for (double d = delay_s - 0.03; d <= delay_s + 0.03; d += kCoarse_s)
      if (const double h = profile.at(d, rest); h > best.height) best = {d, h};
    delays.push_back(refine([&](double d) { return profile.at(d, rest); }, best.delay_s).delay_s);
  }
  double mean = 0, squares = 0;
  for (const double d : delays) mean += d / kBlocks;
  for (const double d : delays) squares += (d - mean) * (d - mean);
  return std::sqrt(squares * (kBlocks - 1) / kBlocks);
}

double curvature_sigma(const Profile& profile, const std::vector<Channel>& channels, const Peak& peak) {
  constexpr double kStep = 0.004;
  const double bend =
      (profile.at(peak.delay_s - kStep, channels) - 2 * peak.height + profile.at(peak.delay_s + kStep, channels)) /
      (kStep * kStep);
  return bend < 0 ? 1 / std::sqrt(-bend) : 1.0;
}

/// The best delay of each recording, with scales of its own.
std::vector<RunDelay> each_alone(const Data& data, const Profile& profile, const std::vector<Channel>& channels,
                                 const std::vector<double>& grid, double common_s) {
  std::vector<RunDelay> out;
  for (Eigen::Index r = 0; r < data.in_run.cols(); ++r) {
    std::vector<Channel> own = channels;
    for (Channel& c : own) c.weights = c.weights.cwiseProduct(data.in_run.col(r));
    const Peak peak = highest(profile, own, grid);
    out.push_back({static_cast<std::size_t>(data.in_run.col(r).sum()), peak.delay_s,
                   std::max(peak.height - profile.at(common_s, own), 0.0)});
  }
  return out;
}

/// Middle of each pair since the first, recordings end to end.
std::vector<double> times_of(const Data& data) {
  std::vector<double> times;
  double before_s = 0;
  std::size_t first = 0;
  for (std::size_t k = 0; k < data.run.size(); ++k) {
    if (data.run[k] != data.run[first]) before_s = times.back(), first = k;
    times.push_back(before_s + 0.5 * to_seconds(data.from_ns[k] + data.until_ns[k] - 2 * data.from_ns[first]));
  }
  return times;
}

double rms_about_mean(const VectorXd& v) {
  return v.size() == 0 ? 0 : std::sqrt((v.array() - v.mean()).square().mean());
}

AxisFit axis_fit(const Profile& profile, const Channel& c, const MatrixXd& gyro) {
  const Regression r = profile.fit(c, gyro);
  AxisFit a;
  a.compared = true;
  const double explained = 1 - r.residual_squares / std::max(r.total_squares, 1e-12);
  a.correlation = std::sqrt(std::max(explained, 0.0));
  a.epipolar = c.estimate == 1;
  a.scale = r.scale;
  a.bias_radps = r.bias;
  a.residual_radps = std::sqrt(r.residual_squares / std::max(c.weights.sum(), 1.0));
  a.gyro_rms_radps = rms_about_mean(gyro.col(c.axis));
  a.effective_share = c.effective_share;
  a.used = -0.5 * c.effective_share * c.weights.sum() * std::log(std::max(1 - explained, 1e-12)) > 4;
  return a;
}

std::string list_of(const std::vector<RunDelay>& runs) {
  std::string out;
  for (const RunDelay& run : runs) out += fmt::format(" {:.1f} ms", 1e3 * run.delay_s);
  return out;
}

/// Why recordings may not be fitted together; empty: they may.
std::string quarrel_of(const DelayFit& fit, const DelayParams& p) {
  for (std::size_t r = 0; r < fit.runs.size(); ++r)
    if (fit.runs[r].frames == 0)
      return fmt::format("recording {} of {} has no pair of frames within its sensor's record: leave it out", r + 1,
                         fit.runs.size());
  const double most = p.most_discord + static_cast<double>(fit.runs.size());
  if (fit.discord <= most) return "";
  return fmt::format(
      "the recordings do not agree: alone they say{} (likelihood gained {:.1f}, at most {:.0f}); they must be of one "
      "camera with one setting",
      list_of(fit.runs), fit.discord, most);
}

/// Why the answer may not be used; empty: it may.
std::string refusal_of(const DelayFit& fit, const DelayParams& p) {
  double turned = 0;
  for (const AxisFit& a : fit.axes) turned = std::max(turned, a.gyro_rms_radps);
  const std::string moved =
      fmt::format("the rates vary by {:.2f} deg/s rms about the axis that turns most", degrees(turned));
  if (fit.likelihood < p.least_likelihood)
    return fmt::format(
        "the image's turns do not follow the sensor's at any delay (likelihood {:.1f}, at least {:.0f}); {}: "
        "turn the vehicle to and fro, by hand, for ten seconds before a textured scene",
        fit.likelihood, p.least_likelihood, moved);
  if (std::abs(fit.delay_s) > p.search_s - 2 * kCoarse_s)
    return fmt::format("the best delay, {:.0f} ms, lies at the edge of the search: widen --search-ms",
                       1e3 * fit.delay_s);
  if (const std::string quarrel = quarrel_of(fit, p); !quarrel.empty()) return quarrel;
  if (fit.sigma_s > p.max_sigma_s)
    return fmt::format(
        "the motion determines the delay to {:.1f} ms only (one standard deviation; at most {:.1f}); {} and too "
        "evenly: turns that begin and end sharply tell more",
        1e3 * fit.sigma_s, 1e3 * p.max_sigma_s, moved);
  if (fit.lead < p.least_lead)
    return fmt::format("another delay fits nearly as well (lead {:.1f}, at least {:.0f}): the motion repeats itself",
                       fit.lead, p.least_lead);
  return "";
}

}  // namespace

DelayFit fit_delay(std::span<const DelayRun> runs, const DelayParams& params, const ChannelChoice& choice) {
  DelayFit fit;
  const Data data = gather(runs, from_seconds(params.search_s + 0.035));
  fit.frames = static_cast<std::size_t>(data.size());
  if (data.size() < params.least_frames) {
    fit.refusal = fmt::format(
        "{} pairs of frames have flow and lie within the sensor's record with {:.0f} ms to spare; {} are "
        "the least",
        data.size(), 1e3 * params.search_s, params.least_frames);
    return fit;
  }
  std::vector<double> grid;
  for (double d = -params.search_s; d <= params.search_s + 1e-9; d += kCoarse_s) grid.push_back(d);
  const Profile profile(data);
  std::vector<Channel> channels = choose(data, profile, grid, choice);
  Peak peak = highest(profile, channels, grid);
  for (int round = 0; round < 2; ++round) {
    settle(profile, gyro_at(data, peak.delay_s), channels);
    peak = highest(profile, channels, grid);
  }
  fit.delay_s = peak.delay_s;
  fit.likelihood = peak.height;
  fit.curvature_sigma_s = curvature_sigma(profile, channels, peak);
  fit.jackknife_sigma_s = jackknife(data, profile, channels, peak.delay_s);
  fit.sigma_s = std::max(fit.curvature_sigma_s, fit.jackknife_sigma_s);
  fit.profile_delay_s = grid;
  fit.lead = 1e300;
  for (const double d : grid) {
    fit.profile.push_back(profile.at(d, channels));
    if (std::abs(d - peak.delay_s) > std::max(4 * fit.sigma_s, 0.015))
      fit.lead = std::min(fit.lead, peak.height - fit.profile.back());
  }
  const MatrixXd gyro = gyro_at(data, peak.delay_s);
  fit.time_s = times_of(data);
  if (runs.size() > 1) fit.runs = each_alone(data, profile, channels, grid, peak.delay_s);
  for (const RunDelay& run : fit.runs) fit.discord += run.gain;
  for (const Channel& c : channels) {
    const auto a = static_cast<std::size_t>(c.axis);
    fit.axes[a] = axis_fit(profile, c, gyro);
    const VectorXd fitted = profile.fit(c, gyro).fitted;
    fit.image_radps[a].assign(profile.image(c).begin(), profile.image(c).end());
    fit.gyro_radps[a].assign(fitted.begin(), fitted.end());
  }
  fit.refusal = refusal_of(fit, params);
  return fit;
}

}  // namespace wasp::calibration
