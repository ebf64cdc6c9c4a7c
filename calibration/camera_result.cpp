#include "calibration/camera_result.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "calibration/picture.h"
#include "tools/quantiles.h"

namespace wasp::calibration {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

int cell_of(const cv::Point2f& p, cv::Size image) {
  const int column =
      std::min(ImageCoverage::kColumns - 1, static_cast<int>(p.x) * ImageCoverage::kColumns / image.width);
  const int row = std::min(ImageCoverage::kRows - 1, static_cast<int>(p.y) * ImageCoverage::kRows / image.height);
  return row * ImageCoverage::kColumns + column;
}

std::array<int, ImageCoverage::kColumns * ImageCoverage::kRows> corners_in_cells(const BoardViews& views) {
  std::array<int, ImageCoverage::kColumns * ImageCoverage::kRows> counts{};
  for (const auto& view : views.views)
    for (const auto& p : view.corners) ++counts[static_cast<std::size_t>(cell_of(p, views.image))];
  return counts;
}

/// The uncertainty of the projection at the centres of the cells; NaN where the lens has no ray.
std::vector<double> projection_sigmas(const BoardViews& views, const LensFit& fit) {
  std::vector<double> out;
  for (int row = 0; row < ImageCoverage::kRows; ++row)
    for (int column = 0; column < ImageCoverage::kColumns; ++column)
      out.push_back(projection_sigma(fit, {(column + 0.5) * views.image.width / ImageCoverage::kColumns,
                                           (row + 0.5) * views.image.height / ImageCoverage::kRows}));
  return out;
}

TomlSection evidence_of(const BoardViews& views, const LensFit& fit, const CameraEvidence& e) {
  TomlSection t;
  t.text("board", fmt::format("{}x{}", views.board.width, views.board.height)).number("square_mm", e.square_mm);
  t.whole("views", static_cast<long long>(views.views.size()));
  t.number("held_out_rms_px", e.held_out_rms_px, "on views that the fit did not see");
  const char* kPinhole[] = {"fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"};
  const char* kFisheye[] = {"fx_px", "fy_px", "cx_px", "cy_px", "fisheye_k1", "fisheye_k2", "fisheye_k3", "fisheye_k4"};
  const bool fisheye = fit.model.kind == LensKind::kFisheye;
  for (Eigen::Index i = 0; i < fit.sigma.size(); ++i)
    t.number(std::string(fisheye ? kFisheye[i] : kPinhole[i]) + "_sigma", fit.sigma[i]);
  for (Eigen::Index i = 0; i < 4; ++i)
    t.number(std::string(kPinhole[i]) + "_bias", fit.bias[i],
             fmt::format("at most, by corners seen {} px wrong in all views alike", kCornerBias_px));
  const ImageCoverage coverage = image_coverage(views, fit);
  t.number("widest_tilt_deg", widest_tilt(fit) * 180 / std::numbers::pi, "between any two views");
  t.whole("cells_with_corners", coverage.cells, fmt::format("of {}", ImageCoverage::kColumns * ImageCoverage::kRows));
  t.number("widest_radius", coverage.widest_radius, "of a corner; 1: the image's far corner");
  std::vector<double> known;
  for (const double s : projection_sigmas(views, fit))
    if (std::isfinite(s)) known.push_back(s);
  if (!known.empty())
    t.number("projection_sigma_px", tools::median(known), "median over the image")
        .number("projection_sigma_worst_px", *std::max_element(known.begin(), known.end()));
  t.whole("cells_without_ray", cells_without_ray(views, fit), "where the polynomial folds back");
  std::vector<double> rounded;
  for (const double rms : fit.view_rms) rounded.push_back(std::round(rms * 1e4) * 1e-4);
  t.numbers("view_rms_px", rounded);
  t.text("removed", fmt::format("{}", fmt::join(e.removed, ", ")));
  return t;
}

tools::Curve outline(cv::Size image) {
  tools::Curve frame{"", {"ink", "thin"}, {}};
  for (const auto& [x, y] : {std::pair{0, 0}, {image.width, 0}, {image.width, image.height}, {0, image.height}, {0, 0}})
    frame.series.add(x, -y);
  return frame;
}

/// Errors as lines from where a corner was seen, magnified; rows run down, as in the image.
Picture residual_picture(const BoardViews& views, const LensFit& fit) {
  const double scale = std::pow(10.0, std::round(std::log10(0.03 * views.image.width / std::max(fit.rms, 1e-3))));
  tools::Plot plot = labelled_plot("residuals", "u [px]", "-v [px]");
  plot.width = 1100, plot.height = 60 + 1000 * views.image.height / views.image.width;
  plot.equal_axes = true;
  tools::Curve dots{fmt::format("corners of {} views", views.views.size()), {"c2", "dots"}, {}};
  tools::Curve errors{fmt::format("error x {:g} ({:.3f} px rms)", scale, fit.rms), {"c1", "thin"}, {}};
  for (std::size_t v = 0; v < views.views.size(); ++v)
    for (std::size_t i = 0; i < views.views[v].corners.size(); ++i) {
      const auto& p = views.views[v].corners[i];
      const auto& r = fit.residuals[v][i];
      const double x = static_cast<double>(p.x), y = -static_cast<double>(p.y);
      dots.series.add(x, y);
      errors.series.add(x, y);
      errors.series.add(x + scale * static_cast<double>(r.x), y - scale * static_cast<double>(r.y));
      errors.series.add(kNan, kNan);
    }
  plot.curves = {dots, errors, outline(views.image)};
  return picture("residuals", plot);
}

/// How many corners each part of the image had, and how well it is known.
Picture coverage_picture(const BoardViews& views, const LensFit& fit) {
  tools::Plot plot = labelled_plot("coverage", "u [px]", "-v [px]");
  plot.width = 1100, plot.height = 60 + 1000 * views.image.height / views.image.width;
  plot.equal_axes = true;
  tools::Curve grid{"", {"ink", "dashed"}, {}};
  const auto counts = corners_in_cells(views);
  const auto sigmas = projection_sigmas(views, fit);
  const double w = static_cast<double>(views.image.width) / ImageCoverage::kColumns;
  const double h = static_cast<double>(views.image.height) / ImageCoverage::kRows;
  for (int c = 1; c < ImageCoverage::kColumns; ++c)
    grid.series.add(c * w, 0), grid.series.add(c * w, -views.image.height), grid.series.add(kNan, kNan);
  for (int r = 1; r < ImageCoverage::kRows; ++r)
    grid.series.add(0, -r * h), grid.series.add(views.image.width, -r * h), grid.series.add(kNan, kNan);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const auto column = static_cast<int>(i) % ImageCoverage::kColumns,
               row = static_cast<int>(i) / ImageCoverage::kColumns;
    const std::string sigma = std::isfinite(sigmas[i]) ? fmt::format("{:.2f} px", sigmas[i]) : "no ray";
    plot.marks.push_back({fmt::format("{} / {}", counts[i], sigma), (column + 0.2) * w, -(row + 0.5) * h});
  }
  plot.curves = {grid, outline(views.image)};
  plot.curves[0].name = "corners / one standard deviation of the projection";
  return picture("coverage", plot);
}

}  // namespace

int cells_without_ray(const BoardViews& views, const LensFit& fit) {
  const auto sigmas = projection_sigmas(views, fit);
  return static_cast<int>(std::count_if(sigmas.begin(), sigmas.end(), [](double s) { return !std::isfinite(s); }));
}

ImageCoverage image_coverage(const BoardViews& views, const LensFit& fit) {
  ImageCoverage out;
  for (const int count : corners_in_cells(views)) out.cells += count > 0 ? 1 : 0;
  const cv::Point2d centre(fit.K(0, 2), fit.K(1, 2));
  double seen = 0, far = 1;
  for (const auto& view : views.views)
    for (const auto& p : view.corners) seen = std::max(seen, cv::norm(cv::Point2d(p) - centre));
  for (const auto& [x, y] : {std::pair{0, 0},
                             {views.image.width - 1, 0},
                             {0, views.image.height - 1},
                             {views.image.width - 1, views.image.height - 1}})
    far = std::max(far, cv::norm(cv::Point2d(x, y) - centre));
  out.widest_radius = seen / far;
  return out;
}

TomlSection camera_section(const BoardViews& views, const LensFit& fit, const std::string& name) {
  TomlSection t(name);
  t.whole("width_px", views.image.width).whole("height_px", views.image.height);
  t.number("fx_px", fit.K(0, 0)).number("fy_px", fit.K(1, 1)).number("cx_px", fit.K(0, 2)).number("cy_px", fit.K(1, 2));
  const bool fisheye = fit.model.kind == LensKind::kFisheye;
  const char* kOrder[] = {"k1", "k2", "p1", "p2", "k3"};
  for (std::size_t i = 0; i < 5; ++i) t.number(kOrder[i], fisheye ? 0.0 : fit.distortion[i]);
  t.text("lens", fisheye ? "fisheye" : "pinhole");
  t.numbers("fisheye_k", fisheye ? fit.distortion : std::vector<double>(4, 0.0));
  return t;
}

Solution camera_solution(const BoardViews& views, const LensFit& fit, const CameraEvidence& e,
                         const std::string& source) {
  Solution out;
  out.flight.push_back(camera_section(views, fit, e.section));
  out.evidence = evidence_of(views, fit, e);
  out.source = source;
  out.samples = views.views.size() * static_cast<std::size_t>(views.board.area());
  out.residual_rms = fit.rms;
  out.residual_unit = "px, distance of seen and projected corners";
  out.notes = e.notes;
  if (!e.removed.empty())
    out.notes.push_back(fmt::format("views left out, their error stands out: {}", fmt::join(e.removed, ", ")));
  out.pictures = {residual_picture(views, fit), coverage_picture(views, fit)};
  return out;
}

}  // namespace wasp::calibration
