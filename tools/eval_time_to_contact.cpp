// Time to contact from the scale of the similarity fit over 5, 7 and 10 frames. Truth: ttc.csv (range and box of the
// car ahead: the flow is taken inside the box), or gt_per_frame.csv (a floor below). Two truths, for what moves does
// not move uniformly: "window", from the approach made within the window (same frames, same formula, range for scale),
// and "now", range over closing speed at the newest frame, which holds the lag of half a window too. Without a table
// the camera counts as still and every valid estimate is a false alarm.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "tools/eval_kernels.h"
#include "tools/eval_motion.h"
#include "vision/kernels/time_to_contact.h"

namespace wasp::tools {
namespace {

constexpr Bar kError{15.0, false};  // per cent, median
constexpr Bar kNoFalseAlarm{0.0, false};

/// What the folder says about contact: frames to contact at a frame, and where to look.
struct Contact {
  NumberTable car, floor;
  double rate_hz = 0;

  [[nodiscard]] bool none() const { return car.empty() && floor.empty(); }

  [[nodiscard]] std::optional<double> frames_at(long frame) const {
    if (const auto row = car.find(frame); row != car.end()) return row->second.at("ttc_frames");
    if (const auto row = floor.find(frame); row != floor.end() && row->second.at("vz_over_h_1ps") < 0)
      return -rate_hz / row->second.at("vz_over_h_1ps");
    return std::nullopt;
  }
  /// ln(range at `from` / range at `to`).
  [[nodiscard]] std::optional<double> approach(long from, long to) const {
    if (const auto a = car.find(from), b = car.find(to); a != car.end() && b != car.end())
      return std::log(a->second.at("range_m") / b->second.at("range_m"));
    double sum = 0;
    for (long k = from; k < to; ++k) {
      const auto a = floor.find(k), b = floor.find(k + 1);
      if (a == floor.end() || b == floor.end()) return std::nullopt;
      sum -= 0.5 * (a->second.at("vz_over_h_1ps") + b->second.at("vz_over_h_1ps")) / rate_hz;
    }
    return sum;
  }
  /// Of the box, 0 x 0 when there is none.
  [[nodiscard]] Window box(long frame) const {
    const auto row = car.find(frame);
    if (row == car.end()) return {};
    const auto at = [&](const char* name) { return static_cast<int>(row->second.at(name)); };
    return {at("roi_x0"), at("roi_y0"), at("roi_x1") - at("roi_x0"), at("roi_y1") - at("roi_y0")};
  }
};

/// One window size for all frames: that of the largest box (with a margin so that blocks reach over its edge), or the
/// whole image.
Window largest_box(const Contact& contact, const std::vector<MotionFrame>& frames) {
  Window largest;
  for (const MotionFrame& frame : frames) {
    const Window box = contact.box(frame.number);
    largest.width = std::max(largest.width, box.width), largest.height = std::max(largest.height, box.height);
  }
  if (largest.width == 0) return {0, 0, frames[0].width_px, frames[0].height_px};
  constexpr int kLeast = 96;
  largest.width = std::min(std::max(largest.width, kLeast), frames[0].width_px);
  largest.height = std::min(std::max(largest.height, kLeast), frames[0].height_px);
  return largest;
}

Window placed(Window window, const Window& box, const MotionFrame& frame) {
  if (box.width == 0) return window;
  window.x = std::clamp(box.x + (box.width - window.width) / 2, 0, frame.width_px - window.width);
  window.y = std::clamp(box.y + (box.height - window.height) / 2, 0, frame.height_px - window.height);
  return window;
}

vision::FlowField inside_box(vision::FlowField field, const Window& box) {
  if (box.width == 0) return field;
  for (int i = 0; i < field.count(); ++i) {
    vision::FlowCell& cell = field.cells[static_cast<std::size_t>(i)];
    const float x = cell.x_px - static_cast<float>(box.x), y = cell.y_px - static_cast<float>(box.y);
    if (x < 0 || y < 0 || x > static_cast<float>(box.width) || y > static_cast<float>(box.height)) cell.valid = 0;
  }
  return field;
}

struct Fits {
  std::vector<vision::SimilarityFit> all;  ///< of frame i to i + 1
  std::vector<double> times_us;
};

Fits fit_pairs(const Contact& contact, const std::vector<MotionFrame>& frames) {
  Fits fits;
  const Window size = largest_box(contact, frames);
  WindowFlow flow(size.width, size.height);
  for (std::size_t i = 0; i + 1 < frames.size(); ++i) {
    const Window box = contact.box(frames[i].number), window = placed(size, box, frames[i]);
    const auto begin = std::chrono::steady_clock::now();
    const vision::FlowField field = inside_box(flow.track(frames[i], frames[i + 1], window), box);
    const vision::SimilarityFitParams params{
        .centre_x_px = static_cast<float>(window.x) + 0.5f * static_cast<float>(window.width),
        .centre_y_px = static_cast<float>(window.y) + 0.5f * static_cast<float>(window.height)};
    fits.all.push_back(vision::fit_similarity(params, field));
    fits.times_us.push_back(
        std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
  }
  return fits;
}

void add_errors(std::vector<Figure>& figures, const std::string& name, const std::vector<double>& errors,
                std::optional<Bar> bar) {
  if (errors.empty()) return;
  const Spread error = spread(errors);
  figures.push_back({name + "_median", error.median, "%", bar});
  figures.push_back({name + "_p95", error.p95, "%"});
}

double percent_off(float estimate, double truth) {
  return std::abs(static_cast<double>(estimate) / truth - 1.0) * 100.0;
}

/// Estimates that are not valid are counted, not compared; nor is anything while the truth is not an approach.
void add_window(std::vector<Figure>& figures, const Contact& contact, const std::vector<MotionFrame>& frames,
                const Fits& fits, int window) {
  vision::ContactWindow contact_window(window);
  std::vector<double> window_errors, now_errors;
  double windows = 0, valid = 0;
  for (std::size_t i = 0; i < fits.all.size(); ++i) {
    const auto estimate = contact_window.add(fits.all[i]);
    if (i + 1 < static_cast<std::size_t>(window)) continue;
    windows += 1;
    valid += estimate.valid ? 1 : 0;
    if (!estimate.valid) continue;
    const long newest = frames[i + 1].number, oldest = frames[i + 1 - static_cast<std::size_t>(window)].number;
    const auto approach = contact.approach(oldest, newest);
    if (approach && *approach > 0)
      window_errors.push_back(percent_off(estimate.frames, window / std::expm1(*approach)));
    if (const auto now = contact.frames_at(newest)) now_errors.push_back(percent_off(estimate.frames, *now));
  }
  if (windows < 1) return;
  const std::string suffix = "_over_" + std::to_string(window);
  figures.push_back(
      {"valid_share" + suffix, valid / windows, "", contact.none() ? std::optional(kNoFalseAlarm) : std::nullopt});
  add_errors(figures, "window_error" + suffix, window_errors, kError);
  add_errors(figures, "now_error" + suffix, now_errors, std::nullopt);
}

}  // namespace

std::vector<Figure> eval_time_to_contact(const drivers::Recording& recording, const EvalOptions&) {
  const auto frames = read_sequence(recording.folder());
  const Contact contact{read_numbers(recording.folder() / "ttc.csv"),
                        read_numbers(recording.folder() / "gt_per_frame.csv"), recording.nominal_rate_hz()};
  std::vector<Figure> figures{{"frames", static_cast<double>(frames.size()), ""}};
  const Fits fits = fit_pairs(contact, frames);
  for (const int window : {5, 7, 10}) add_window(figures, contact, frames, fits, window);
  add_times(figures, fits.times_us);
  return figures;
}

}  // namespace wasp::tools
