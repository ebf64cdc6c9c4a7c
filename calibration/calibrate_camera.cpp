#include "calibration/calibrate_camera.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "calibration/camera_result.h"
#include "tools/quantiles.h"

namespace wasp::calibration {
namespace {

constexpr std::size_t kLeastViews = 6;
constexpr double kLeastTilt_rad = 0.14;     ///< 8 degrees between two views of the board
constexpr double kLeastCells = 0.4;         ///< share of the image's cells with a corner
constexpr double kMostFocalSigma = 0.01;    ///< share of the focal length
constexpr double kMostCentreSigma = 0.015;  ///< share of the image's width
constexpr double kMostRms_px = 1.0;
constexpr double kBadView = 3;           ///< times the median error of a view, and ...
constexpr double kBadView_px = 0.3;      ///< ... at least this
constexpr double kClearlyBetter = 0.98;  ///< of held-out errors: a richer model must earn its parameter

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

cv::Size parse_board(const std::string& text) {
  if (text == "auto") return {};
  int columns = 0, rows = 0, used = 0;
  if (std::sscanf(text.c_str(), "%dx%d%n", &columns, &rows, &used) != 2 || used != static_cast<int>(text.size()) ||
      columns < 3 || rows < 3 || columns > 100 || rows > 100)
    throw std::runtime_error("--board '" + text + "': wants inner corners as 9x6, three or more each way, or auto");
  return {columns, rows};
}

std::vector<Corners> corners_of(const std::vector<BoardView>& views) {
  std::vector<Corners> out;
  for (const auto& v : views) out.push_back(v.corners);
  return out;
}

/// At most so many views, those that differ most from each other: each time the one farthest from all chosen.
void thin(BoardViews& found, std::size_t most) {
  if (found.views.size() <= most) return;
  const auto distance = [](const BoardView& a, const BoardView& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.corners.size(); ++i) sum += cv::norm(a.corners[i] - b.corners[i]);
    return sum;
  };
  std::vector<double> nearest(found.views.size(), 1e300);
  std::vector<std::size_t> chosen{0};
  while (chosen.size() < most) {
    for (std::size_t i = 0; i < found.views.size(); ++i)
      nearest[i] = std::min(nearest[i], distance(found.views[i], found.views[chosen.back()]));
    chosen.push_back(static_cast<std::size_t>(std::max_element(nearest.begin(), nearest.end()) - nearest.begin()));
  }
  std::sort(chosen.begin(), chosen.end());
  std::vector<BoardView> kept;
  for (const std::size_t i : chosen) kept.push_back(std::move(found.views[i]));
  found.views = std::move(kept);
}

void check_views(const BoardViews& found) {
  if (found.board.width == 0)
    throw Refusal(
        fmt::format("no chessboard seen in {} images; --board COLUMNSxROWS (inner corners) helps if it is hard "
                    "to see",
                    found.images));
  if (found.views.size() < kLeastViews)
    throw Refusal(
        fmt::format("the {}x{} board was found whole in {} of {} images; {} views are the least, 15 or more "
                    "with tilts in all directions are good",
                    found.board.width, found.board.height, found.views.size(), found.images, kLeastViews));
}

/// Fits, and leaves out views whose error stands out until none does.
LensFit fit_without_bad_views(BoardViews& found, const LensModel& model, CameraEvidence& evidence) {
  const auto board = board_points(found.board, evidence.square_mm);
  for (;;) {
    auto fit = fit_lens(board, corners_of(found.views), found.image, model);
    if (!fit)
      throw Refusal(fmt::format("OpenCV finds no {} lens for these {} views: tilt the board, fill the image",
                                model.kind == LensKind::kFisheye ? "fisheye" : "pinhole", found.views.size()));
    const double limit = std::max(kBadView_px, kBadView * tools::median(fit->view_rms));
    std::vector<BoardView> good;
    for (std::size_t v = 0; v < found.views.size(); ++v) {
      if (fit->view_rms[v] <= limit)
        good.push_back(found.views[v]);
      else
        evidence.removed.push_back(fmt::format("{} ({:.2f} px)", found.views[v].name, fit->view_rms[v]));
    }
    if (good.size() == found.views.size()) return *std::move(fit);
    found.views = std::move(good);
    check_views(found);
  }
}

/// The fit of one model with its held-out error.
struct Trial {
  BoardViews views;
  LensFit fit;
  CameraEvidence evidence;
};

Trial try_model(const BoardViews& found, const LensModel& model, const CameraOptions& o) {
  Trial t{found, {}, {}};
  t.evidence.square_mm = o.square_mm;
  t.evidence.section = o.section;
  t.fit = fit_without_bad_views(t.views, model, t.evidence);
  const auto held_out =
      cross_validate(board_points(t.views.board, o.square_mm), corners_of(t.views.views), t.views.image, t.fit);
  if (!held_out)
    throw Refusal(
        fmt::format("{} views are too few: without a fifth of them there is no solution", t.views.views.size()));
  t.evidence.held_out_rms_px = *held_out;
  return t;
}

Trial best_pinhole(const BoardViews& found, const CameraOptions& o, ProgressBar& bar) {
  bar.show(0.6, "pinhole with k3");
  std::optional<Trial> with;
  if (o.k3 != "off") with = try_model(found, {LensKind::kPinhole, true}, o);
  if (o.k3 == "on") return *std::move(with);
  bar.show(0.75, "pinhole without k3");
  Trial without = try_model(found, {LensKind::kPinhole, false}, o);
  if (!with) return without;
  if (cells_without_ray(with->views, with->fit) > cells_without_ray(without.views, without.fit))
    without.evidence.notes.push_back("k3 is 0: with it the lens folds back within the image, beyond the corners");
  else if (with->evidence.held_out_rms_px < kClearlyBetter * without.evidence.held_out_rms_px)
    return *std::move(with);
  else
    without.evidence.notes.push_back("k3 is 0: with it held-out views are no better");
  return without;
}

Trial best_trial(const BoardViews& found, const CameraOptions& o, ProgressBar& bar) {
  if (o.lens == "pinhole") return best_pinhole(found, o, bar);
  std::optional<Trial> pinhole;
  std::string why;
  if (o.lens == "auto") try {
      pinhole = best_pinhole(found, o, bar);
    } catch (const Refusal& refusal) {
      why = refusal.what();
    }
  bar.show(0.85, "fisheye");
  try {
    Trial fisheye = try_model(found, {LensKind::kFisheye, false}, o);
    if (!pinhole || fisheye.evidence.held_out_rms_px < kClearlyBetter * pinhole->evidence.held_out_rms_px)
      return fisheye;
  } catch (const Refusal& refusal) {
    if (!pinhole) throw Refusal(refusal.what() + (why.empty() ? "" : "; as a pinhole: " + why));
  }
  return *std::move(pinhole);
}

void check_fit(const Trial& t, const std::string& lens) {
  const LensFit& fit = t.fit;
  const double f_share = std::max(fit.sigma[0] / fit.K(0, 0), fit.sigma[1] / fit.K(1, 1));
  const double c_share = std::max(fit.sigma[2], fit.sigma[3]) / t.views.image.width;
  const double tilt = widest_tilt(fit);
  const std::string known = fmt::format("fx {:.1f} +- {:.1f} px, cx {:.1f} +- {:.1f} px", fit.K(0, 0), fit.sigma[0],
                                        fit.K(0, 2), fit.sigma[2]);
  if (tilt < kLeastTilt_rad)
    throw Refusal(
        fmt::format("all views are nearly parallel: no two boards differ by more than {:.1f} degrees, {:.0f} are the "
                    "least; the focal length is undetermined ({}): tilt the board",
                    degrees(tilt), degrees(kLeastTilt_rad), known));
  const ImageCoverage coverage = image_coverage(t.views, fit);
  constexpr int kCells = ImageCoverage::kColumns * ImageCoverage::kRows;
  if (coverage.cells < kLeastCells * kCells)
    throw Refusal(
        fmt::format("corners in {} of {} parts of the image, {:.0f} are the least ({}): bring the board into "
                    "the corners and closer",
                    coverage.cells, kCells, std::ceil(kLeastCells * kCells), known));
  if (!(f_share <= kMostFocalSigma) || !(c_share <= kMostCentreSigma))
    throw Refusal(
        fmt::format("the views do not determine the lens: {} (one standard deviation; {:.1f} % of the focal "
                    "length and {:.1f} % of the width are allowed): more views, more tilt",
                    known, 100 * kMostFocalSigma, 100 * kMostCentreSigma));
  if (fit.rms > kMostRms_px)
    throw Refusal(
        fmt::format("reprojection error {:.2f} px rms, {:.1f} are allowed: {}", fit.rms, kMostRms_px,
                    lens == "pinhole" ? "is it a fisheye (--lens fisheye)?" : "board not flat, or images blurred"));
}

}  // namespace

Solution solve_camera(const CameraOptions& o, ProgressBar& bar) {
  const cv::Size board = parse_board(o.board);
  const auto files = chessboard_images(o.folder);
  BoardViews found =
      find_boards(files, board, [&](double share, const std::string& file) { bar.show(0.55 * share, file); });
  check_views(found);
  const std::size_t all = found.views.size();
  thin(found, static_cast<std::size_t>(o.most_views));
  Trial best = best_trial(found, o, bar);
  check_fit(best, o.lens);
  if (all > found.views.size())
    best.evidence.notes.push_back(fmt::format("{} of {} views used, those that differ most", found.views.size(), all));
  if (const int blind = cells_without_ray(best.views, best.fit); blind > 0)
    best.evidence.notes.push_back(fmt::format("{} parts of the image have no ray: bring the board there", blind));
  for (const auto& problem : found.problems) best.evidence.notes.push_back("skipped: " + problem);
  return camera_solution(best.views, best.fit, best.evidence, fmt::format("{}, {} images", o.folder, found.images));
}

std::function<Solution(ProgressBar&)> prepare_camera(CLI::App& app) {
  auto o = std::make_shared<CameraOptions>();
  app.add_option("FOLDER", o->folder, "folder of images (png, jpg, pgm, bmp, tif), or a recording with grey frames")
      ->required();
  app.add_option("--board", o->board, "inner corners, COLUMNSxROWS; auto: the size seen whole in most images");
  app.add_option("--square-mm", o->square_mm, "side of a square; does not change the intrinsics")
      ->check(CLI::Range(0.1, 1e4));
  app.add_option("--lens", o->lens, "pinhole, fisheye, or auto: the better on held-out views")
      ->check(CLI::IsMember({"pinhole", "fisheye", "auto"}));
  app.add_option("--k3", o->k3, "of a pinhole: auto: where held-out views are better with it")
      ->check(CLI::IsMember({"auto", "on", "off"}));
  app.add_option("--section", o->section, "of the configuration to write")
      ->check(CLI::IsMember({"camera", "camera_down"}));
  app.add_option("--most-views", o->most_views, "of more, those that differ most are used")->check(CLI::Range(6, 1000));
  return [o](ProgressBar& bar) { return solve_camera(*o, bar); };
}

}  // namespace wasp::calibration
