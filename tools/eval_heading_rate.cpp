// Successive frames of a downward camera (gaps of 1 and 2) through flow grid and similarity fit, and, beside it,
// through the thesis' log-polar maps. Truth from gt_per_frame.csv: image rotation = wz dt, so yaw (NED) = -wz dt;
// height ratio = exp(vz/h dt); rates by the trapezoid rule over the frames of the gap on the nominal frame grid (the
// table's own times jitter). Without a table the camera counts as still, and the truth is zero.
#include <chrono>
#include <cmath>
#include <numbers>

#include "tools/eval_kernels.h"
#include "tools/eval_motion.h"
#include "vision/kernels/heading_log_polar.h"

namespace wasp::tools {
namespace {

constexpr Bar kYaw{0.15, false}, kRatio{0.5, false};  // degrees per frame, per cent: medians
constexpr double kDegree = 180.0 / std::numbers::pi;

struct Truth {
  bool known = false;
  double yaw_rad = 0, log_ratio = 0;
};

Truth truth_between(const NumberTable& table, long from, long to, double rate_hz) {
  Truth truth;
  for (long k = from; k < to; ++k) {
    const auto a = table.find(k), b = table.find(k + 1);
    if (a == table.end() || b == table.end()) return {};
    const auto mean = [&](const char* column) { return 0.5 * (a->second.at(column) + b->second.at(column)); };
    truth.yaw_rad -= mean("wz_radps") / rate_hz;
    truth.log_ratio += mean("vz_over_h_1ps") / rate_hz;
  }
  truth.known = true;
  return truth;
}

struct Tally {
  std::vector<double> yaw_deg, ratio_percent, times_us;
  double pairs = 0, valid = 0;
};

/// `estimate(first, second)` gives the motion between two frames.
template <class Estimate>
Tally run(const std::vector<MotionFrame>& frames, const NumberTable& table, double rate_hz, std::size_t gap,
          const Estimate& estimate) {
  Tally tally;
  for (std::size_t i = 0; i + gap < frames.size(); ++i) {
    const MotionFrame &first = frames[i], &second = frames[i + gap];
    const auto begin = std::chrono::steady_clock::now();
    const vision::HeadingRate rate = estimate(first, second);
    tally.times_us.push_back(
        std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
    const Truth truth =
        table.empty() ? Truth{.known = true} : truth_between(table, first.number, second.number, rate_hz);
    tally.pairs += 1;
    tally.valid += rate.valid ? 1 : 0;
    if (!truth.known || !rate.valid) continue;
    tally.yaw_deg.push_back(std::abs(static_cast<double>(rate.yaw_rad) - truth.yaw_rad) * kDegree);
    tally.ratio_percent.push_back(std::abs(static_cast<double>(rate.height_ratio) / std::exp(truth.log_ratio) - 1.0) *
                                  100.0);
  }
  return tally;
}

void add_medians(std::vector<Figure>& figures, const Tally& tally, const std::string& suffix, bool barred) {
  const auto bar = [barred](const Bar& b) { return barred ? std::optional(b) : std::nullopt; };
  const Spread yaw = spread(tally.yaw_deg), ratio = spread(tally.ratio_percent);
  figures.push_back({"valid_share" + suffix, tally.valid / tally.pairs, ""});
  figures.push_back({"yaw_error_median" + suffix, yaw.median, "deg", bar(kYaw)});
  figures.push_back({"yaw_error_p95" + suffix, yaw.p95, "deg"});
  figures.push_back({"height_ratio_error_median" + suffix, ratio.median, "%", bar(kRatio)});
  figures.push_back({"height_ratio_error_p95" + suffix, ratio.p95, "%"});
}

}  // namespace

std::vector<Figure> eval_heading_rate(const drivers::Recording& recording, const EvalOptions&) {
  const auto frames = read_sequence(recording.folder());
  const NumberTable table = read_numbers(recording.folder() / "gt_per_frame.csv");
  std::vector<Figure> figures{{"frames", static_cast<double>(frames.size()), ""}};
  const int width = frames[0].width_px, height = frames[0].height_px;
  WindowFlow flow(width, height);
  const vision::SimilarityFitParams params{.centre_x_px = 0.5f * static_cast<float>(width - 1),
                                           .centre_y_px = 0.5f * static_cast<float>(height - 1)};
  const auto by_fit = [&](const MotionFrame& first, const MotionFrame& second) {
    return vision::heading_from_fit(vision::fit_similarity(params, flow.track(first, second, {0, 0, width, height})));
  };
  vision::HeadingLogPolar maps(width, height, width);
  const auto by_maps = [&](const MotionFrame& first, const MotionFrame& second) {
    maps.reset();
    (void)maps.step(first.view());
    return maps.step(second.view());
  };
  const double rate_hz = recording.nominal_rate_hz();
  const Tally one = run(frames, table, rate_hz, 1, by_fit);
  add_medians(figures, one, "", true);
  if (frames.size() > 2) add_medians(figures, run(frames, table, rate_hz, 2, by_fit), "_gap2", false);
  add_medians(figures, run(frames, table, rate_hz, 1, by_maps), "_log_polar", false);
  add_times(figures, one.times_us);
  return figures;
}

}  // namespace wasp::tools
