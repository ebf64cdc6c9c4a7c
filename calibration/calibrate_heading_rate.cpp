#include "calibration/calibrate_heading_rate.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include <cmath>
#include <memory>
#include <numbers>

#include "calibration/calibrate_delay.h"
#include "calibration/picture.h"

namespace wasp::calibration {
namespace {

constexpr double kLooksDown_rad = 1.31;  ///< 75 degrees

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

/// The delay that was given, or that of the turns about the optical axis.
double delay_s(const HeadingRateOptions& options, const drivers::Recording& recording, const TurnSource& source,
               ProgressBar& bar) {
  if (options.delay_ms) return 1e-3 * *options.delay_ms;
  const auto turns = image_turns(recording, [&](double share) { bar.show(0.5 * share, "delay of the camera"); });
  DelayParams params;
  params.max_sigma_s = 0.01;  // of a slow turn 10 ms change little
  const DelayRun run{turns, source};
  const DelayFit fit = fit_delay({&run, 1}, params, {false, false, true, false, false, false});
  if (!fit.ok())
    throw Refusal("the camera's delay is not known (give --delay-ms) and this run does not tell it: " + fit.refusal);
  return fit.delay_s;
}

Picture rates_picture(const HeadingScale& h) {
  tools::Plot plot = labelled_plot("yaw rate", "time [s]", "yaw rate [deg/s]");
  tools::Curve known{"sensor", {"c1", "thin"}, {}}, seen{"image, scaled", {"c0", "dots"}, {}};
  for (std::size_t i = 0; i < h.time_s.size(); ++i) {
    known.series.add(h.time_s[i], degrees(h.known_radps[i] - h.bias_radps));
    seen.series.add(h.time_s[i], degrees(h.scale * h.seen_radps[i]));
  }
  plot.curves = {known, seen};
  return picture("rates", plot);
}

Picture residual_picture(const HeadingScale& h) {
  tools::Plot plot = labelled_plot("residuals", "yaw rate seen [deg/s]", "sensor - scaled image [deg/s]");
  tools::Curve dots{"", {"c0", "dots"}, {}};
  for (std::size_t i = 0; i < h.seen_radps.size(); ++i)
    dots.series.add(degrees(h.seen_radps[i]), degrees(h.residuals_radps[i]));
  plot.curves = {dots};
  return picture("residuals", plot);
}

Solution solution_of(const HeadingScale& h, const TurnSource& source, double delay_ms, const std::string& folder) {
  Solution out;
  out.flight.push_back(TomlSection("behaviour.heading_rate").number("scale", h.scale));
  out.evidence.number("scale", h.scale, "true over seen turn").number("scale_sigma", h.sigma);
  out.evidence.number("scale_low", h.low, "slope if all noise were the sensor's")
      .number("scale_high", h.high, "the image's");
  out.evidence.number("gyro_bias_radps", h.bias_radps).number("correlation", h.correlation);
  out.evidence.number("yaw_rate_rms_radps", h.rms_radps).number("valid_share", h.valid_share);
  out.evidence.whole("outliers", static_cast<long long>(h.outliers)).number("camera_delay_ms", delay_ms);
  out.evidence.text("against", source.name());
  out.source = folder;
  out.samples = h.pairs - h.outliers;
  out.residual_rms = h.residual_radps;
  out.residual_unit = "rad/s";
  out.pictures = {rates_picture(h), residual_picture(h)};
  return out;
}

}  // namespace

Solution solve_heading_rate(const HeadingRateOptions& options, ProgressBar& bar) {
  const auto recording = drivers::Recording::open(options.folder);
  if (!recording.pitch_down() || recording.pitch_down()->value < kLooksDown_rad)
    throw Refusal(
        fmt::format("{}: its camera is not known to look down (camera.toml: pitch_down_deg = 90)", options.folder));
  const TurnSource source = turn_source_of(recording, options.against);
  if (!source.axes_known()) throw Refusal("the recording does not say how the gyro lies to the camera");
  const double delay = delay_s(options, recording, source, bar);
  bar.show(0.5, "yaw of the image");
  const HeadingScale h = fit_heading_scale(seen_yaw(recording, frame_stamps(recording)), source, delay, options.fit);
  if (!h.ok()) throw Refusal(h.refusal);
  return solution_of(h, source, 1e3 * delay, options.folder);
}

std::function<Solution(ProgressBar&)> prepare_heading_rate(CLI::App& app) {
  auto options = std::make_shared<HeadingRateOptions>();
  app.add_option("DIR", options->folder,
                 "recording of a camera that looks down, turning both ways, and a gyro or true poses")
      ->required();
  app.add_option("--against", options->against, "what to hold the images against: the gyro if there is one, or")
      ->check(CLI::IsMember({"best", "gyro", "poses"}));
  app.add_option("--delay-ms", options->delay_ms,
                 "delay of the camera (`wasp calibrate delay`); found first if not given")
      ->check(CLI::Range(-500.0, 500.0));
  return [=](ProgressBar& bar) { return solve_heading_rate(*options, bar); };
}

}  // namespace wasp::calibration
