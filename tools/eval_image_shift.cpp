// The cells of figures 3.6 and 3.7 on every still image of the folder, real crops: the second window is cut from the
// image moved (Fourier shift, or turned about the window's middle and moved), so borders are not shared. Each cell
// gives the RMS error of the default, the variants and cv::phaseCorrelate, in pixels; `_lead` is how many standard
// errors the mean square error lies below cv::phaseCorrelate's. Then pairs that turn and grow more than the figures'
// do, or show nothing in common. A silent failure is a shift called valid that is more than a pixel off; a false reject
// is one within a pixel that is not called valid.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "tools/eval_image_shift_scenes.h"
#include "tools/eval_kernels.h"
#include "vision/kernels/image_shift_projections.h"
#include "vision/kernels/image_shift_reference.h"

namespace wasp::tools {
namespace {

constexpr double kShifts_px[] = {2, 5, 10, 15}, kSnrs_db[] = {15, 20, 25, 30, 40, 50};
constexpr double kZooms[] = {0.8, 0.85, 0.9, 0.95, 1.05, 1.1, 1.15, 1.2};
constexpr double kFailure_px = 1;
constexpr double kSensorNoise = 2;  // grey levels, of the pairs beyond the figures
constexpr const char* kMethodNames[] = {"shear_average", "cross_correlation", "cross_correlation_subpixel",
                                        "kuglin_hines", "foroosh"};

struct Errors {
  double square = 0;
  int count = 0;
  void add(double error) { square += error * error, ++count; }
  [[nodiscard]] double rms() const { return std::sqrt(square / count); }
};

struct Cell {
  Errors ours, ours_valid, opencv, projections;
  Errors references[std::size(kMethodNames)];
  std::vector<double> leads;  ///< square error of cv::phaseCorrelate less ours
  int refused = 0, silent = 0, false_rejects = 0, projections_silent = 0;

  /// Mean of `leads` over its standard error.
  [[nodiscard]] double lead() const {
    const double n = static_cast<double>(leads.size());
    double mean = 0, square = 0;
    for (const double v : leads) mean += v / n;
    for (const double v : leads) square += (v - mean) * (v - mean) / n;
    return square > 0 ? mean / std::sqrt(square / n) : 0;
  }
};

class Contest {
 public:
  explicit Contest(int side) : side_(side), plan_(side, side), projections_(side, side), reference_(side, side) {
    cv::createHanningWindow(hann_, {side, side}, CV_32F);
  }

  /// `x`, `y`: the truth; infinite where there is none.
  void run(const cv::Mat& first, const cv::Mat& second, double x, double y, Cell& cell) {
    const GrayView a{first.data, side_, side_, side_}, b{second.data, side_, side_, side_};
    const auto error = [&](double u, double v) { return std::hypot(u - x, v - y); };
    const auto error_of = [&](const vision::ImageShift& s) {
      return error(static_cast<double>(s.x_px), static_cast<double>(s.y_px));
    };
    const auto begin = std::chrono::steady_clock::now();
    const auto ours = plan_.estimate(a, b);
    times_us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
    const double mine = error_of(ours);
    cell.ours.add(mine);
    if (ours.valid) cell.ours_valid.add(mine);
    cell.refused += ours.valid ? 0 : 1;
    cell.silent += ours.valid && mine > kFailure_px ? 1 : 0;
    cell.false_rejects += !ours.valid && mine <= kFailure_px ? 1 : 0;
    if (!std::isfinite(x)) return;
    const auto projected = projections_.estimate(a, b);
    cell.projections.add(error_of(projected));
    cell.projections_silent += projected.valid && error_of(projected) > kFailure_px ? 1 : 0;
    for (std::size_t m = 0; m < std::size(kMethodNames); ++m)
      cell.references[m].add(error_of(reference_.estimate(vision::kShiftMethods[m], a, b)));
    cv::Mat fa, fb;
    first.convertTo(fa, CV_32F);
    second.convertTo(fb, CV_32F);
    const cv::Point2d peer = cv::phaseCorrelate(fa, fb, hann_);
    const double theirs = error(peer.x, peer.y);
    cell.opencv.add(theirs);
    cell.leads.push_back(theirs * theirs - mine * mine);
  }

  std::vector<double> times_us;
  int cells_won = 0, cells = 0, pairs = 0, silent = 0, false_rejects = 0;

 private:
  int side_;
  vision::ImageShiftPlan plan_;
  vision::ShiftProjections projections_;
  vision::ShiftReference reference_;
  cv::Mat hann_;
};

void add_counts(std::vector<Figure>& figures, const std::string& name, const Cell& cell, Contest& contest) {
  const double n = cell.ours.count;
  figures.push_back({name + "_refused", cell.refused / n, ""});
  figures.push_back({name + "_false_rejects", cell.false_rejects / n, ""});
  figures.push_back({name + "_silent_failures", cell.silent / n, ""});
  contest.pairs += cell.ours.count;
  contest.silent += cell.silent;
  contest.false_rejects += cell.false_rejects;
}

/// A cell of the figures. Bars: never worse than OpenCV, and the figure of the issue where it names one.
void add_cell(std::vector<Figure>& figures, const std::string& name, const Cell& cell, Contest& contest,
              std::optional<double> bar) {
  const double most = std::min(cell.opencv.rms(), bar.value_or(std::numeric_limits<double>::infinity()));
  figures.push_back({name + "_default", cell.ours.rms(), "px rms", Bar{most}});
  if (cell.ours_valid.count > 0) figures.push_back({name + "_default_if_valid", cell.ours_valid.rms(), "px rms"});
  figures.push_back({name + "_opencv", cell.opencv.rms(), "px rms"});
  figures.push_back({name + "_lead", cell.lead(), ""});
  figures.push_back({name + "_projections", cell.projections.rms(), "px rms"});
  figures.push_back(
      {name + "_projections_silent_failures", static_cast<double>(cell.projections_silent) / cell.ours.count, ""});
  for (std::size_t m = 0; m < std::size(kMethodNames); ++m)
    figures.push_back({name + "_" + kMethodNames[m], cell.references[m].rms(), "px rms"});
  add_counts(figures, name, cell, contest);
  contest.cells += 1;
  contest.cells_won += cell.ours.rms() <= cell.opencv.rms() ? 1 : 0;
}

/// The accuracy bar for a cell, where there is one.
std::optional<double> bar_of(int side, double shift_px, double snr_db) {
  if (snr_db < 30) return {};
  if (side >= 128) return 0.05;
  return shift_px <= 5 ? std::optional(0.1) : std::nullopt;
}

void noise_cells(const std::vector<cv::Mat>& scenes, int side, int runs, bool subpixel, std::vector<Figure>& figures,
                 Contest& contest) {
  std::mt19937 random(36);
  for (const double shift : kShifts_px) {
    const double x = subpixel ? shift + 0.37 : shift, y = subpixel ? -0.21 : 0.0;
    Cell cells[std::size(kSnrs_db)];
    for (const cv::Mat& scene : scenes) {
      const cv::Mat moved = fourier_shifted(scene, x, y);
      for (std::size_t k = 0; k < std::size(kSnrs_db); ++k)
        for (int run = 0; run < runs; ++run) {
          const cv::Rect at = window_place(scene, side, random);
          cv::Scalar mean, deviation;
          cv::meanStdDev(scene(at), mean, deviation);
          const double sigma = deviation[0] * std::pow(10.0, -kSnrs_db[k] / 20);
          contest.run(sensed(scene(at), sigma, random), sensed(moved(at), sigma, random), x, y, cells[k]);
        }
    }
    for (std::size_t k = 0; k < std::size(kSnrs_db); ++k)
      add_cell(figures, fmt::format("n{}_shift{}{}_snr{}dB", side, shift, subpixel ? "_subpixel" : "", kSnrs_db[k]),
               cells[k], contest, bar_of(side, shift, kSnrs_db[k]));
  }
}

Cell turned_cell(const std::vector<cv::Mat>& scenes, int side, int runs, double angle_deg, double zoom, double shift,
                 double noise, std::mt19937& random, Contest& contest) {
  Cell cell;
  for (const cv::Mat& scene : scenes)
    for (int run = 0; run < runs; ++run) {
      const cv::Rect at = window_place(scene, side, random);
      contest.run(sensed(scene(at), noise, random), sensed(turned(scene, at, angle_deg, zoom, shift), noise, random),
                  shift, 0, cell);
    }
  return cell;
}

void rotation_cells(const std::vector<cv::Mat>& scenes, int side, int runs, std::vector<Figure>& figures,
                    Contest& contest) {
  std::mt19937 random(37);
  for (const double shift : kShifts_px)
    for (int angle = -5; angle <= 5; ++angle)
      add_cell(figures, fmt::format("n{}_shift{}_rotation{}deg", side, shift, angle),
               turned_cell(scenes, side, runs, angle, 1, shift, 0, random, contest), contest, {});
}

/// Two images' windows: nothing in common.
Cell unrelated_cell(const std::vector<cv::Mat>& scenes, int side, int runs, std::mt19937& random, Contest& contest) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  Cell cell;
  for (std::size_t i = 0; i < scenes.size(); ++i)
    for (int run = 0; run < runs; ++run) {
      const cv::Mat& other = scenes[(i + 1 + random() % (scenes.size() - 1)) % scenes.size()];
      contest.run(sensed(scenes[i](window_place(scenes[i], side, random)), kSensorNoise, random),
                  sensed(other(window_place(other, side, random)), kSensorNoise, random), kNone, kNone, cell);
    }
  return cell;
}

/// Beyond the figures: what the quality values are for.
void failure_cells(const std::vector<cv::Mat>& scenes, int side, int runs, std::vector<Figure>& figures,
                   Contest& contest) {
  std::mt19937 random(38);
  for (int angle = 0; angle <= 10; ++angle)
    add_counts(figures, fmt::format("n{}_turn{}deg", side, angle),
               turned_cell(scenes, side, runs, angle, 1, 5, kSensorNoise, random, contest), contest);
  for (const double zoom : kZooms)
    add_counts(figures, fmt::format("n{}_zoom{}", side, zoom),
               turned_cell(scenes, side, runs, 0, zoom, 5, kSensorNoise, random, contest), contest);
  if (scenes.size() > 1)
    add_counts(figures, fmt::format("n{}_unrelated", side), unrelated_cell(scenes, side, runs, random, contest),
               contest);
}

void add_totals(std::vector<Figure>& figures, int side, Contest& contest) {
  const auto add = [&](const char* name, double value, const char* unit) {
    figures.push_back({fmt::format("n{}_{}", side, name), value, unit});
  };
  add("cells_not_worse_than_opencv", contest.cells_won, "");
  add("cells", contest.cells, "");
  add("pairs", contest.pairs, "");
  add("silent_failures", static_cast<double>(contest.silent) / contest.pairs, "of all pairs");
  add("false_rejects", static_cast<double>(contest.false_rejects) / contest.pairs, "of all pairs");
  std::sort(contest.times_us.begin(), contest.times_us.end());
  add("time_p50", contest.times_us[contest.times_us.size() / 2], "us");
  add("time_max", contest.times_us.back(), "us");
}

}  // namespace

std::vector<Figure> eval_image_shift(const std::filesystem::path& folder, const EvalOptions& options) {
  const auto scenes = shift_scenes(folder);
  if (scenes.empty()) throw std::runtime_error(folder.string() + ": no PNG or PGM images");
  int shortest = std::numeric_limits<int>::max();
  for (const cv::Mat& scene : scenes) shortest = std::min({shortest, scene.rows, scene.cols});
  std::vector<Figure> figures{{"images", static_cast<double>(scenes.size()), ""}};
  for (const int side : {64, 128, 256}) {
    if (shortest < side + 2 * kShiftMargin_px) continue;
    Contest contest(side);
    noise_cells(scenes, side, options.repeat, false, figures, contest);
    noise_cells(scenes, side, options.repeat, true, figures, contest);
    rotation_cells(scenes, side, options.repeat, figures, contest);
    failure_cells(scenes, side, options.repeat, figures, contest);
    add_totals(figures, side, contest);
  }
  return figures;
}

}  // namespace wasp::tools
