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

constexpr int kNearestTruthPx = 3;  // sparse truth: how far from the centre it may lie

/// Flow by pixel; known is 0 where there is none.
struct DenseTruth {
  int width_px = 0, height_px = 0;
  std::vector<float> u, v;
  std::vector<std::uint8_t> known;
};

struct Pair {
  std::string name;
  Gray first, second;
  DenseTruth truth;
};

struct Point {
  double u, v;
};

/// Trailing number of a name without its extension, and what stands before it: "frame_0002" -> "frame_", 2.
std::optional<std::pair<std::string, long>> split_number(const std::string& stem) {
  const auto last = stem.find_last_not_of("0123456789");
  const std::string digits = last == std::string::npos ? stem : stem.substr(last + 1);
  if (digits.empty() || digits.size() > 9) return std::nullopt;
  return std::pair{stem.substr(0, stem.size() - digits.size()), std::stol(digits)};
}

bool is_mask(const std::string& prefix) {
  return prefix.starts_with("occluded") || prefix.starts_with("invalid") || prefix.starts_with("not_sky") ||
         prefix.starts_with("flow");
}

DenseTruth read_flo(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  float tag = 0;
  std::array<std::int32_t, 2> size{};
  in.read(reinterpret_cast<char*>(&tag), sizeof tag);
  in.read(reinterpret_cast<char*>(size.data()), sizeof size);
  const bool good = in && tag == 202021.25f && size[0] > 0 && size[1] > 0 && size[0] <= drivers::kMaxImageSide &&
                    size[1] <= drivers::kMaxImageSide;
  if (!good) throw std::runtime_error(file.string() + ": not a .flo file");
  const auto count = static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]);
  std::vector<float> uv(2 * count);
  in.read(reinterpret_cast<char*>(uv.data()), static_cast<std::streamsize>(uv.size() * sizeof(float)));
  if (!in) throw std::runtime_error(file.string() + ": cut short");
  DenseTruth truth{size[0], size[1], std::vector<float>(count), std::vector<float>(count),
                   std::vector<std::uint8_t>(count)};
  for (std::size_t i = 0; i < count; ++i) {
    truth.u[i] = uv[2 * i];
    truth.v[i] = uv[2 * i + 1];
    truth.known[i] = std::abs(truth.u[i]) < 1e9f && std::abs(truth.v[i]) < 1e9f ? 1 : 0;
  }
  return truth;
}

/// Clears `known` where the mask says so.
void apply_mask(const fs::path& file, bool keep_bright, DenseTruth& truth) {
  const Gray mask = drivers::load_gray8(file);
  if (mask.width_px != truth.width_px || mask.height_px != truth.height_px)
    throw std::runtime_error(file.string() + ": not of the flow's size");
  for (std::size_t i = 0; i < truth.known.size(); ++i)
    if ((mask.pixels[i] > 127) != keep_bright) truth.known[i] = 0;
}

std::vector<fs::path> files_of(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

Pair read_flo_pair(const fs::path& flo, long number, const std::vector<fs::path>& files) {
  Pair pair{flo.stem().string(), {}, {}, read_flo(flo)};
  std::string prefix;
  for (const fs::path& file : files) {
    const auto split = split_number(file.stem().string());
    if (!split || file.extension() != ".png") continue;
    if (split->second == number && !is_mask(split->first))
      pair.first = drivers::load_gray8(file), prefix = split->first;
    if (split->second == number && is_mask(split->first) && !split->first.starts_with("flow"))
      apply_mask(file, split->first.starts_with("not_sky"), pair.truth);
  }
  for (const fs::path& file : files) {
    const auto split = split_number(file.stem().string());
    if (split && file.extension() == ".png" && split->second == number + 1 && split->first == prefix)
      pair.second = drivers::load_gray8(file);
  }
  if (pair.first.pixels.empty() || pair.second.pixels.empty())
    throw std::runtime_error(flo.string() + ": no frames " + std::to_string(number) + " and the next beside it");
  return pair;
}

#ifdef WASP_HAVE_OPENCV
/// KITTI: 16-bit colour, u = (R - 32768) / 64, v = (G - 32768) / 64, known where B > 0; OpenCV delivers BGR.
DenseTruth read_kitti(const fs::path& file) {
  const cv::Mat image = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  if (image.type() != CV_16UC3) throw std::runtime_error(file.string() + ": not a 16-bit colour PNG");
  const auto count = static_cast<std::size_t>(image.total());
  DenseTruth truth{image.cols, image.rows, std::vector<float>(count), std::vector<float>(count),
                   std::vector<std::uint8_t>(count)};
  for (std::size_t i = 0; i < count; ++i) {
    const auto& bgr = image.at<cv::Vec3w>(static_cast<int>(i) / image.cols, static_cast<int>(i) % image.cols);
    truth.u[i] = static_cast<float>(bgr[2] - 32768) / 64.f;
    truth.v[i] = static_cast<float>(bgr[1] - 32768) / 64.f;
    truth.known[i] = bgr[0] > 0 ? 1 : 0;
  }
  return truth;
}
#endif

std::vector<Pair> read_pairs(const fs::path& folder) {
  std::vector<Pair> pairs;
  const auto files = files_of(folder);
  for (const fs::path& file : files) {
    const std::string stem = file.stem().string();
    const auto split = split_number(stem);
    if (file.extension() == ".flo" && split) pairs.push_back(read_flo_pair(file, split->second, files));
#ifdef WASP_HAVE_OPENCV
    if (stem.starts_with("flow_noc_") && stem.ends_with("_10") && file.extension() == ".png") {
      const std::string name = stem.substr(9, stem.size() - 12);
      pairs.push_back({name, drivers::load_gray8(folder / (name + "_10.png")),
                       drivers::load_gray8(folder / (name + "_11.png")), read_kitti(file)});
    }
#endif
  }
  return pairs;
}

/// Whole-image motion: x goes to centre + zoom R(turn) (x - centre) + shift.
struct Warp {
  const char* name;
  double shift_u, shift_v, zoom, turn_deg, noise_gray;
};
constexpr std::array kWarps = {
    Warp{"shift_0.5", 0.5, 0.3, 1, 0, 0}, Warp{"shift_3", 2.7, -1.3, 1, 0, 0},
    Warp{"shift_10", 9.4, 4.2, 1, 0, 0},  Warp{"shift_20", 20.3, -12.6, 1, 0, 0},
    Warp{"zoom_1.01", 0, 0, 1.01, 0, 0},  Warp{"zoom_1.03", 0, 0, 1.03, 0, 0},
    Warp{"zoom_0.96", 0, 0, 0.96, 0, 0},  Warp{"turn_1", 0, 0, 1, 1, 0},
    Warp{"turn_3", 0, 0, 1, 3, 0},        Warp{"noise_3", 2.7, -1.3, 1, 0, 3},
    Warp{"noise_8", 2.7, -1.3, 1, 0, 8},  Warp{"noise_8_zoom_turn", 1.5, 0.7, 1.03, 1, 8},
};

double cubic(double x) {  // Catmull-Rom
  x = std::abs(x);
  if (x < 1) return 1 + x * x * (1.5 * x - 2.5);
  return x < 2 ? 2 + x * (-4 + x * (2.5 - 0.5 * x)) : 0;
}

double sample(const Gray& image, double u, double v) {
  const int u0 = static_cast<int>(std::floor(u)), v0 = static_cast<int>(std::floor(v));
  double sum = 0;
  for (int j = -1; j <= 2; ++j)
    for (int i = -1; i <= 2; ++i) {
      const int x = std::clamp(u0 + i, 0, image.width_px - 1), y = std::clamp(v0 + j, 0, image.height_px - 1);
      sum += cubic(u - (u0 + i)) * cubic(v - (v0 + j)) *
             image.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px) +
                          static_cast<std::size_t>(x)];
    }
  return sum;
}

Pair made_pair(const Gray& image, const Warp& warp) {
  Pair pair{warp.name, image, image, {image.width_px, image.height_px, {}, {}, {}}};
  const double c = std::cos(warp.turn_deg * M_PI / 180), s = std::sin(warp.turn_deg * M_PI / 180);
  const Point centre{0.5 * (image.width_px - 1), 0.5 * (image.height_px - 1)};
  std::mt19937 random(1);
  std::normal_distribution<double> grain(0, 1);
  const auto grey = [](double x) { return static_cast<std::uint8_t>(std::clamp(std::lround(x), 0L, 255L)); };
  for (int v = 0; v < image.height_px; ++v)
    for (int u = 0; u < image.width_px; ++u) {
      const std::size_t at =
          static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width_px) + static_cast<std::size_t>(u);
      const double x = u - centre.u - warp.shift_u, y = v - centre.v - warp.shift_v;
      const double from_u = centre.u + (c * x + s * y) / warp.zoom, from_v = centre.v + (c * y - s * x) / warp.zoom;
      pair.second.pixels[at] = grey(sample(image, from_u, from_v) + warp.noise_gray * grain(random));
      pair.first.pixels[at] = grey(image.pixels[at] + warp.noise_gray * grain(random));
      const double to_u = warp.zoom * (c * (u - centre.u) - s * (v - centre.v)) + centre.u + warp.shift_u;
      const double to_v = warp.zoom * (s * (u - centre.u) + c * (v - centre.v)) + centre.v + warp.shift_v;
      pair.truth.u.push_back(static_cast<float>(to_u - u));
      pair.truth.v.push_back(static_cast<float>(to_v - v));
      const bool in = to_u >= 0 && to_v >= 0 && to_u < image.width_px && to_v < image.height_px;
      pair.truth.known.push_back(in ? 1 : 0);
    }
  return pair;
}

/// Index of the known pixel nearest to a cell's centre.
std::optional<std::size_t> nearest_truth(const DenseTruth& truth, const vision::FlowCell& cell) {
  const long u0 = std::lround(cell.x_px), v0 = std::lround(cell.y_px);
  long least = 2 * kNearestTruthPx * kNearestTruthPx + 1;
  std::optional<std::size_t> best;
  for (long v = std::max(v0 - kNearestTruthPx, 0L); v <= std::min<long>(v0 + kNearestTruthPx, truth.height_px - 1); ++v)
    for (long u = std::max(u0 - kNearestTruthPx, 0L); u <= std::min<long>(u0 + kNearestTruthPx, truth.width_px - 1);
         ++u) {
      const auto at = static_cast<std::size_t>(v * truth.width_px + u);
      const long far = (u - u0) * (u - u0) + (v - v0) * (v - v0);
      if (truth.known[at] != 0 && far < least) least = far, best = at;
    }
  return best;
}

/// The library's answer in the same type. All cells invalid where OpenCV was not there at build time.
vision::FlowField library_flow(const Pair& pair, const vision::FlowField& grid) {
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

Outcome compare(const Pair& pair, int repeat, std::vector<double>& times_us) {
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
    const auto at = nearest_truth(pair.truth, field.cells[k]);
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
  std::vector<Pair> pairs = read_pairs(recording.folder());
  if (pairs.empty()) {
    const auto size = recording.gray_size();
    const auto& entries = recording.entries();
    const auto first = std::find_if(entries.begin(), entries.end(), [](const auto& e) { return e.has_gray(); });
    if (first == entries.end()) throw std::runtime_error(recording.folder().string() + ": no grey frames");
    Gray image{size.width_px, size.height_px, std::vector<std::uint8_t>(size.pixels())};
    recording.load_gray(static_cast<std::size_t>(first - entries.begin()), image.pixels);
    for (const Warp& warp : kWarps) pairs.push_back(made_pair(image, warp));
  }
  std::vector<Figure> figures;
  std::vector<double> times_us;
  int passes = 0, most = 0;
  for (const Pair& pair : pairs) {
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
