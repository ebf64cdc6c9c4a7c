#include "calibration/calibrate_kinect_depth.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "calibration/kinect_readings.h"
#include "calibration/picture.h"

namespace wasp::calibration {
namespace {

using drivers::KinectModel;

constexpr int kSpare = 2;                 ///< distances more than coefficients
constexpr double kLeastRatio = 2.5;       ///< of the farthest to the nearest distance
constexpr double kMostSigmaShare = 0.02;  ///< of a depth within the range
constexpr double kMostRmsShare = 0.03;
constexpr double kBeyond = 0.05;  ///< the range written reaches so much beyond the points

struct Trial {
  KinectModel kind;
  std::optional<KinectDepthFit> fit;
  std::string refusal;  ///< empty: good
};

std::string name(KinectModel kind) { return std::string(drivers::name_of(kind)); }

std::string worst_point(const KinectDepthFit& fit, const std::vector<KinectPoint>& points) {
  std::size_t worst = 0;
  const auto share = [&](std::size_t i) { return std::fabs(fit.residual_m[i]) / points[i].distance_m; };
  for (std::size_t i = 1; i < points.size(); ++i)
    if (share(i) > share(worst)) worst = i;
  return fmt::format("{} ({:.3f} m, raw {:.1f}) is off by {:.1f} %", points[worst].name, points[worst].distance_m,
                     points[worst].raw, 100 * share(worst));
}

/// A depth that falls with the raw value somewhere between the points is no model of this sensor.
bool rises(const KinectDepthFit& fit, const std::vector<KinectPoint>& points) {
  double last = 0;
  for (double raw = points.front().raw; raw <= points.back().raw; raw += 1) {
    const double z = drivers::model_depth_m(fit.model, raw);
    if (!(z > last)) return false;
    last = z;
  }
  return true;
}

Trial try_model(KinectModel kind, const std::vector<KinectPoint>& points, const KinectNoise& noise) {
  Trial t{kind, std::nullopt, {}};
  const std::size_t least = static_cast<std::size_t>(drivers::coefficient_count(kind) + kSpare);
  if (points.size() < least) {
    t.refusal = fmt::format("{} distances, {} are the least for its {} coefficients", points.size(), least,
                            drivers::coefficient_count(kind));
    return t;
  }
  t.fit = fit_kinect_depth(kind, points, noise);
  if (!t.fit) {
    t.refusal = "does not fit these readings at all";
  } else if (t.fit->rms_share > kMostRmsShare) {
    t.refusal = fmt::format("misses the readings by {:.1f} % rms, {:.0f} % are allowed: {}", 100 * t.fit->rms_share,
                            100 * kMostRmsShare, worst_point(*t.fit, points));
  } else if (const double sigma = t.fit->worst_sigma_share(points); sigma > kMostSigmaShare) {
    t.refusal = fmt::format("the readings leave its depths open by up to {:.1f} % (one standard deviation), {:.0f} % are "
                            "allowed: more distances, more evenly spread",
                            100 * std::min(sigma, 10.0), 100 * kMostSigmaShare);
  } else if (!rises(*t.fit, points)) {
    t.refusal = "does not rise with the raw value";
  }
  return t;
}

void check_points(const KinectReadings& r) {
  std::string why;
  for (const auto& problem : r.skipped) why += "; " + problem;
  if (r.points.size() < 4)
    throw Refusal(fmt::format("{} distances, 4 are the least for the simplest model{}", r.points.size(), why));
  const KinectPoint &near = r.points.front(), &far = r.points.back();
  if (far.distance_m < kLeastRatio * near.distance_m)
    throw Refusal(fmt::format("distances from {:.2f} to {:.2f} m: the farthest must be {} times the nearest, or the "
                              "curve between raw value and depth is not determined",
                              near.distance_m, far.distance_m, kLeastRatio));
  for (std::size_t i = 1; i < r.points.size(); ++i)
    if (r.points[i].raw <= r.points[i - 1].raw)
      throw Refusal(fmt::format("{}: raw {:.1f} at {:.3f} m, but {:.1f} at {:.3f} m: raw values rise with distance",
                                r.points[i].name, r.points[i].raw, r.points[i].distance_m, r.points[i - 1].raw,
                                r.points[i - 1].distance_m));
}

const Trial& choose(const std::vector<Trial>& trials, const std::string& model) {
  const Trial* best = nullptr;
  std::string refusals;
  for (const Trial& t : trials) {
    if (!t.refusal.empty()) {
      if (model == "auto" || model == name(t.kind)) refusals += (refusals.empty() ? "" : "; ") + name(t.kind) + ": " + t.refusal;
    } else if (model == name(t.kind)) {
      return t;
    } else if (model == "auto" && (best == nullptr || t.fit->held_out_share < best->fit->held_out_share)) {
      best = &t;
    }
  }
  if (best == nullptr) throw Refusal(refusals);
  return *best;
}

Picture depth_picture(const std::vector<Trial>& trials, const std::vector<KinectPoint>& points) {
  tools::Plot plot = labelled_plot("raw value to depth", "raw value", "depth [m]");
  int colour = 0;
  for (const Trial& t : trials) {
    if (!t.fit) continue;
    tools::Curve curve{name(t.kind), {fmt::format("c{}", colour++), "thin"}, {}};
    for (double raw = points.front().raw; raw <= points.back().raw; raw += 2) {
      curve.series.x.push_back(raw);
      curve.series.y.push_back(drivers::model_depth_m(t.fit->model, raw));
    }
    plot.curves.push_back(std::move(curve));
  }
  tools::Curve seen{"readings", {"ink", "dots"}, {}};
  for (const auto& point : points) seen.series.x.push_back(point.raw), seen.series.y.push_back(point.distance_m);
  plot.curves.push_back(std::move(seen));
  return picture("depth", plot);
}

Picture residual_picture(const std::vector<Trial>& trials, const std::vector<KinectPoint>& points) {
  tools::Plot plot = labelled_plot("model minus distance", "distance [m]", "model minus distance [%]");
  int colour = 0;
  for (const Trial& t : trials) {
    if (!t.fit) continue;
    tools::Curve curve{name(t.kind), {fmt::format("c{}", colour++), "dots"}, {}};
    for (std::size_t i = 0; i < points.size(); ++i) {
      curve.series.x.push_back(points[i].distance_m);
      curve.series.y.push_back(100 * t.fit->residual_m[i] / points[i].distance_m);
    }
    plot.curves.push_back(std::move(curve));
  }
  return picture("residuals", plot);
}

TomlSection evidence_of(const std::vector<Trial>& trials, const std::vector<KinectPoint>& points) {
  TomlSection t;
  t.whole("distances", static_cast<long long>(points.size()));
  t.number("nearest_m", points.front().distance_m).number("farthest_m", points.back().distance_m);
  for (const Trial& trial : trials) {
    std::string key = name(trial.kind);
    std::replace(key.begin(), key.end(), '-', '_');
    if (!trial.refusal.empty()) t.text(key + "_refused", trial.refusal);
    if (!trial.fit) continue;
    const KinectDepthFit& f = *trial.fit;
    const auto n = static_cast<std::size_t>(drivers::coefficient_count(trial.kind));
    const auto coefficients = std::span(f.model.coefficients).first(n);
    const std::array figures{f.rms_m, f.rms_share, f.held_out_share, f.worst_sigma_share(points), f.chi2_per_freedom};
    const auto finite = [](double v) { return std::isfinite(v); };
    if (!std::all_of(coefficients.begin(), coefficients.end(), finite) ||
        !std::all_of(figures.begin(), figures.end(), finite)) {
      t.flag(key + "_diverged", true);
      continue;
    }
    t.numbers(key, coefficients);
    t.number(key + "_rms_m", f.rms_m).number(key + "_rms_share", f.rms_share);
    t.number(key + "_held_out_share", f.held_out_share, "of distances the fit did not see");
    t.number(key + "_worst_sigma_share", f.worst_sigma_share(points), "within the range, one standard deviation");
    t.number(key + "_chi2_per_freedom", f.chi2_per_freedom);
  }
  return t;
}

}  // namespace

Solution solve_kinect_depth(const KinectDepthOptions& o, ProgressBar& bar) {
  bar.show(0.1, o.table);
  const KinectReadings readings = read_kinect_readings(o.table, o.part);
  check_points(readings);
  std::vector<Trial> trials;
  for (const KinectModel kind : {KinectModel::kLinear, KinectModel::kTangent, KinectModel::kTwoGaussians}) {
    bar.show(0.3 + 0.2 * static_cast<double>(trials.size()), name(kind));
    trials.push_back(try_model(kind, readings.points, o.noise));
  }
  const Trial& best = choose(trials, o.model);
  const drivers::KinectDepthModel& model = best.fit->model;
  Solution s;
  TomlSection& camera = s.flight.emplace_back("camera");
  camera.text("depth_model", name(best.kind));
  camera.numbers("depth_coefficients",
                 std::span(model.coefficients).first(static_cast<std::size_t>(drivers::coefficient_count(best.kind))));
  const std::vector<double> range{std::max(0.4, (1 - kBeyond) * static_cast<double>(model.range.min_m)),
                                  std::min(7.0, (1 + kBeyond) * static_cast<double>(model.range.max_m))};
  camera.numbers("depth_range_m", range, "what the distances cover");
  s.evidence = evidence_of(trials, readings.points);
  s.source = o.table;
  s.samples = readings.readings - readings.skipped.size();
  s.residual_rms = 100 * best.fit->rms_share;
  s.residual_unit = "% of the distance";
  for (const auto& problem : readings.skipped) s.notes.push_back("skipped: " + problem);
  for (const Trial& t : trials)
    if (!t.refusal.empty()) s.notes.push_back(name(t.kind) + ": " + t.refusal);
  s.pictures = {depth_picture(trials, readings.points), residual_picture(trials, readings.points)};
  return s;
}

std::function<Solution(ProgressBar&)> prepare_kinect_depth(CLI::App& app) {
  auto o = std::make_shared<KinectDepthOptions>();
  app.add_option("TABLE", o->table,
                 "CSV with the columns raw,distance_m, or file,distance_m: raw depth images beside it (16-bit PNG or "
                 "PGM, as fakenect-record writes them) of a wall seen straight on")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("--model", o->model, "for the flight; auto: the best on distances held out")
      ->check(CLI::IsMember({"auto", "two-gaussians", "tangent", "linear"}));
  app.add_option("--part", o->part, "of an image's width and height that shows the wall")->check(CLI::Range(0.01, 1.0));
  app.add_option("--tape-m", o->noise.tape_m, "error of a distance, one standard deviation")->check(CLI::Range(1e-4, 1.0));
  app.add_option("--raw-steps", o->noise.raw_steps, "of a reading")->check(CLI::Range(0.01, 50.0));
  return [o](ProgressBar& bar) { return solve_kinect_depth(*o, bar); };
}

}  // namespace wasp::calibration
