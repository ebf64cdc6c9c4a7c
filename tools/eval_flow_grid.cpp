// flow_grid beside cv::calcOpticalFlowPyrLK at the grid's centres, with the thesis' window (10 x 10) and with OpenCV's
// own (21 x 21), 4 levels, against ground truth at the centres: the folder's dense flow, or known motions of its
// still images. All are compared over the same cells: those that flow_grid and the library call valid, and then ("all")
// every cell with a truth, whatever either says of it.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <stdexcept>

#ifdef WASP_HAVE_OPENCV
#include <opencv2/video/tracking.hpp>
#endif

#include "tools/eval_flow_pairs.h"
#include "tools/eval_kernels.h"
#include "vision/kernels/flow_grid.h"

namespace wasp::tools {
namespace {

using Gray = drivers::Image<std::uint8_t>;

constexpr bool kLibraryThere =
#ifdef WASP_HAVE_OPENCV
    true;
#else
    false;
#endif

/// The library's answer in the same type. All cells invalid where OpenCV was not there at build time.
vision::FlowField library_flow(const FlowPair& pair, const vision::FlowField& grid, [[maybe_unused]] int window_px) {
  vision::FlowField field = grid;
  for (vision::FlowCell& cell : field.cells) cell.valid = 0;
#ifdef WASP_HAVE_OPENCV
  const auto mat = [](const Gray& g) {
    return cv::Mat(g.height_px, g.width_px, CV_8U, const_cast<std::uint8_t*>(g.pixels.data()));
  };
  std::vector<cv::Point2f> from, to;
  std::vector<std::uint8_t> status;
  std::vector<float> error;
  for (int i = 0; i < grid.count(); ++i)
    from.emplace_back(grid.cells[static_cast<std::size_t>(i)].x_px, grid.cells[static_cast<std::size_t>(i)].y_px);
  cv::calcOpticalFlowPyrLK(mat(pair.first), mat(pair.second), from, to, status, error, {window_px, window_px}, 3);
  for (std::size_t i = 0; i < from.size(); ++i) {
    field.cells[i].u_px = to[i].x - from[i].x;
    field.cells[i].v_px = to[i].y - from[i].y;
    field.cells[i].valid = status[i];
  }
#endif
  return field;
}

/// End-point errors over one choice of cells.
struct Errors {
  std::vector<double> ours, thesis, own;  ///< own: with the library's own window
};

struct Outcome {
  Errors valid, all;
  double known = 0, ours_valid = 0, library_valid = 0;
  int passes = 0, most_passes = 0;
};

Outcome compare(const FlowPair& pair, int repeat, std::vector<double>& times_us) {
  vision::FlowGrid grid(pair.first.width_px, pair.first.height_px, {});
  vision::FlowField field;
  for (int i = 0; i < repeat; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    grid.track(pair.first.view(), pair.second.view(), field);
    times_us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
  }
  const vision::FlowField thesis = library_flow(pair, field, 10), own = library_flow(pair, field, 21);
  Outcome o;
  o.passes = grid.trips().passes;
  o.most_passes = grid.worst_case().passes;
  for (std::size_t k = 0; k < static_cast<std::size_t>(field.count()); ++k) {
    const vision::FlowCell& cell = field.cells[k];
    const auto at = nearest_known(pair.truth, static_cast<double>(cell.x_px), static_cast<double>(cell.y_px));
    if (!at) continue;
    const auto error = [&](const vision::FlowCell& c) {
      return static_cast<double>(std::hypot(c.u_px - pair.truth.u[*at], c.v_px - pair.truth.v[*at]));
    };
    const auto add = [&](Errors& errors) {
      errors.ours.push_back(error(cell));
      if (!kLibraryThere) return;
      errors.thesis.push_back(error(thesis.cells[k]));
      errors.own.push_back(error(own.cells[k]));
    };
    o.known += 1;
    o.ours_valid += cell.valid;
    o.library_valid += thesis.cells[k].valid;
    if (cell.valid != 0 && (!kLibraryThere || thesis.cells[k].valid != 0)) add(o.valid);
    add(o.all);
  }
  return o;
}

/// Ours, with the library's as bars.
void add_errors(std::vector<Figure>& figures, const std::string& name, const Errors& errors) {
  const Spread ours = spread(errors.ours), thesis = spread(errors.thesis), own = spread(errors.own);
  const auto bar = [&](double value) { return errors.thesis.empty() ? std::nullopt : std::optional(Bar{value}); };
  figures.push_back({name + "epe_median", ours.median, "px", bar(thesis.median)});
  figures.push_back({name + "epe_p95", ours.p95, "px", bar(thesis.p95)});
  if (errors.thesis.empty()) return;
  figures.push_back({name + "pyrlk_median", thesis.median, "px"});
  figures.push_back({name + "pyrlk_p95", thesis.p95, "px"});
  figures.push_back({name + "pyrlk21_median", own.median, "px"});
  figures.push_back({name + "pyrlk21_p95", own.p95, "px"});
}

void add_figures(std::vector<Figure>& figures, const std::string& name, const Outcome& o) {
  if (o.valid.ours.empty()) throw std::runtime_error(name + ": no cell with truth and flow");
  add_errors(figures, name + ".", o.valid);
  add_errors(figures, name + ".all.", o.all);
  figures.push_back({name + ".cells", static_cast<double>(o.valid.ours.size()), ""});
  figures.push_back({name + ".valid_share", o.ours_valid / o.known, ""});
  if (kLibraryThere) figures.push_back({name + ".pyrlk_valid_share", o.library_valid / o.known, ""});
}

/// Known motions of the folder's still images.
std::vector<FlowPair> made_pairs(const std::filesystem::path& folder) {
  std::vector<FlowPair> pairs;
  for (const NamedImage& still : read_still_images(folder))
    for (const FlowWarp& warp : kFlowWarps) {
      pairs.push_back(make_flow_pair(still.image, warp));
      pairs.back().name = still.name + "." + warp.name;
    }
  return pairs;
}

}  // namespace

std::vector<Figure> eval_flow_grid(const std::filesystem::path& folder, const EvalOptions& options) {
  std::vector<FlowPair> pairs = read_flow_pairs(folder);
  if (pairs.empty()) pairs = made_pairs(folder);
  std::vector<Figure> figures;
  std::vector<double> times_us;
  int passes = 0, most = 0;
  for (const FlowPair& pair : pairs) {
    const Outcome o = compare(pair, options.repeat, times_us);
    add_figures(figures, pair.name, o);
    passes = std::max(passes, o.passes);
    most = std::max(most, o.most_passes);
  }
  figures.push_back({"largest_passes", static_cast<double>(passes), "", Bar{static_cast<double>(most)}});
  add_times(figures, times_us);
  return figures;
}

}  // namespace wasp::tools
