#include "calibration/calibrate_gyro.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "calibration/picture.h"
#include "calibration/rest_periods.h"
#include "calibration/robust_line.h"

namespace wasp::calibration {
namespace {

using Eigen::Vector3d;

constexpr double kLeastSpan_radps = 0.5;  ///< between the greatest and least rate of an axis, rest included
constexpr double kMostSigma = 0.01;       ///< of a scale
constexpr double kMostBend = 0.02;        ///< residual of the line, share of its span of rates
constexpr double kMostBias_radps = 0.35;  ///< 20 degrees a second: no gyroscope at rest reads that
constexpr double kLeastSpan_degc = 5;
constexpr std::array kAxes = {"x", "y", "z"};

struct Steady {
  Vector3d mean, sigma_of_mean;  ///< sample unit
  double temperature_degc = 0;
  std::size_t count = 0;
};

/// The longest stretch of constant rate. `typical` as for find_rests.
Steady longest_steady(const Samples& s, double typical, const std::string& what) {
  const auto periods = find_rests(s, {}, typical);
  const auto longest =
      std::max_element(periods.begin(), periods.end(), [](const auto& a, const auto& b) { return a.count < b.count; });
  if (longest == periods.end())
    throw Refusal(fmt::format("{}: no half second of constant rate in {} samples", what, s.size()));
  return {longest->mean, longest->sigma_of_mean, longest->temperature_degc, longest->count};
}

/// Everything at rest: what it reads, and how that drifts with temperature.
struct Rest {
  Vector3d bias, sigma, slope = Vector3d::Zero(), slope_sigma = Vector3d::Zero();
  Vector3d noise;  ///< standard deviation of a sample
  double at_degc = 0;
  bool warmth = false;
  std::vector<RestPeriod> windows;
  std::size_t count = 0;
};

/// Rests cut into pieces of a window's length: the scatter of their means shows what white noise does not.
std::vector<RestPeriod> pieces_of(const Samples& s, const std::vector<RestPeriod>& rests) {
  const double rate = s.rate_hz();
  const auto length = static_cast<std::size_t>(rate > 0 ? std::max(10.0, std::ceil(rate)) : 40);
  std::vector<RestPeriod> out;
  for (const RestPeriod& rest : rests)
    for (std::size_t first = rest.first; first + length <= rest.first + rest.count; first += length) {
      const RobustMoments m = robust_moments(s.values, first, length);
      RestPeriod p{first, length, m.mean, m.sigma / std::sqrt(static_cast<double>(length)), 0};
      for (std::size_t i = first; i < first + length && !s.temperature_degc.empty(); ++i)
        p.temperature_degc += s.temperature_degc[i] / static_cast<double>(length);
      out.push_back(p);
    }
  return out.empty() ? rests : out;
}

/// Bias per axis as a line over temperature where that changed, else as the mean.
void fit_bias(Rest& r) {
  const auto [low, high] = std::minmax_element(r.windows.begin(), r.windows.end(), [](const auto& a, const auto& b) {
    return a.temperature_degc < b.temperature_degc;
  });
  r.warmth = r.windows.size() >= 6 && high->temperature_degc - low->temperature_degc >= kLeastSpan_degc;
  for (const auto& w : r.windows) r.at_degc += w.temperature_degc / static_cast<double>(r.windows.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<LinePoint> points;
    double white = 0;
    for (const auto& w : r.windows) {
      points.push_back({r.warmth ? w.temperature_degc - r.at_degc : 0.0, w.mean[axis]});
      white = std::max(white, w.sigma_of_mean[axis]);
    }
    if (points.size() < 3) {
      r.bias[axis] = points[0].y, r.sigma[axis] = white;
      continue;
    }
    const RobustLine line = fit_line(points, false, white);
    r.bias[axis] = line.offset, r.sigma[axis] = line.offset_sigma;
    if (r.warmth) r.slope[axis] = line.slope, r.slope_sigma[axis] = line.slope_sigma;
  }
}

Rest rest_of(const Samples& s, double typical, std::optional<double> to_flight) {
  Rest r;
  const auto rests = find_rests(s, {}, typical);
  if (rests.empty())
    throw Refusal(
        fmt::format("no half second of rest in {} samples: put the sensor down and leave it alone", s.size()));
  for (const auto& rest : rests) r.count += rest.count;
  r.windows = pieces_of(s, rests);
  std::vector<double> noise[3];
  for (const auto& w : r.windows)
    for (int axis = 0; axis < 3; ++axis)
      noise[axis].push_back(w.sigma_of_mean[axis] * std::sqrt(static_cast<double>(w.count)));
  for (int axis = 0; axis < 3; ++axis) {
    std::nth_element(noise[axis].begin(), noise[axis].begin() + static_cast<std::ptrdiff_t>(noise[axis].size() / 2),
                     noise[axis].end());
    r.noise[axis] = noise[axis][noise[axis].size() / 2];
  }
  fit_bias(r);
  if (to_flight && r.bias.cwiseAbs().maxCoeff() * *to_flight > kMostBias_radps)
    throw Refusal(fmt::format("reads {:.3g} rad/s at rest, {:.3g} is the most a bias may be: it was turning",
                              r.bias.cwiseAbs().maxCoeff() * *to_flight, kMostBias_radps));
  return r;
}

/// A line through rest and the turns about one axis.
struct AxisScale {
  RobustLine line;
  double span_radps = 0;
  double tilt = 0;  ///< what the other two axes read, share of this one: mount and cross-axis together
};

AxisScale scale_of(int axis, const std::vector<GyroTurn>& turns, const std::vector<Steady>& readings,
                   const Rest& rest) {
  AxisScale out;
  std::vector<LinePoint> points{{0, rest.bias[axis]}};
  double low = 0, high = 0, white = rest.sigma[axis];
  for (std::size_t i = 0; i < turns.size(); ++i) {
    if (turns[i].axis != axis) continue;
    const Vector3d drift =
        rest.warmth ? Vector3d(rest.slope * (readings[i].temperature_degc - rest.at_degc)) : Vector3d::Zero();
    points.push_back({turns[i].rate_radps, readings[i].mean[axis] - drift[axis]});
    low = std::min(low, turns[i].rate_radps), high = std::max(high, turns[i].rate_radps);
    white = std::max(white, readings[i].sigma_of_mean[axis]);
    Vector3d others = readings[i].mean - rest.bias - drift;
    const double own = others[axis];
    others[axis] = 0;
    out.tilt = std::max(out.tilt, others.norm() / std::max(std::fabs(own), 1e-12));
  }
  out.span_radps = high - low;
  if (out.span_radps < kLeastSpan_radps)
    throw Refusal(
        fmt::format("axis {}: the rates {:.3g} ... {:.3g} rad/s are too close to each other and to rest "
                    "({:.3g} apart are the least)",
                    kAxes[axis], low, high, kLeastSpan_radps));
  if (points.size() < 3)
    throw Refusal(
        fmt::format("axis {}: one direction and rest leave no check; turn it the other way as well", kAxes[axis]));
  out.line = fit_line(points, false, white);
  return out;
}

void check_scale(int axis, const AxisScale& a, std::optional<double> to_flight) {
  const RobustLine& line = a.line;
  const double bend = line.residual_rms / std::max(std::fabs(line.slope) * a.span_radps, 1e-300);
  if (bend > kMostBend)
    throw Refusal(
        fmt::format("axis {}: rest and turns lie {:.2g} % of the span off a line ({:.2g} % are allowed): a rate "
                    "is wrong, or the gyroscope saturates",
                    kAxes[axis], 100 * bend, 100 * kMostBend));
  const double share = line.slope_sigma / std::fabs(line.slope);
  if (!(share <= kMostSigma))
    throw Refusal(fmt::format("axis {}: the scale is known to {:.2g} % (one standard deviation), {:.2g} % are allowed",
                              kAxes[axis], 100 * share, 100 * kMostSigma));
  const double flight_scale = to_flight ? line.slope * *to_flight : 1.0;
  if (flight_scale < 0.5 || flight_scale > 2)
    throw Refusal(fmt::format("axis {}: reads {:.3g} times the rate it was turned with: wrong axis, sign or unit",
                              kAxes[axis], flight_scale));
}

TomlSection flight_section(const Rest& rest, const std::array<std::optional<AxisScale>, 3>& scales, double to_flight) {
  TomlSection t("imu");
  const auto list = [](const Vector3d& v) { return std::vector<double>{v.x(), v.y(), v.z()}; };
  t.numbers("gyro_neutral_radps", list(rest.bias * to_flight));
  std::vector<double> matrix(9, 0.0);
  for (std::size_t i = 0; i < 3; ++i) matrix[4 * i] = scales[i] ? 1 / (scales[i]->line.slope * to_flight) : 1.0;
  t.numbers("gyro_matrix", matrix, "row by row");
  if (rest.warmth)
    t.numbers("gyro_neutral_per_degc", list(rest.slope * to_flight)).number("gyro_at_degc", rest.at_degc);
  return t;
}

TomlSection evidence_of(const Samples& s, const Rest& rest, const std::array<std::optional<AxisScale>, 3>& scales) {
  const auto list = [](const Vector3d& v) { return std::vector<double>{v.x(), v.y(), v.z()}; };
  TomlSection t;
  t.text("unit", s.unit);
  t.numbers("bias", list(rest.bias), s.unit).numbers("bias_sigma", list(rest.sigma));
  if (rest.warmth)
    t.numbers("bias_per_degc", list(rest.slope))
        .numbers("bias_per_degc_sigma", list(rest.slope_sigma))
        .number("at_degc", rest.at_degc);
  t.numbers("noise", list(rest.noise), "standard deviation of a sample");
  t.whole("rest_samples", static_cast<long long>(rest.count)).whole("rows_dropped", static_cast<long long>(s.dropped));
  for (std::size_t i = 0; i < 3; ++i) {
    if (!scales[i]) continue;
    const std::string axis = kAxes[i];
    t.number("scale_" + axis, 1 / scales[i]->line.slope, "rad/s per " + s.unit);
    t.number("scale_" + axis + "_sigma", scales[i]->line.slope_sigma / (scales[i]->line.slope * scales[i]->line.slope));
    t.number("line_bias_" + axis, scales[i]->line.offset, "of the three-point line; bias is that of the rest alone");
    t.number("rate_span_" + axis + "_radps", scales[i]->span_radps);
    t.number("tilt_" + axis, scales[i]->tilt, "most that the other axes read, share of this one (rad, about)");
  }
  return t;
}

/// Means of pieces of the rest over time, bias taken off; and the turns about their lines.
std::vector<Picture> pictures_of(const Samples& s, const Rest& rest, const std::vector<GyroTurn>& turns,
                                 const std::vector<Steady>& readings,
                                 const std::array<std::optional<AxisScale>, 3>& scales) {
  tools::Plot still = labelled_plot("rest", "second of rest", fmt::format("reading - bias [{}]", s.unit));
  tools::Plot bend = labelled_plot("turns", "rate [rad/s]", fmt::format("reading - line [{}]", s.unit));
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    tools::Curve curve{kAxes[i], {fmt::format("c{}", axis), "dots"}, {}}, line = curve;
    double x = 0;
    for (const auto& w : rest.windows) {
      const double bias =
          rest.bias[axis] + (rest.warmth ? rest.slope[axis] * (w.temperature_degc - rest.at_degc) : 0.0);
      curve.series.add(x++, w.mean[axis] - bias);
    }
    still.curves.push_back(curve);
    if (!scales[i]) continue;
    line.series.add(0, rest.bias[axis] - scales[i]->line.offset);
    for (std::size_t k = 0; k < turns.size(); ++k)
      if (turns[k].axis == axis)
        line.series.add(turns[k].rate_radps, readings[k].mean[axis] - scales[i]->line.at({turns[k].rate_radps, 0}));
    bend.curves.push_back(line);
  }
  std::vector<Picture> out{picture("rest", still)};
  if (!bend.curves.empty()) out.push_back(picture("turns", bend));
  return out;
}

}  // namespace

GyroTurn parse_turn(const std::string& text) {
  const std::size_t first = text.find(','), second = text.find(',', first == std::string::npos ? first : first + 1);
  if (second == std::string::npos) throw std::runtime_error("--turn '" + text + "': wants AXIS,RATE,FILE");
  const std::string axis = text.substr(0, first), rate = text.substr(first + 1, second - first - 1);
  GyroTurn turn{0, 0, text.substr(second + 1)};
  const auto found = std::find(kAxes.begin(), kAxes.end(), axis);
  if (found == kAxes.end()) throw std::runtime_error("--turn '" + text + "': the axis is x, y or z");
  turn.axis = static_cast<int>(found - kAxes.begin());
  const char* begin = rate.data() + (rate.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(begin, rate.data() + rate.size(), turn.rate_radps);
  const std::string unit(end, static_cast<std::size_t>(rate.data() + rate.size() - end));
  constexpr double kTurn = 2 * std::numbers::pi;
  const double factor = unit == "rpm" ? kTurn / 60 : unit == "degps" ? kTurn / 360 : unit == "radps" ? 1 : 0;
  if (error != std::errc{} || factor == 0 || turn.rate_radps == 0)
    throw std::runtime_error("--turn '" + text + "': the rate is a number and rpm, degps or radps, not zero");
  turn.rate_radps *= factor;
  return turn;
}

Solution solve_gyro(const GyroOptions& o, ProgressBar& bar) {
  std::vector<GyroTurn> turns;
  for (const auto& text : o.turns) turns.push_back(parse_turn(text));
  bar.show(0, "reading the rest");
  const Samples s = read_samples(o.samples, Sensor::kGyro);
  const auto to_flight = to_flight_unit(s.unit);
  std::vector<Samples> turned;
  for (const GyroTurn& turn : turns) {
    bar.show(0.5 * static_cast<double>(turned.size() + 1) / static_cast<double>(turns.size() + 1),
             "reading " + turn.file);
    SampleOptions other = o.samples;
    other.source = turn.file;
    turned.push_back(read_samples(other, Sensor::kGyro));
  }
  // Counts say nothing of their size: what the turns read does.
  double size = to_flight ? 1 / *to_flight : 0;
  for (const Samples& t : turned)
    if (!to_flight) size = std::max(size, (robust_moments(t.values, 0, t.size()).mean - s.values[0]).norm());
  if (!to_flight && turned.empty())
    throw Refusal("counts at rest alone give no scale to judge rest by; give --turn or --unit");
  const Rest rest = rest_of(s, size, to_flight);
  std::vector<Steady> readings;
  for (std::size_t i = 0; i < turns.size(); ++i) readings.push_back(longest_steady(turned[i], size, turns[i].file));
  std::array<std::optional<AxisScale>, 3> scales;
  double worst = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::none_of(turns.begin(), turns.end(), [&](const auto& t) { return t.axis == axis; })) continue;
    auto& scale = scales[static_cast<std::size_t>(axis)];
    scale = scale_of(axis, turns, readings, rest);
    check_scale(axis, *scale, to_flight);
    worst = std::max(worst, scale->line.residual_rms);
  }
  Solution out;
  if (to_flight)
    out.flight.push_back(flight_section(rest, scales, *to_flight));
  else
    out.notes.push_back(
        "the samples are in counts: a flight, which gets rad/s from its autopilot, has no use for these values");
  if (turns.empty()) out.notes.push_back("rest alone: biases; the scales stay 1");
  out.evidence = evidence_of(s, rest, scales);
  out.source = s.source;
  out.samples = rest.count;
  for (const Steady& r : readings) out.samples += r.count;
  out.residual_rms = turns.empty() ? rest.noise.norm() / std::sqrt(3.0) : worst;
  out.residual_unit = s.unit + (turns.empty() ? ", a sample of rest about the bias" : ", worst axis about its line");
  out.pictures = pictures_of(s, rest, turns, readings, scales);
  return out;
}

std::function<Solution(ProgressBar&)> prepare_gyro(CLI::App& app) {
  auto o = std::make_shared<GyroOptions>();
  add_sample_options(app, o->samples, {"rad/s", "deg/s", "mrad/s", "counts"});
  app.add_option(
      "--turn", o->turns,
      "AXIS,RATE,FILE: turned about x, y or z at RATE (33.33rpm, -200degps, 3.49radps; right-handed), twice an "
      "axis, in both directions. SOURCE is the rest");
  return [o](ProgressBar& bar) { return solve_gyro(*o, bar); };
}

}  // namespace wasp::calibration
