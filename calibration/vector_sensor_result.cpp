#include "calibration/vector_sensor_result.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "calibration/picture.h"
#include "calibration/sphere_coverage.h"

namespace wasp::calibration {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;
using Points = std::vector<EllipsoidSample>;

std::vector<double> list(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
std::vector<double> list(const Matrix3d& m) {
  std::vector<double> out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out.push_back(m(i, j));
  return out;
}
std::vector<double> off_diagonal(const Matrix3d& m) { return {m(0, 1), m(0, 2), m(1, 2)}; }

/// [imu] as the link thread applies it: corrected = matrix (measured - neutral).
TomlSection flight_section(const VectorSensor& sensor, const Ellipsoid& e, double to_flight) {
  const std::string name = sensor.name;
  const std::string unit = sensor.sensor == Sensor::kAccel ? "mps2" : "gauss";
  TomlSection section("imu");
  section.numbers(name + "_neutral_" + unit, list(Vector3d(e.neutral * to_flight)));
  section.numbers(name + "_matrix", list(Matrix3d(e.K / to_flight)), "row by row");
  if (e.model.temperature) {
    section.numbers(name + "_neutral_per_degc", list(Vector3d(e.neutral_per_degc * to_flight)));
    section.number(name + "_at_degc", e.at_degc);
  }
  return section;
}

TomlSection evidence_of(const VectorSensor& sensor, const Samples& s, const Points& points, const Ellipsoid& e) {
  std::vector<Vector3d> directions;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (e.used[i]) directions.push_back(e.corrected(points[i].value, points[i].temperature_degc).normalized());
  const SphereCoverage coverage = sphere_coverage(directions);
  TomlSection t;
  t.text("unit", s.unit).text("norm_unit", to_flight_unit(s.unit) || sensor.norm > 0 ? sensor.flight_unit : "1");
  t.number("norm", e.norm);
  t.numbers("neutral", list(e.neutral), s.unit).numbers("neutral_sigma", list(e.neutral_sigma));
  t.numbers("scale", list(Vector3d(e.K.diagonal())), fmt::format("norm unit per {}", s.unit));
  t.numbers("scale_sigma", list(Vector3d(e.K_sigma.diagonal())));
  t.text("model", e.model.cross_axis ? "full" : "axes");
  if (e.model.cross_axis)
    t.numbers("cross_axis", off_diagonal(e.K), "xy, xz, yz of the symmetric matrix")
        .numbers("cross_axis_sigma", off_diagonal(e.K_sigma));
  if (e.model.temperature)
    t.numbers("neutral_per_degc", list(e.neutral_per_degc))
        .numbers("neutral_per_degc_sigma", list(e.neutral_per_degc_sigma))
        .number("at_degc", e.at_degc);
  t.whole("outliers", static_cast<long long>(points.size() - e.used_count));
  t.whole("rows_dropped", static_cast<long long>(s.dropped), "not whole or not finite");
  t.whole("sphere_cells", coverage.cells, fmt::format("of {}", kSphereCells));
  t.number("widest_gap_deg", coverage.widest_gap_rad * 180 / std::numbers::pi, "radius of the largest empty cap");
  t.number("least_eigenvalue", e.least_eigenvalue, "of the normal matrix; an even sphere has 0.13");
  return t;
}

/// Norm error of every reading, and what it was before where the unit is known.
Picture residual_picture(const VectorSensor& sensor, const Samples& s, const Points& points, const Ellipsoid& e) {
  tools::Plot plot = labelled_plot("residuals", "reading", fmt::format("norm - {:.4g}", e.norm));
  const auto to_flight = to_flight_unit(s.unit);
  if (to_flight) plot.y_label += std::string(" [") + sensor.flight_unit + "]";
  tools::Curve before{"before", {"c1", "dots"}, {}}, after{"calibrated", {"c0", "dots"}, {}},
      out{"outliers", {"c3", "dots"}, {}};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto x = static_cast<double>(i);
    const double r = e.corrected(points[i].value, points[i].temperature_degc).norm() - e.norm;
    (e.used[i] ? after : out).series.add(x, r);
    if (to_flight && e.used[i]) before.series.add(x, *to_flight * points[i].value.norm() - e.norm);
  }
  for (auto* curve : {&before, &after, &out})
    if (curve->series.size() > 0) plot.curves.push_back(std::move(*curve));
  return picture("residuals", plot);
}

/// Where on the sphere the readings lie, equal areas equal on paper.
Picture coverage_picture(const Points& points, const Ellipsoid& e) {
  tools::Plot plot = labelled_plot("directions", "azimuth [deg]", "sine of elevation (equal areas)");
  tools::Curve dots{"directions of the readings", {"c2", "dots"}, {}};
  tools::Curve frame{"", {"ink", "thin"}, {}};
  for (const auto& [x, y] : {std::pair{-180, -1}, {180, -1}, {180, 1}, {-180, 1}, {-180, -1}}) frame.series.add(x, y);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3d u = e.corrected(points[i].value, points[i].temperature_degc).normalized();
    if (e.used[i]) dots.series.add(std::atan2(u.y(), u.x()) * 180 / std::numbers::pi, u.z());
  }
  plot.curves = {dots, frame};
  return picture("directions", plot);
}

}  // namespace

Solution vector_sensor_solution(const VectorSensor& sensor, const Samples& s, const Points& points,
                                const Ellipsoid& e) {
  Solution out;
  const auto to_flight = to_flight_unit(s.unit);
  if (to_flight)
    out.flight.push_back(flight_section(sensor, e, *to_flight));
  else
    out.notes.push_back("the samples are in counts: a flight, which gets " + std::string(sensor.flight_unit) +
                        " from its autopilot, has no use for these values; the autopilot's parameters have");
  const int spare = static_cast<int>(e.used_count) - e.model.parameters();
  if (spare < 3)
    out.notes.push_back(fmt::format("{} readings for {} parameters: the residual says little about the fit",
                                    e.used_count, e.model.parameters()));
  out.evidence = evidence_of(sensor, s, points, e);
  out.source = s.source;
  out.samples = e.used_count;
  out.residual_rms = e.residual_rms;
  out.residual_unit = to_flight || sensor.norm > 0 ? sensor.flight_unit : "of a norm of 1";
  out.pictures = {residual_picture(sensor, s, points, e), coverage_picture(points, e)};
  return out;
}

}  // namespace wasp::calibration
