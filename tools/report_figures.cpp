#include "tools/report_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "tools/report_plot.h"
#include "types/frames.h"

namespace wasp::tools {
namespace {

constexpr std::size_t kWideSlices = 1000, kNarrowSlices = 450;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegrees = 180.0 / 3.14159265358979323846;

/// One column against one column of instants.
Series column_series(const ReportData& data, const std::optional<CsvTable>& table, const char* time,
                     const char* value) {
  Series s;
  if (!table) return s;
  const auto t = table->integers(time);
  s.y = table->numbers(value);
  for (const auto instant : t) s.x.push_back(data.seconds(instant));
  return s;
}

/// A value that holds until the next one: upright steps instead of slopes.
Series as_steps(const Series& series) {
  Series steps;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (i > 0 && series.y[i] != series.y[i - 1]) steps.add(series.x[i], series.y[i - 1]);
    steps.add(series.x[i], series.y[i]);
  }
  return steps;
}

void add_curve(Plot& plot, std::string name, CurveStyle style, const Series& series, std::size_t slices) {
  const bool any = std::any_of(series.y.begin(), series.y.end(), [](double v) { return std::isfinite(v); });
  if (any) plot.curves.push_back({std::move(name), std::move(style), thin_envelope(series, slices)});
}

/// Heights of one behaviour at the exposure of its frames; blind cues break the curve.
Series cue_heights(const ReportData& data, const std::string& behaviour) {
  Series s;
  const auto names = data.cues->texts("behaviour");
  const auto t = data.cues->integers("exposed_at_ns"), valid = data.cues->integers("validity"),
             has = data.cues->integers("has_height");
  const auto height = data.cues->numbers("height_m");
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] == behaviour) s.add(data.seconds(t[i]), valid[i] != 0 && has[i] != 0 ? height[i] : kNan);
  return s;
}

/// Behaviours that gave a height at least once, by name.
std::set<std::string> height_behaviours(const ReportData& data) {
  std::set<std::string> found;
  if (!data.cues) return found;
  const auto names = data.cues->texts("behaviour");
  const auto has = data.cues->integers("has_height");
  for (std::size_t i = 0; i < names.size(); ++i)
    if (has[i] != 0) found.insert(names[i]);
  return found;
}

/// Truth at time x, linear between samples; NaN outside them and in gaps over 0.1 s.
double at_time(const Series& truth, double x) {
  const auto after = std::lower_bound(truth.x.begin(), truth.x.end(), x);
  if (after == truth.x.begin() || after == truth.x.end()) return kNan;
  const auto i = static_cast<std::size_t>(after - truth.x.begin());
  const double gap = truth.x[i] - truth.x[i - 1];
  if (gap > 0.1 || gap <= 0) return kNan;
  const double share = (x - truth.x[i - 1]) / gap;
  return truth.y[i - 1] + share * (truth.y[i] - truth.y[i - 1]);
}

Series minus_truth(Series series, const Series& truth) {
  for (std::size_t i = 0; i < series.size(); ++i) series.y[i] -= at_time(truth, series.x[i]);
  return series;
}

void add_phases(Plot& plot, const ReportData& data) {
  if (!data.run.contains("phases") || !data.run["phases"].is_array()) return;
  for (const auto& p : data.run["phases"]) {
    if (!p.is_object() || !p.contains("start_ns") || !p["start_ns"].is_number()) continue;
    const auto start = p.value("start_ns", std::int64_t{0});
    plot.spans.push_back({text_at(p, "name"), data.seconds(start), data.seconds(p.value("end_ns", start))});
  }
}

/// Roll or pitch [deg] of the quaternion columns.
enum class Angle { kRoll, kPitch };
Series angle_series(const ReportData& data, const std::optional<CsvTable>& table, const char* time, Angle angle) {
  Series s = column_series(data, table, time, "q_w");
  if (!table) return s;
  const auto x = table->numbers("q_x"), y = table->numbers("q_y"), z = table->numbers("q_z");
  for (std::size_t i = 0; i < s.size(); ++i) {
    const Quat q(static_cast<float>(s.y[i]), static_cast<float>(x[i]), static_cast<float>(y[i]),
                 static_cast<float>(z[i]));
    const Euler e = euler_from_quat(q);
    s.y[i] = kDegrees * static_cast<double>(angle == Angle::kRoll ? e.roll_rad : e.pitch_rad);
  }
  return s;
}

std::string svg_or_nothing(const Plot& plot) { return plot.curves.empty() ? std::string() : plot.svg(); }

Plot narrow_plot(std::string title, std::string x_label, std::string y_label) {
  Plot plot;
  plot.title = std::move(title);
  plot.x_label = std::move(x_label);
  plot.y_label = std::move(y_label);
  plot.width = 540;
  plot.height = 300;
  return plot;
}

}  // namespace

std::string altitude_figure(const ReportData& data) {
  Plot plot;
  plot.title = "Altitude over time";
  plot.x_label = "time since the first command [s]";
  plot.y_label = "height [m]";
  plot.least_y_span = 0.1;
  add_phases(plot, data);
  int colour = 0;
  for (const auto& name : height_behaviours(data))
    add_curve(plot, name, {fmt::format("c{}", colour++ % 6), "thin soft"}, cue_heights(data, name), kWideSlices);
  add_curve(plot, "control's estimate", {"c4", "thin"}, column_series(data, data.commands, "due_at_ns", "height_m"),
            kWideSlices);
  add_curve(plot, "truth", {"ink", "thick"}, column_series(data, data.truth, "exposed_at_ns", "height_m"), kWideSlices);
  add_curve(plot, "setpoint", {"c3", "thick dashed"},
            as_steps(column_series(data, data.commands, "due_at_ns", "height_setpoint_m")), kWideSlices);
  return svg_or_nothing(plot);
}

std::string height_error_figure(const ReportData& data) {
  Plot plot = narrow_plot("Height minus truth over time", "time [s]", "height minus truth [m]");
  plot.least_y_span = 0.04;
  const Series truth = column_series(data, data.truth, "exposed_at_ns", "height_m");
  int colour = 0;
  for (const auto& name : height_behaviours(data))
    add_curve(plot, name, {fmt::format("c{}", colour++ % 6), "thin"}, minus_truth(cue_heights(data, name), truth),
              kNarrowSlices);
  const Series estimate = column_series(data, data.commands, "due_at_ns", "height_m");
  add_curve(plot, "control's estimate", {"c4", "thin"}, minus_truth(estimate, truth), kNarrowSlices);
  return svg_or_nothing(plot);
}

std::string path_figure(const ReportData& data) {
  if (!data.truth || data.truth->rows() == 0) return {};
  Plot plot = narrow_plot("Ground track from above", "east [m]", "north [m]");
  plot.equal_axes = true;
  plot.least_y_span = 0.2;
  const Series path{data.truth->numbers("position_east_m"), data.truth->numbers("position_north_m")};
  const double size = std::max({range_of({&path.x}).span(), range_of({&path.y}).span(), 0.05});
  plot.curves.push_back({"truth", {"c0", "thin"}, thin_path(path, size / 600)});
  plot.marks = {{"start", path.x.front(), path.y.front()}, {"end", path.x.back(), path.y.back()}};
  return plot.svg();
}

std::string attitude_figure(const ReportData& data) {
  Plot plot = narrow_plot("Roll and pitch over time", "time [s]", "angle [deg]");
  plot.least_y_span = 1;
  add_curve(plot, "roll commanded", {"c0", "thin soft"}, angle_series(data, data.commands, "due_at_ns", Angle::kRoll),
            kNarrowSlices);
  add_curve(plot, "roll", {"c0", "medium"}, angle_series(data, data.attitude, "exposed_at_ns", Angle::kRoll),
            kNarrowSlices);
  add_curve(plot, "pitch commanded", {"c1", "thin soft"}, angle_series(data, data.commands, "due_at_ns", Angle::kPitch),
            kNarrowSlices);
  add_curve(plot, "pitch", {"c1", "medium"}, angle_series(data, data.attitude, "exposed_at_ns", Angle::kPitch),
            kNarrowSlices);
  return svg_or_nothing(plot);
}

std::string thrust_figure(const ReportData& data) {
  Plot plot = narrow_plot("Commanded thrust over time", "time [s]", "thrust [share of full]");
  plot.least_y_span = 0.1;
  add_curve(plot, "thrust", {"c2", "medium"}, column_series(data, data.commands, "due_at_ns", "thrust"), kNarrowSlices);
  return svg_or_nothing(plot);
}

}  // namespace wasp::tools
