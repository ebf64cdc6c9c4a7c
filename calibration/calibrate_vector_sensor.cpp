#include "calibration/calibrate_vector_sensor.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>

#include "calibration/rest_periods.h"
#include "calibration/sphere_coverage.h"
#include "calibration/vector_sensor_result.h"

namespace wasp::calibration {
namespace {

using Eigen::Vector3d;
using Points = std::vector<EllipsoidSample>;

constexpr double kLeastEigenvalue = 0.01;      ///< an error of the model is then magnified at most tenfold
constexpr double kWeakestEigenvalue = 0.0025;  ///< twentyfold, where the model leaves little to be magnified
constexpr double kWidestGap_rad = 1.31;        ///< 75 degrees; six faces of a cube leave 55
constexpr double kLeastSpan_degc = 5;          ///< of temperature, before a slope is looked for
constexpr double kLeastUsed = 0.6;             ///< share of samples that must agree
constexpr std::size_t kMostPerCell = 80;       ///< a direction that was held long must not outweigh the others
constexpr std::size_t kMostAtFirst = 4000;

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

/// Means of rests, one point each.
Points points_at_rest(const VectorSensorOptions& o, const Samples& s, double& noise) {
  const bool rows = o.rows_are_rests || (s.time_s.empty() && s.size() < 240);
  Points points;
  if (rows) {
    for (std::size_t i = 0; i < s.size(); ++i)
      points.push_back({s.values[i], s.temperature_degc.empty() ? 0 : s.temperature_degc[i], static_cast<int>(i)});
    return points;
  }
  const auto to_flight = to_flight_unit(s.unit);
  const double typical = to_flight ? o.sensor.norm / *to_flight : half_range(s.values);
  for (const RestPeriod& rest : find_rests(s, {}, typical)) {
    points.push_back({rest.mean, rest.temperature_degc, static_cast<int>(points.size())});
    noise = std::max(noise, rest.sigma_of_mean.maxCoeff());
  }
  const auto least = static_cast<std::size_t>(EllipsoidModel{}.parameters());
  if (points.size() < least)
    throw Refusal(
        fmt::format("{} rest{} of half a second or more found in {} samples; {} in different orientations are "
                    "the least, 12 or more are good: put the sensor down, wait two seconds, turn it, repeat",
                    points.size(), points.size() == 1 ? "" : "s", s.size(), least));
  return points;
}

/// Readings that are news, evenly thinned.
Points points_in_motion(const Samples& s) {
  Points points;
  for (std::size_t i = 0; i < s.size(); ++i)
    if (i == 0 || s.values[i] != s.values[i - 1])
      points.push_back({s.values[i], s.temperature_degc.empty() ? 0 : s.temperature_degc[i], 0});
  return points;
}

Points thinned(const Points& points, std::size_t most) {
  if (points.size() <= most) return points;
  Points some;
  for (std::size_t i = 0; i < most; ++i) some.push_back(points[i * points.size() / most]);
  return some;
}

std::vector<Vector3d> directions_of(const Ellipsoid& e, const Points& points) {
  std::vector<Vector3d> out;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (e.used[i]) out.push_back(e.corrected(points[i].value, points[i].temperature_degc).normalized());
  return out;
}

/// At most kMostPerCell readings of every direction as `e` sees it, each direction a group.
Points balanced(const Ellipsoid& e, const Points& points) {
  std::map<int, Points> cells;
  for (EllipsoidSample p : points) {
    p.group = sphere_cell(e.corrected(p.value, p.temperature_degc).normalized());
    cells[p.group].push_back(p);
  }
  Points out;
  for (const auto& [cell, inside] : cells) {
    const Points some = thinned(inside, kMostPerCell);
    out.insert(out.end(), some.begin(), some.end());
  }
  return out;
}

void check_coverage(const Ellipsoid& e, const SphereCoverage& coverage) {
  if (coverage.widest_gap_rad > kWidestGap_rad)
    throw Refusal(
        fmt::format("the directions leave a gap {:.0f} degrees wide in radius ({} of {} cells of the sphere "
                    "hold a reading; at most {:.0f} degrees are allowed): turn the sensor over every side",
                    degrees(coverage.widest_gap_rad), coverage.cells, kSphereCells, degrees(kWidestGap_rad)));
  if (e.least_eigenvalue < kLeastEigenvalue)
    throw Refusal(
        fmt::format("the normal equations are nearly singular: least eigenvalue {:.2g} of at least {:.2g} (an "
                    "even sphere has 0.13): some neutral and scale cannot be told apart in these directions",
                    e.least_eigenvalue, kLeastEigenvalue));
}

void check_fit(const Ellipsoid& e, const VectorSensor& sensor, std::size_t all) {
  const double rms = e.residual_rms / e.norm;
  if (static_cast<double>(e.used_count) < kLeastUsed * static_cast<double>(all))
    throw Refusal(fmt::format("only {} of {} readings agree on one ellipsoid", e.used_count, all));
  if (rms > sensor.most_residual)
    throw Refusal(fmt::format("the norm scatters by {:.2g} % rms about its mean, {:.2g} % are allowed: {}", 100 * rms,
                              100 * sensor.most_residual,
                              sensor.sensor == Sensor::kAccel ? "it was not at rest, or is not linear"
                                                              : "the field around it changed (currents, iron)"));
  const double neutral = (e.K * e.neutral_sigma).maxCoeff() / e.norm;
  const double scale = (e.K_sigma.diagonal().array() / e.K.diagonal().array()).maxCoeff();
  if (std::max(neutral, scale) > sensor.most_sigma)
    throw Refusal(
        fmt::format("neutrals are known to {:.2g} % of the norm and scales to {:.2g} % (one standard "
                    "deviation), {:.2g} % are allowed: more readings in more directions",
                    100 * neutral, 100 * scale, 100 * sensor.most_sigma));
}

Ellipsoid fit(const Points& points, const EllipsoidModel& model, double norm, double noise) {
  auto e = fit_ellipsoid(points, model, norm, noise);
  if (!e)
    throw Refusal(fmt::format("no ellipsoid fits {} readings with {} parameters", points.size(), model.parameters()));
  return *std::move(e);
}

/// Greatest minus least temperature, 0 where there is none.
double temperature_span(const Samples& s) {
  if (s.temperature_degc.empty()) return 0;
  const auto [low, high] = std::minmax_element(s.temperature_degc.begin(), s.temperature_degc.end());
  return *high - *low;
}

/// An error of the model moves no value far: it is magnified little, or what the fit leaves is small even magnified.
bool determined(const Ellipsoid& e, double most_sigma) {
  if (e.least_eigenvalue >= kLeastEigenvalue) return true;
  const auto used = static_cast<double>(e.used_count);
  const double error = e.residual_rms / e.norm * std::sqrt(used / std::max(used - e.model.parameters(), 1.0));
  return e.least_eigenvalue >= kWeakestEigenvalue && error <= most_sigma * std::sqrt(e.least_eigenvalue);
}

/// `model` where the readings determine it and it does not take a tenth of them for outliers, else what there was.
Ellipsoid richer(const EllipsoidModel& model, const Points& points, const Ellipsoid& than, double noise,
                 double most_sigma) {
  if (static_cast<int>(points.size()) < model.parameters() + std::max(3, model.parameters() / 3)) return than;
  const auto e = fit_ellipsoid(points, model, than.norm, noise);
  return e && determined(*e, most_sigma) && e->used_count * 10 >= than.used_count * 9 ? *e : than;
}

bool may_drift(const VectorSensorOptions& o, const Samples& s) {
  return o.temperature == "auto" && temperature_span(s) >= kLeastSpan_degc;
}

/// The richest model the readings determine. A drift passes for outliers of a model without it, so cross-axis terms
/// that were turned down are tried once more beside it.
Ellipsoid best_model(const VectorSensorOptions& o, const Samples& s, const Points& points, Ellipsoid axes,
                     double noise) {
  const bool cross_axis = o.model != "axes", drift = may_drift(o, s);
  Ellipsoid best = std::move(axes);
  const auto consider = [&](EllipsoidModel model) { best = richer(model, points, best, noise, o.sensor.most_sigma); };
  if (cross_axis) consider({true, false});
  if (drift) consider({best.model.cross_axis, true});
  if (cross_axis && drift && !best.model.cross_axis) consider({true, true});
  if (o.model == "full" && !best.model.cross_axis)
    throw Refusal(
        fmt::format("{} readings do not determine cross-axis terms; --model axes leaves them out", points.size()));
  return best;
}

/// Without a known norm the mean scale stays what the sensor says; where even its unit is unknown the norm is 1.
Ellipsoid with_mean_scale_kept(Ellipsoid e, double to_flight) {
  const double factor = to_flight / std::cbrt(e.K.determinant());
  e.K *= factor, e.K_sigma *= factor, e.norm *= factor, e.residual_rms *= factor;
  return e;
}

void add_options(CLI::App& app, VectorSensorOptions& o, const std::vector<std::string>& units) {
  add_sample_options(app, o.samples, units);
  app.add_option("--model", o.model,
                 "axes: three neutrals, three scales; full: and cross-axis terms; auto: full if determined")
      ->check(CLI::IsMember({"auto", "axes", "full"}));
  app.add_option("--temperature", o.temperature,
                 "auto: slopes of the neutrals where the temperature changed by 5 degrees")
      ->check(CLI::IsMember({"auto", "off"}));
}

}  // namespace

double half_range(const std::vector<Vector3d>& values) {
  double widest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> v;
    for (const auto& value : values) v.push_back(value[axis]);
    std::sort(v.begin(), v.end());
    widest = std::max(widest, 0.5 * (v[v.size() - 1 - v.size() / 50] - v[v.size() / 50]));
  }
  return widest;
}

Solution solve_vector_sensor(const VectorSensorOptions& o, ProgressBar& bar) {
  bar.show(0, "reading");
  const Samples s = read_samples(o.samples, o.sensor.sensor);
  const bool at_rest = o.sensor.sensor == Sensor::kAccel;
  double noise = 0;
  bar.show(0.2, at_rest ? "looking for rests" : "sorting by direction");
  Points points = at_rest ? points_at_rest(o, s, noise) : points_in_motion(s);
  const double norm = o.sensor.norm > 0 ? o.sensor.norm : 1.0;
  if (!at_rest) points = balanced(fit(thinned(points, kMostAtFirst), {}, norm, 0), points);
  bar.show(0.5, fmt::format("fitting {} readings", points.size()));
  if (const double size = half_range(s.values); size > 0) noise *= norm / size;  // to norm units, about
  Ellipsoid e = fit(points, {}, norm, noise);
  check_coverage(e, sphere_coverage(directions_of(e, points)));
  bar.show(0.8, "cross-axis and temperature");
  e = best_model(o, s, points, e, noise);
  check_fit(e, o.sensor, points.size());
  const auto to_flight = to_flight_unit(s.unit);
  if (o.sensor.norm <= 0 && to_flight) e = with_mean_scale_kept(std::move(e), *to_flight);
  Solution solution = vector_sensor_solution(o.sensor, s, points, e);
  if (may_drift(o, s) && !e.model.temperature)
    solution.notes.push_back(fmt::format(
        "the temperature changed by {:.0f} degrees and these readings do not tell what it did: a drift may pass for "
        "neutrals, scales or cross-axis terms; turn to every side while it is cold and again while it is warm",
        temperature_span(s)));
  return solution;
}

std::function<Solution(ProgressBar&)> prepare_accel(CLI::App& app) {
  auto o = std::make_shared<VectorSensorOptions>();
  o->sensor = {Sensor::kAccel, "accel", 9.80665, 0.01, 0.01, "m/s^2"};
  add_options(app, *o, {"m/s^2", "g", "mg", "counts"});
  app.add_option("--norm", o->sensor.norm, "local gravity [m/s^2]")->check(CLI::Range(9.7, 9.9));
  app.add_flag("--rests", o->rows_are_rests, "each row is the mean of a rest already");
  return [o](ProgressBar& bar) { return solve_vector_sensor(*o, bar); };
}

std::function<Solution(ProgressBar&)> prepare_mag(CLI::App& app) {
  auto o = std::make_shared<VectorSensorOptions>();
  o->sensor = {Sensor::kMag, "mag", 0, 0.1, 0.03, "gauss"};
  add_options(app, *o, {"gauss", "mgauss", "uT", "counts"});
  app.add_option("--norm", o->sensor.norm, "local field [gauss]; 0: the sensor's mean scale is kept (counts: norm 1)")
      ->check(CLI::Range(0.0, 1.0));
  return [o](ProgressBar& bar) { return solve_vector_sensor(*o, bar); };
}

}  // namespace wasp::calibration
