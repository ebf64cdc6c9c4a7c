// Depth from the flow grid and the true motion of the camera, against true depth. Truth is either a depth image and a
// pose by frame (img_prev/img_curr, dep_prev, pose_*.txt: tx ty tz qx qy qz qw, camera to world), or a plane and a pose
// by frame (poses.csv with K.txt and D.txt; the board's corners bound the cells that are on the plane).
#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <memory>
#include <optional>
#include <stdexcept>

#include "drivers/image_file.h"
#include "tools/eval_kernels.h"
#include "tools/eval_motion.h"
#include "vision/kernels/flow_depth.h"
#include "vision/kernels/flow_grid.h"

namespace wasp::tools {
namespace {

namespace fs = std::filesystem;
constexpr Bar kMedianRelativeError{0.2};
constexpr float kIntervalS = 1.f / 30.f;  // any value: velocity is the poses' step divided by it

/// Camera pose in the world.
struct Pose {
  Mat3 R_world_cam = Mat3::Identity();
  Vec3 position_m = Vec3::Zero();
};

struct Tally {
  std::vector<double> relative, printed_u, printed_v, times_us;
  double cells = 0, valid = 0;
};

std::vector<double> read_list(const fs::path& file, std::size_t count) {
  std::ifstream in(file);
  std::vector<double> values(count);
  for (double& value : values)
    if (!(in >> value)) throw std::runtime_error(file.string() + ": expected " + std::to_string(count) + " numbers");
  return values;
}

/// The camera's own velocity and rate in the first camera's axes.
vision::CameraStep step_between(const Pose& first, const Pose& second) {
  const Eigen::AngleAxisf turn(Mat3(first.R_world_cam.transpose() * second.R_world_cam));
  return {first.R_world_cam.transpose() * (second.position_m - first.position_m) / kIntervalS,
          turn.axis() * turn.angle() / kIntervalS, kIntervalS};
}

/// One pair of frames; `truth` gives the depth of a cell, nothing where it is not known.
template <class Truth>
void run_pair(const vision::Lens& lens, const GrayView& first, const GrayView& second, const vision::CameraStep& camera,
              const Truth& truth, vision::FlowGrid& grid, Tally& tally) {
  vision::FlowField field;
  const auto depth = std::make_unique<vision::DepthGrid>();
  const auto printed = std::make_unique<vision::PrintedDepthGrid>();
  grid.track(first, second, field);
  const auto begin = std::chrono::steady_clock::now();
  vision::flow_depth({}, lens, field, camera, *depth);
  tally.times_us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
  vision::flow_depth_printed({}, lens, field, camera, *printed);
  for (std::size_t i = 0; i < static_cast<std::size_t>(field.count()); ++i) {
    const std::optional<float> known = truth(field.cells[i]);
    if (!known) continue;
    const auto error = [&](float depth_m) { return static_cast<double>(std::abs(depth_m / *known - 1.f)); };
    tally.cells += 1;
    if ((*depth)[i].valid) tally.valid += 1, tally.relative.push_back(error((*depth)[i].depth_m));
    if ((*printed)[i].valid_u) tally.printed_u.push_back(error((*printed)[i].from_u_m));
    if ((*printed)[i].valid_v) tally.printed_v.push_back(error((*printed)[i].from_v_m));
  }
}

Pose read_pose(const fs::path& file) {
  const auto p = read_list(file, 7);
  const auto f = [&](std::size_t i) { return static_cast<float>(p[i]); };
  return {Quat(f(6), f(3), f(4), f(5)).normalized().toRotationMatrix(), Vec3(f(0), f(1), f(2))};
}

void run_depth_pair(const drivers::Recording& recording, int repeat, Tally& tally) {
  const fs::path& folder = recording.folder();
  const auto first = drivers::load_gray8(folder / "img_prev.png"),
             second = drivers::load_gray8(folder / "img_curr.png");
  std::vector<std::uint16_t> depth(recording.depth_size().pixels());
  recording.load_depth(0, depth);
  const int width = recording.depth_size().width_px, height = recording.depth_size().height_px;
  vision::Lens lens;
  lens.intrinsics = recording.intrinsics();
  const auto truth = [&](const vision::FlowCell& cell) -> std::optional<float> {
    std::vector<std::uint16_t> near;  // median of 11 x 11 pixels that have depth
    for (long v = std::lround(cell.y_px) - 5; v <= std::lround(cell.y_px) + 5; ++v)
      for (long u = std::lround(cell.x_px) - 5; u <= std::lround(cell.x_px) + 5; ++u)
        if (u >= 0 && v >= 0 && u < width && v < height && depth[static_cast<std::size_t>(v * width + u)] > 0)
          near.push_back(depth[static_cast<std::size_t>(v * width + u)]);
    if (near.size() < 20) return std::nullopt;
    std::nth_element(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(near.size() / 2), near.end());
    return static_cast<float>(near[near.size() / 2]) / 1000.f;
  };
  vision::FlowGrid grid(first.width_px, first.height_px, {});
  const auto camera = step_between(read_pose(folder / "pose_prev.txt"), read_pose(folder / "pose_curr.txt"));
  for (int i = 0; i < repeat; ++i) run_pair(lens, first.view(), second.view(), camera, truth, grid, tally);
}

/// K.txt is 3 x 3; D.txt has k1, k2 of a polynomial in undistorted pixels, which with f_x = f_y is ours times f^2, f^4.
vision::Lens read_lens(const fs::path& folder, const MotionFrame& frame) {
  const auto k = read_list(folder / "K.txt", 9), d = read_list(folder / "D.txt", 2);
  vision::Lens lens;
  const double f2 = k[0] * k[4];
  lens.intrinsics = {.width_px = frame.width_px,
                     .height_px = frame.height_px,
                     .fx_px = static_cast<float>(k[0]),
                     .fy_px = static_cast<float>(k[4]),
                     .cx_px = static_cast<float>(k[2]),
                     .cy_px = static_cast<float>(k[5]),
                     .k1 = static_cast<float>(d[0] * f2),
                     .k2 = static_cast<float>(d[1] * f2 * f2)};
  return lens;
}

/// The convex quadrilateral of the board's outer corners, grown by nothing: is the pixel inside?
bool inside(const std::array<vision::Pixel, 4>& quad, float u, float v) {
  int left = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const vision::Pixel &a = quad[i], &b = quad[(i + 1) % 4];
    left += (b.u_px - a.u_px) * (v - a.v_px) - (b.v_px - a.v_px) * (u - a.u_px) > 0 ? 1 : 0;
  }
  return left == 0 || left == 4;
}

struct BoardFrame {
  Pose pose;
  Vec3 normal_cam, translation;
  Mat3 R_cam_world;
  float distance_m = 0;
};

BoardFrame board_frame(const std::map<std::string, double>& row) {
  const auto get = [&](const char* name) { return static_cast<float>(row.at(name)); };
  const Vec3 r(get("rvec_x"), get("rvec_y"), get("rvec_z"));
  BoardFrame f;
  f.R_cam_world =
      r.norm() > 0 ? Mat3(Eigen::AngleAxisf(r.norm(), r.normalized()).toRotationMatrix()) : Mat3(Mat3::Identity());
  f.translation = Vec3(get("t_x_m"), get("t_y_m"), get("t_z_m"));
  f.pose = {f.R_cam_world.transpose(), -(f.R_cam_world.transpose() * f.translation)};
  f.normal_cam = Vec3(get("plane_nx"), get("plane_ny"), get("plane_nz"));
  f.distance_m = get("plane_dist_m");
  return f;
}

/// Inner corners are 9 x 6 at 40 mm; the outer edge of the board is one square further out.
std::array<vision::Pixel, 4> board_outline(const vision::Lens& lens, const BoardFrame& frame) {
  constexpr float kSquareM = 0.04f;
  const std::array<std::array<float, 2>, 4> corners = {{{-1, -1}, {9, -1}, {9, 6}, {-1, 6}}};
  std::array<vision::Pixel, 4> quad;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 board(corners[i][0] * kSquareM, corners[i][1] * kSquareM, 0.f);
    vision::pixel_of(lens, frame.R_cam_world * board + frame.translation, quad[i]);
  }
  return quad;
}

void run_board(const fs::path& folder, Tally& tally) {
  const auto frames = read_sequence(folder);
  const auto table = read_numbers(folder / "poses.csv");
  const vision::Lens lens = read_lens(folder, frames.front());
  vision::FlowGrid grid(frames.front().width_px, frames.front().height_px, {});
  for (std::size_t i = 0; i + 1 < frames.size(); ++i) {
    const auto a = table.find(frames[i].number), b = table.find(frames[i + 1].number);
    if (a == table.end() || b == table.end()) continue;
    const BoardFrame first = board_frame(a->second), second = board_frame(b->second);
    const auto outline = board_outline(lens, first);
    const auto truth = [&](const vision::FlowCell& cell) -> std::optional<float> {
      Vec3 d;
      if (!inside(outline, cell.x_px, cell.y_px) || !vision::direction_of(lens, {cell.x_px, cell.y_px}, d))
        return std::nullopt;
      return first.distance_m / first.normal_cam.dot(d) * d.z();
    };
    run_pair(lens, frames[i].view(), frames[i + 1].view(), step_between(first.pose, second.pose), truth, grid, tally);
  }
}

}  // namespace

std::vector<Figure> eval_flow_depth(const drivers::Recording& recording, const EvalOptions& options) {
  const fs::path& folder = recording.folder();
  Tally tally;
  if (fs::exists(folder / "pose_prev.txt")) {
    run_depth_pair(recording, options.repeat, tally);
  } else if (fs::exists(folder / "poses.csv")) {
    run_board(folder, tally);
  } else {
    throw std::runtime_error(folder.string() + ": neither pose_prev.txt nor poses.csv");
  }
  if (tally.relative.empty()) throw std::runtime_error(folder.string() + ": no cell with depth");
  const Spread error = spread(tally.relative);
  std::vector<Figure> figures{{"cells", tally.cells, ""},
                              {"depth_share", tally.valid / tally.cells, ""},
                              {"relative_error_median", error.median, "", kMedianRelativeError},
                              {"relative_error_p95", error.p95, ""}};
  if (!tally.printed_u.empty()) figures.push_back({"printed_u_median", spread(tally.printed_u).median, ""});
  if (!tally.printed_v.empty()) figures.push_back({"printed_v_median", spread(tally.printed_v).median, ""});
  add_times(figures, tally.times_us);
  return figures;
}

}  // namespace wasp::tools
