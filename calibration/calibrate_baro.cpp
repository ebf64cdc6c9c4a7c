#include "calibration/calibrate_baro.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <stdexcept>

#include "calibration/picture.h"
#include "calibration/robust_line.h"
#include "calibration/samples.h"
#include "tools/csv_table.h"
#include "tools/quantiles.h"

namespace wasp::calibration {
namespace {

using tools::CsvTable;

constexpr double kLeastSpan_m = 1.0;
constexpr double kMostSigma = 0.03;       ///< of the scale
constexpr double kMostResidual = 0.1;     ///< rms about the line, share of the span of heights
constexpr double kMostCorrelation = 0.9;  ///< of height and time, beyond which a drift is not looked for
constexpr double kLevel_m = 0.01;         ///< heights that agree so well are one level

struct Readings {
  std::vector<double> height_m, value, time_s;
  std::string unit, source;
};

/// The standard atmosphere near the ground, as the flight has it (control/barometer.cpp), in double.
double altitude_of(double pressure_hpa) { return 44330.77 * (1 - std::pow(pressure_hpa / 1013.25, 0.190263)); }

struct KnownColumn {
  const char* name;
  const char* unit;
  double factor;
};
constexpr KnownColumn kKnown[] = {
    {"pressure_hpa", "hPa", 1},   {"press_abs", "hPa", 1},      {"abs_pressure", "hPa", 1}, {"pressure_mbar", "hPa", 1},
    {"pressure_pa", "hPa", 0.01}, {"baro_counts", "counts", 1}, {"counts", "counts", 1},    {"adc", "counts", 1}};

/// The column of the readings: its name, unit and factor to that unit.
KnownColumn column_of(const CsvTable& table, const std::string& file, const BaroOptions& o) {
  if (!o.reading_column.empty()) {
    if (!table.column(o.reading_column)) throw std::runtime_error(file + ": no column '" + o.reading_column + "'");
    return {o.reading_column.c_str(), o.unit.empty() ? "counts" : o.unit.c_str(), 1};
  }
  for (const KnownColumn& known : kKnown)
    if (table.column(known.name)) return known;
  throw std::runtime_error(file + ": no column of pressure known by name; give --column and --unit");
}

CsvTable open(const std::string& file) {
  auto table = CsvTable::read(file);
  if (!table) throw std::runtime_error(file + ": cannot be read, or has no line of column names");
  return *std::move(table);
}

std::vector<double> times_in(const CsvTable& table) {
  if (table.column("t_s")) return table.numbers("t_s");
  if (table.column("time_s")) return table.numbers("time_s");
  std::vector<double> seconds = table.numbers("exposed_at_ns");
  for (double& t : seconds) t *= 1e-9;
  return seconds;
}

void add_table(const BaroOptions& o, Readings& r) {
  const CsvTable table = open(o.table);
  if (!table.column(o.height_column)) throw std::runtime_error(o.table + ": no column '" + o.height_column + "'");
  const KnownColumn column = column_of(table, o.table, o);
  const auto heights = table.numbers(o.height_column), values = table.numbers(column.name), times = times_in(table);
  for (std::size_t i = 0; i < table.rows(); ++i)
    if (std::isfinite(heights[i]) && std::isfinite(values[i])) {
      r.height_m.push_back(heights[i]);
      r.value.push_back(values[i] * column.factor);
      r.time_s.push_back(times[i]);
    }
  r.unit = column.unit;
  r.source = fmt::format("{}: {} over {}", o.table, column.name, o.height_column);
}

/// "HEIGHT,RECORDING".
void add_recording(const std::string& text, const BaroOptions& o, Readings& r) {
  const std::size_t comma = text.find(',');
  if (comma == std::string::npos) throw std::runtime_error("--at '" + text + "': wants HEIGHT_M,RECORDING");
  const double height_m = std::stod(text.substr(0, comma));
  const std::string file = imu_csv_in(text.substr(comma + 1)).string();
  const CsvTable table = open(file);
  const KnownColumn column = column_of(table, file, o);
  const auto values = table.numbers(column.name), times = times_in(table);
  for (std::size_t i = 0; i < table.rows(); ++i)
    if (std::isfinite(values[i]) && values[i] != 0) {
      r.height_m.push_back(height_m);
      r.value.push_back(values[i] * column.factor);
      r.time_s.push_back(times[i]);
    }
  r.unit = column.unit;
  r.source += (r.source.empty() ? "" : "; ") + file + fmt::format(" at {} m", height_m);
}

/// One level of equal heights: the median and its deviation. A visit that is later is another level.
std::vector<BaroLevel> levels_of(const Readings& r) {
  std::vector<BaroLevel> levels;
  for (std::size_t i = 0; i < r.height_m.size();) {
    std::vector<double> values, deviations;
    double time_s = 0;
    const std::size_t first = i;
    for (; i < r.height_m.size() && std::fabs(r.height_m[i] - r.height_m[first]) < kLevel_m; ++i) {
      values.push_back(r.unit == "hPa" ? altitude_of(r.value[i]) : r.value[i]);
      time_s += r.time_s[i];
    }
    const double middle = tools::median(values);
    for (const double v : values) deviations.push_back(std::fabs(v - middle));
    const auto n = static_cast<double>(values.size());
    levels.push_back({r.height_m[first], middle,
                      values.size() > 4 ? 1.2533 * 1.4826 * tools::median(deviations) / std::sqrt(n) : 0.0, time_s / n,
                      values.size()});
  }
  return levels;
}

/// Are the times known, and apart enough from the heights to tell a drift of the weather from them?
bool drift_determined(const std::vector<BaroLevel>& levels) {
  if (levels.size() < 5) return false;
  double mh = 0, mt = 0, hh = 0, tt = 0, ht = 0;
  for (const auto& l : levels) mh += l.height_m, mt += l.time_s;
  mh /= static_cast<double>(levels.size()), mt /= static_cast<double>(levels.size());
  for (const auto& l : levels) {
    const double h = l.height_m - mh, t = l.time_s - mt;
    hh += h * h, tt += t * t, ht += h * t;
  }
  return std::isfinite(tt) && tt > 1 && std::fabs(ht) < kMostCorrelation * std::sqrt(hh * tt);
}

double span_of(const std::vector<BaroLevel>& levels) {
  const auto [low, high] = std::minmax_element(levels.begin(), levels.end(),
                                               [](const auto& a, const auto& b) { return a.height_m < b.height_m; });
  return high->height_m - low->height_m;
}

void check_levels(const std::vector<BaroLevel>& levels) {
  std::vector<double> heights;
  for (const auto& l : levels)
    if (std::none_of(heights.begin(), heights.end(), [&](double h) { return std::fabs(h - l.height_m) < kLevel_m; }))
      heights.push_back(l.height_m);
  if (heights.size() < 3)
    throw Refusal(fmt::format("readings at {} different heights; three are the least", heights.size()));
  if (span_of(levels) < kLeastSpan_m)
    throw Refusal(fmt::format("the heights span {:.2g} m, {:.2g} m are the least: a barometer's noise is as large",
                              span_of(levels), kLeastSpan_m));
}

void check_line(const RobustLine& line, const std::vector<BaroLevel>& levels, const std::string& unit) {
  const double share = line.slope_sigma / std::fabs(line.slope);
  if (!(share <= kMostSigma))
    throw Refusal(
        fmt::format("the scale is known to {:.2g} % (one standard deviation), {:.2g} % are allowed: heights "
                    "further apart than these {:.3g} m, or more of them",
                    100 * share, 100 * kMostSigma, span_of(levels)));
  if (line.used_count * 10 < levels.size() * 6)
    throw Refusal(fmt::format("only {} of {} levels agree on one line", line.used_count, levels.size()));
  const double off = line.residual_rms / std::fabs(line.slope) / span_of(levels);
  if (off > kMostResidual) throw Refusal(fmt::format("the levels lie {:.2g} % of their span off a line", 100 * off));
  if (unit == "hPa" && (line.slope < 0.2 || line.slope > 5))
    throw Refusal(
        fmt::format("altitude by pressure changes {:.3g} m a metre: wrong unit or wrong heights", line.slope));
}

Picture picture_of(const std::vector<BaroLevel>& levels, const RobustLine& line, double t0) {
  tools::Plot plot = labelled_plot("residuals", "known height [m]", "height by the line - known [m]");
  tools::Curve used{"levels", {"c0", "dots"}, {}}, out{"outliers", {"c3", "dots"}, {}};
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const LinePoint p{levels[i].height_m, levels[i].reading, levels[i].time_s - t0};
    (line.used[i] ? used : out).series.add(p.x, (p.y - line.at(p)) / line.slope);
  }
  plot.curves.push_back(used);
  if (out.series.size() > 0) plot.curves.push_back(out);
  return picture("residuals", plot);
}

TomlSection evidence_of(const RobustLine& line, const std::vector<BaroLevel>& levels, const Readings& r, bool drift) {
  const double slope = line.slope;
  TomlSection t;
  t.text("unit", r.unit).whole("levels", static_cast<long long>(levels.size()));
  t.number("span_m", span_of(levels));
  t.number("metres_per_unit", 1 / slope, r.unit == "hPa" ? "of standard-atmosphere altitude" : "per count");
  t.number("metres_per_unit_sigma", line.slope_sigma / (slope * slope));
  t.number("reading_at_zero", line.offset, r.unit == "hPa" ? "m of standard-atmosphere altitude" : "counts");
  t.number("reading_at_zero_sigma", line.offset_sigma);
  t.flag("drift_fitted", drift);
  if (drift)
    t.number("drift_m_per_h", 3600 * line.drift / slope)
        .number("drift_m_per_h_sigma", 3600 * line.drift_sigma / std::fabs(slope));
  t.whole("outliers", static_cast<long long>(levels.size() - line.used_count));
  return t;
}

}  // namespace

Solution solve_baro(const BaroOptions& o, ProgressBar& bar) {
  bar.show(0, "reading");
  Readings r;
  if (!o.table.empty()) add_table(o, r);
  for (std::size_t i = 0; i < o.at.size(); ++i) {
    bar.show(0.8 * static_cast<double>(i) / static_cast<double>(o.at.size()), o.at[i]);
    add_recording(o.at[i], o, r);
  }
  if (r.value.empty()) throw std::runtime_error("no readings: give a table or --at HEIGHT_M,RECORDING");
  const std::vector<BaroLevel> levels = levels_of(r);
  check_levels(levels);
  const bool drift = drift_determined(levels);
  const double t0 = drift ? levels.front().time_s : 0;
  std::vector<LinePoint> points;
  double noise = 0;
  for (const auto& l : levels) {
    points.push_back({l.height_m, l.reading, drift ? l.time_s - t0 : 0});
    noise = std::max(noise, l.sigma);
  }
  bar.show(0.9, "fitting");
  const RobustLine line = fit_line(points, drift, noise);
  check_line(line, levels, r.unit);
  Solution out;
  if (r.unit == "hPa")
    out.flight.push_back(TomlSection("imu")
                             .number("pressure_scale", 1 / line.slope)
                             .number("pressure_neutral_hpa", tools::median(r.value)));
  else
    out.notes.push_back(
        "the readings are in counts: a flight, which gets hPa from its autopilot, has no use for these values");
  out.evidence = evidence_of(line, levels, r, drift);
  out.source = r.source;
  out.samples = r.value.size();
  out.residual_rms = line.residual_rms / std::fabs(line.slope);
  out.residual_unit = "m, levels about the line";
  out.pictures = {picture_of(levels, line, t0)};
  return out;
}

std::function<Solution(ProgressBar&)> prepare_baro(CLI::App& app) {
  auto o = std::make_shared<BaroOptions>();
  app.add_option("TABLE", o->table, "CSV with a column of known heights and one of readings");
  app.add_option("--at", o->at, "HEIGHT_M,RECORDING: a folder or imu.csv recorded at that height; three or more");
  app.add_option("--height-column", o->height_column, "of the table [m]");
  app.add_option("--column", o->reading_column,
                 "of the readings; default: known by name (pressure_hpa, baro_counts, ...)");
  app.add_option("--unit", o->unit, "of --column")->check(CLI::IsMember({"hPa", "counts"}));
  return [o](ProgressBar& bar) { return solve_baro(*o, bar); };
}

}  // namespace wasp::calibration
