#include "calibration/calibrate_delay.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "calibration/picture.h"

namespace wasp::calibration {
namespace {

constexpr std::array kColours = {"c0", "c1", "c2", "c3", "c4", "c5"};

TomlSection evidence_of(const DelayFit& fit, const TurnSource& source) {
  TomlSection t;
  t.number("delay_ms", 1e3 * fit.delay_s).number("delay_sigma_ms", 1e3 * fit.sigma_s, "the larger of the two below");
  t.number("curvature_sigma_ms", 1e3 * fit.curvature_sigma_s).number("jackknife_sigma_ms", 1e3 * fit.jackknife_sigma_s);
  t.number("likelihood", fit.likelihood, "natural logarithm, over no relation");
  t.number("lead", fit.lead, "over the best delay elsewhere");
  t.text("against", source.name());
  if (!fit.runs.empty()) {
    std::vector<double> delays_ms;
    for (const RunDelay& run : fit.runs) delays_ms.push_back(1e3 * run.delay_s);
    t.numbers("delay_alone_ms", delays_ms, "of each recording").number("discord", fit.discord, "likelihood they gain");
  }
  for (std::size_t a = 0; a < fit.axes.size(); ++a) {
    const AxisFit& axis = fit.axes[a];
    if (!axis.compared) continue;
    const std::string name = kChannelNames[a];
    t.number(name + "_correlation", axis.correlation, axis.used ? "" : "says nothing");
    if (std::isfinite(axis.scale)) t.number(name + "_scale", axis.scale, "image over sensor");
  }
  return t;
}

Picture profile_picture(const DelayFit& fit) {
  tools::Plot plot = labelled_plot("delay", "delay of the image [ms]", "log likelihood over no relation");
  tools::Curve curve{"", {"c0", "thick"}, {}};
  for (std::size_t i = 0; i < fit.profile.size(); ++i) curve.series.add(1e3 * fit.profile_delay_s[i], fit.profile[i]);
  plot.curves.push_back(curve);
  plot.marks.push_back({fmt::format("{:.1f} ms", 1e3 * fit.delay_s), 1e3 * fit.delay_s, fit.likelihood});
  return picture("profile", plot);
}

/// Images against sensor at the found delay, those channels that took part.
Picture residual_picture(const DelayFit& fit) {
  tools::Plot plot = labelled_plot("residuals", "time [s]", "image - sensor [1/s]");
  for (std::size_t a = 0; a < fit.axes.size(); ++a) {
    if (!fit.axes[a].used) continue;
    tools::Curve curve{kChannelNames[a], {kColours[a], "dots"}, {}};
    for (std::size_t i = 0; i < fit.time_s.size(); ++i)
      curve.series.add(fit.time_s[i], fit.image_radps[a][i] - fit.gyro_radps[a][i]);
    plot.curves.push_back(curve);
  }
  return picture("residuals", plot);
}

Picture rates_picture(const DelayFit& fit) {
  tools::Plot plot = labelled_plot("rates", "time [s]", "rate [1/s]");
  std::size_t best = 0;
  for (std::size_t a = 0; a < fit.axes.size(); ++a)
    if (fit.axes[a].used && fit.axes[a].correlation > fit.axes[best].correlation) best = a;
  tools::Curve image{std::string("image, ") + kChannelNames[best], {"c0", "dots"}, {}},
      sensor{"sensor at the delay", {"c1", "thin"}, {}};
  for (std::size_t i = 0; i < fit.image_radps[best].size(); ++i) {
    image.series.add(fit.time_s[i], fit.image_radps[best][i]);
    sensor.series.add(fit.time_s[i], fit.gyro_radps[best][i]);
  }
  plot.curves = {sensor, image};
  return picture("rates", plot);
}

Solution solution_of(const DelayFit& fit, const std::vector<DelayRun>& runs) {
  Solution out;
  const TurnSource& source = runs.front().source;
  out.flight.push_back(TomlSection("camera").number("delay_ms", 1e3 * fit.delay_s));
  out.evidence = evidence_of(fit, source);
  out.samples = fit.frames;
  out.residual_unit = "rad/s";
  double weight = 0;
  for (std::size_t a = 0; a < 3; ++a)
    if (fit.axes[a].used) out.residual_rms += fit.axes[a].residual_radps * fit.axes[a].residual_radps, weight += 1;
  if (weight > 0) out.residual_rms = std::sqrt(out.residual_rms / weight);
  if (!source.axes_known())
    out.notes.emplace_back(
        "the recording does not say how the sensor lies to the camera: all three of its axes were fitted to each of "
        "the image's");
  if (fit.delay_s < 0)
    out.notes.emplace_back("the images are stamped before they were exposed, or the sensor's stamps are late");
  out.pictures = {profile_picture(fit), rates_picture(fit), residual_picture(fit)};
  return out;
}

/// The recordings in a folder that holds nothing but several; else that folder itself.
std::vector<std::filesystem::path> recordings_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> inside;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string extension = entry.path().extension().string();
    if (entry.is_directory())
      inside.push_back(entry.path());
    else if (extension != ".md" && !extension.empty())
      return {folder};
  }
  std::sort(inside.begin(), inside.end());
  return inside.size() < 2 ? std::vector{folder} : inside;
}

/// One kind of sensor for all of them: a delay behind one is not that behind the other.
std::string against_of(const std::vector<drivers::Recording>& recordings, const std::string& asked) {
  const auto with_gyro = std::count_if(recordings.begin(), recordings.end(),
                                       [](const auto& recording) { return recording.motion().inertial.has_gyro; });
  const bool mixed = with_gyro > 0 && with_gyro < std::ssize(recordings);
  return asked == "best" && mixed ? "poses" : asked;
}

}  // namespace

TurnSource turn_source_of(const drivers::Recording& recording, const std::string& against) {
  const auto& motion = recording.motion();
  const bool gyro = motion.inertial.has_gyro && motion.inertial.samples.size() > 2,
             poses = motion.poses.samples.size() > 4;
  if (against != "poses" && gyro) return TurnSource::from_gyro(motion.inertial);
  if (against != "gyro" && poses) return TurnSource::from_poses(motion.poses);
  throw Refusal(fmt::format("{} ({} layout) holds no {} to hold the images against", recording.folder().string(),
                            recording.layout(), against == "best" ? "gyro and no true poses" : against));
}

Solution solve_delay(const DelayOptions& options, ProgressBar& bar) {
  std::vector<drivers::Recording> recordings;
  for (const auto& folder : options.folders)
    for (const auto& inside : recordings_in(folder)) recordings.push_back(drivers::Recording::open(inside));
  const std::string against = against_of(recordings, options.against);
  std::vector<DelayRun> runs;
  for (const auto& recording : recordings) {
    const auto done = static_cast<double>(runs.size()), all = static_cast<double>(recordings.size());
    auto turns =
        image_turns(recording, [&](double share) { bar.show(0.9 * (done + share) / all, "turns of the image"); });
    runs.push_back({std::move(turns), turn_source_of(recording, against)});
  }
  bar.show(0.9, "delay");
  const DelayFit fit = fit_delay(runs, options.fit);
  if (!fit.ok())
    throw Refusal(fit.refusal + fmt::format(" [best {:.1f} ms, sigma {:.1f} ms, {} pairs]", 1e3 * fit.delay_s,
                                            1e3 * fit.sigma_s, fit.frames));
  Solution solution = solution_of(fit, runs);
  for (const auto& recording : recordings) {
    solution.source += (solution.source.empty() ? "" : ", ") + recording.folder().string();
    for (const auto& note : recording.notes()) solution.notes.push_back(note);
  }
  return solution;
}

std::function<Solution(ProgressBar&)> prepare_delay(CLI::App& app) {
  auto options = std::make_shared<DelayOptions>();
  auto search_ms = std::make_shared<double>(1e3 * options->fit.search_s),
       sigma_ms = std::make_shared<double>(1e3 * options->fit.max_sigma_s);
  app.add_option("DIR", options->folders,
                 "recordings of one camera with grey images and a gyro or true poses (`wasp recording DIR`), or a "
                 "folder of such")
      ->required();
  app.add_option("--against", options->against, "what to hold the images against: the gyro if there is one, or")
      ->check(CLI::IsMember({"best", "gyro", "poses"}));
  app.add_option("--search-ms", *search_ms, "delays looked at, either way [ms]")->check(CLI::Range(20.0, 2000.0));
  app.add_option("--max-sigma-ms", *sigma_ms, "refuse an answer less certain than this [ms]")
      ->check(CLI::Range(0.05, 100.0));
  return [=](ProgressBar& bar) {
    options->fit.search_s = 1e-3 * *search_ms;
    options->fit.max_sigma_s = 1e-3 * *sigma_ms;
    return solve_delay(*options, bar);
  };
}

}  // namespace wasp::calibration
