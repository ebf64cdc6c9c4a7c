// Every grey frame through the edge kernels, timed; heights against the recording's own, up to one scale (lambda).
#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "tools/eval_kernels.h"
#include "tools/eval_truth.h"
#include "vision/kernels/camera_model.h"
#include "vision/kernels/edge_height.h"

namespace wasp::tools {
namespace {

constexpr Bar kRankCorrelation{0.6, true};
constexpr double kLeastHeightRange = 1.3;  // highest over lowest: below it a rank correlation says nothing

struct Tally {
  std::vector<double> height_m, truth_m, times_us;
  double frames = 0, found = 0;
};

/// rms of (scaled estimate - truth), the scale being the least-squares one.
double scaled_rms(const Tally& t) {
  double et = 0, ee = 0, sum = 0;
  for (std::size_t i = 0; i < t.height_m.size(); ++i) {
    et += t.height_m[i] * t.truth_m[i];
    ee += t.height_m[i] * t.height_m[i];
  }
  for (std::size_t i = 0; i < t.height_m.size(); ++i) {
    const double error = t.height_m[i] * et / ee - t.truth_m[i];
    sum += error * error;
  }
  return std::sqrt(sum / static_cast<double>(t.height_m.size()));
}

std::vector<Figure> figures_of(const Tally& tally) {
  std::vector<Figure> figures{{"frames", tally.frames, ""}, {"detection_rate", tally.found / tally.frames, ""}};
  if (tally.truth_m.size() >= 2) {
    const Spread truth = spread(tally.truth_m);
    const double lowest = *std::min_element(tally.truth_m.begin(), tally.truth_m.end());
    const bool varied = truth.max > kLeastHeightRange * lowest;
    figures.push_back({"rank_correlation", rank_correlation(tally.height_m, tally.truth_m), "",
                       varied ? std::optional(kRankCorrelation) : std::nullopt});
    figures.push_back({"height_rms_after_scale", scaled_rms(tally), "m"});
  }
  add_times(figures, tally.times_us);
  return figures;
}

}  // namespace

std::vector<Figure> eval_edge_height(const drivers::Recording& recording, const EvalOptions& options) {
  const auto size = recording.gray_size();
  if (size.pixels() == 0) throw std::runtime_error(recording.folder().string() + ": no grey frames");
  const auto truth = read_height_truth(recording.folder());
  std::vector<std::uint8_t> pixels(size.pixels());
  const GrayView view{pixels.data(), size.width_px, size.height_px, size.width_px};
  const Vec3 up_cam = vision::up_in_camera(recording.geometry(), {1.f, 0.f, 0.f, 0.f});
  const vision::EdgeHeightParams params{.max_height_m = 100.f};
  const auto kind = vision::suitable_kind(vision::suitable_model(params, recording.intrinsics(), up_cam));
  vision::EdgeRows rows;
  Tally tally;
  for (int pass = 0; pass < options.repeat; ++pass)
    for (std::size_t i = 0; i < recording.entries().size(); ++i) {
      if (!recording.entries()[i].has_gray()) continue;
      recording.load_gray(i, pixels);
      const auto begin = std::chrono::steady_clock::now();
      vision::count_edge_rows({.kind = kind}, view, {}, rows);
      const auto estimate = vision::estimate_edge_height(params, recording.intrinsics(), up_cam, rows);
      const std::chrono::duration<double, std::micro> time = std::chrono::steady_clock::now() - begin;
      tally.times_us.push_back(time.count());
      tally.frames += 1;
      tally.found += estimate.valid ? 1 : 0;
      const auto known = truth.find(frame_key(recording.entries()[i].gray_file));
      if (pass > 0 || known == truth.end() || !estimate.valid) continue;
      tally.height_m.push_back(static_cast<double>(estimate.height_m));
      tally.truth_m.push_back(static_cast<double>(known->second));
    }
  return figures_of(tally);
}

}  // namespace wasp::tools
