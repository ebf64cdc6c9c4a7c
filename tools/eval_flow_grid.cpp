// flow_grid beside cv::calcOpticalFlowPyrLK (10 x 10 window, 4 levels, at the grid's centres) against ground truth at
// the centres. Where the folder has a dense flow (flow<N>.flo with frames N and N + 1, or flow_noc_<name>_10.png as
// KITTI has it) that is the truth; any other folder's first grey frame is moved by known shifts, zooms and turns, with
// and without noise. Both are compared over the cells that both call valid.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <fstream>
#include <optional>
#include <random>
#include <stdexcept>

#ifdef WASP_HAVE_OPENCV
#include <opencv2/imgcodecs.hpp>
#include <opencv2/video/tracking.hpp>
#endif

#include "drivers/image_file.h"
#include "tools/eval_kernels.h"
#include "vision/kernels/flow_grid.h"

namespace wasp::tools {
namespace {

namespace fs = std::filesystem;
using Gray = drivers::Image<std::uint8_t>;

/// The library's answer in the same type. All cells invalid where OpenCV was not there at build time.
vision::FlowField library_flow(const FlowPair& pair, const vision::FlowField& grid) {
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
  cv::calcOpticalFlowPyrLK(mat(pair.first), mat(pair.second), from, to, status, error, {10, 10}, 3);
  for (std::size_t i = 0; i < from.size(); ++i) {
    field.cells[i].u_px = to[i].x - from[i].x;
    field.cells[i].v_px = to[i].y - from[i].y;
    field.cells[i].valid = status[i];
  }
#endif
  return field;
}

struct Outcome {
  std::vector<double> ours, theirs;
  double known = 0, valid = 0;
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
  const vision::FlowField library = library_flow(pair, field);
  const bool library_there =
      std::any_of(library.cells.begin(), library.cells.end(), [](const auto& c) { return c.valid != 0; });
  Outcome o;
  o.passes = grid.trips().passes;
  o.most_passes = grid.worst_case().passes;
  for (int i = 0; i < field.count(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const auto at = nearest_known(pair.truth, field.cells[k].x_px, field.cells[k].y_px);
    if (!at) continue;
    const auto error = [&](const vision::FlowCell& c) {
      return static_cast<double>(std::hypot(c.u_px - pair.truth.u[*at], c.v_px - pair.truth.v[*at]));
    };
    o.known += 1;
    o.valid += field.cells[k].valid;
    if (field.cells[k].valid == 0 || (library_there && library.cells[k].valid == 0)) continue;
    o.ours.push_back(error(field.cells[k]));
    if (library_there) o.theirs.push_back(error(library.cells[k]));
  }
  return o;
}

void add_figures(std::vector<Figure>& figures, const std::string& name, const Outcome& o) {
  if (o.ours.empty()) throw std::runtime_error(name + ": no cell with truth and flow");
  const Spread ours = spread(o.ours), theirs = spread(o.theirs);
  const auto bar = [&](double value) { return o.theirs.empty() ? std::nullopt : std::optional(Bar{value}); };
  figures.push_back({name + ".epe_median", ours.median, "px", bar(theirs.median)});
  figures.push_back({name + ".epe_p95", ours.p95, "px", bar(theirs.p95)});
  if (!o.theirs.empty()) {
    figures.push_back({name + ".pyrlk_median", theirs.median, "px"});
    figures.push_back({name + ".pyrlk_p95", theirs.p95, "px"});
  }
  figures.push_back({name + ".cells", static_cast<double>(o.ours.size()), ""});
  figures.push_back({name + ".valid_share", o.valid / o.known, ""});
}

}  // namespace

std::vector<Figure> eval_flow_grid(const drivers::Recording& recording, const EvalOptions& options) {
  std::vector<FlowPair> pairs = read_flow_pairs(recording.folder());
  if (pairs.empty()) {
    const auto size = recording.gray_size();
    const auto& entries = recording.entries();
    const auto first = std::find_if(entries.begin(), entries.end(), [](const auto& e) { return e.has_gray(); });
    if (first == entries.end()) throw std::runtime_error(recording.folder().string() + ": no grey frames");
    Gray image{size.width_px, size.height_px, std::vector<std::uint8_t>(size.pixels())};
    recording.load_gray(static_cast<std::size_t>(first - entries.begin()), image.pixels);
    for (const FlowWarp& warp : kFlowWarps) pairs.push_back(make_flow_pair(image, warp));
  }
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
