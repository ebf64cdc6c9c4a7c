// Every depth frame through the estimator, timed; its plane against the frame's own fit.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "tools/eval_kernels.h"
#include "tools/eval_truth.h"
#include "vision/kernels/camera_model.h"
#include "vision/kernels/depth_plane.h"

namespace wasp::tools {
namespace {

constexpr Bar kDetection{1.0, true}, kHeightError_cm{1.0}, kNormalError_deg{1.0};

struct Tally {
  std::vector<double> rms_mm, height_cm, normal_deg, times_us;
  double frames = 0, found = 0;

  void add(const vision::PlaneEstimate& estimate, const PlaneTruth* truth) {
    frames += 1;
    if (!estimate.valid) return;
    found += 1;
    rms_mm.push_back(1000.0 * static_cast<double>(estimate.rms_m));
    if (truth == nullptr) return;
    const double cosine = static_cast<double>(estimate.normal_cam.dot(truth->normal_cam));
    height_cm.push_back(100.0 * std::abs(static_cast<double>(estimate.height_m - truth->height_m)));
    normal_deg.push_back(std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi);
  }
};

/// A recording that knows its mount narrows "up"; the others go by the estimator's default.
vision::GravityPrior prior_of(const drivers::Recording& recording) {
  vision::GravityPrior prior;
  if (recording.pitch_down()) prior.up_cam = vision::up_in_camera(recording.geometry(), {1.f, 0.f, 0.f, 0.f});
  return prior;
}

std::vector<Figure> figures_of(const Tally& tally, bool has_truth) {
  std::vector<Figure> figures{{"frames", tally.frames, ""}};
  figures.push_back(
      {"detection_rate", tally.found / tally.frames, "", has_truth ? std::optional(kDetection) : std::nullopt});
  add_spread(figures, "residual_rms", "mm", tally.rms_mm);
  if (has_truth) {
    add_spread(figures, "height_error", "cm", tally.height_cm, kHeightError_cm);
    add_spread(figures, "normal_error", "deg", tally.normal_deg, kNormalError_deg);
  }
  add_times(figures, tally.times_us);
  return figures;
}

}  // namespace

std::vector<Figure> eval_depth_plane(const drivers::Recording& recording, const EvalOptions& options) {
  const auto size = recording.depth_size();
  if (size.pixels() == 0) throw std::runtime_error(recording.folder().string() + ": no depth frames");
  const auto truth = read_plane_truth(recording.folder());
  std::vector<std::uint16_t> pixels(size.pixels());
  const DepthView view{pixels.data(), size.width_px, size.height_px, size.width_px};
  const vision::GravityPrior prior = prior_of(recording);
  vision::DepthPlaneState state;
  Tally tally;
  bool has_truth = false;
  for (int pass = 0; pass < options.repeat; ++pass)
    for (std::size_t i = 0; i < recording.entries().size(); ++i) {
      if (!recording.entries()[i].has_depth()) continue;
      recording.load_depth(i, pixels);
      if (options.cold) state.warm = false;
      const auto begin = std::chrono::steady_clock::now();
      const auto estimate = vision::estimate_floor({}, recording.intrinsics(), view, prior, state);
      const std::chrono::duration<double, std::micro> time = std::chrono::steady_clock::now() - begin;
      tally.times_us.push_back(time.count());
      const auto known = truth.find(frame_key(recording.entries()[i].depth_file));
      has_truth = has_truth || known != truth.end();
      tally.add(estimate, known != truth.end() ? &known->second : nullptr);
    }
  return figures_of(tally, has_truth);
}

}  // namespace wasp::tools
