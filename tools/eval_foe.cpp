// Focus of expansion against the camera's true motion, as the angle between the two directions. Truth is either
// motion_per_frame.csv with K.txt (translation and turn from frame to frame: the flow is de-rotated by the table), or a
// dense ground-truth flow (flow<N>.flo, not_sky<N>.png if there), to whose cells focus and turn are fitted together.
#include <chrono>
#include <cmath>
#include <fstream>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "drivers/image_file.h"
#include "tools/eval_kernels.h"
#include "tools/eval_motion.h"
#include "vision/kernels/derotate.h"
#include "vision/kernels/foe.h"

namespace wasp::tools {
namespace {

namespace fs = std::filesystem;

constexpr double kDegree = 180.0 / std::numbers::pi;
constexpr float kFocalPerWidth = 337.5f / 316.f;  // the rendered fly-through's own; assumed where no K.txt says more

struct MotionTruth {
  long from = 0;  ///< frame number; the motion is to the next frame of the sequence
  Vec3 direction_cam, rotation_rad;
};

Intrinsics read_intrinsics(const fs::path& folder, const MotionFrame& frame) {
  Intrinsics k{.width_px = frame.width_px, .height_px = frame.height_px};
  k.fx_px = k.fy_px = kFocalPerWidth * static_cast<float>(frame.width_px);
  k.cx_px = 0.5f * static_cast<float>(frame.width_px - 1), k.cy_px = 0.5f * static_cast<float>(frame.height_px - 1);
  std::ifstream in(folder / "K.txt");
  float m[9];
  if (!in) return k;
  for (float& value : m)
    if (!(in >> value)) throw std::runtime_error((folder / "K.txt").string() + ": expected nine numbers");
  k.fx_px = m[0], k.cx_px = m[2], k.fy_px = m[4], k.cy_px = m[5];
  return k;
}

Vec3 direction_of(const Intrinsics& k, const vision::Foe& foe) {
  const Vec3 ray((foe.x_px - k.cx_px) / k.fx_px, (foe.y_px - k.cy_px) / k.fy_px, 1.f);
  return (foe.expanding ? 1.f : -1.f) * ray.normalized();
}

double angle_deg(const Vec3& a, const Vec3& b) {
  return kDegree * std::atan2(static_cast<double>(a.cross(b).norm()), static_cast<double>(a.dot(b)));
}

/// Ground-truth flow at the cells of the grid's own layout, 16 x 12, away from the border.
struct FloFile {
  int width = 0, height = 0;
  std::vector<float> uv;
};

FloFile read_flo(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  float tag = 0;
  std::int32_t size[2] = {0, 0};
  in.read(reinterpret_cast<char*>(&tag), sizeof tag);
  in.read(reinterpret_cast<char*>(size), sizeof size);
  if (!in || tag != 202021.25f || size[0] < 1 || size[1] < 1 || size[0] > 16384 || size[1] > 16384)
    throw std::runtime_error(file.string() + ": not a .flo file");
  FloFile flo{size[0], size[1], {}};
  flo.uv.resize(2 * static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]));
  in.read(reinterpret_cast<char*>(flo.uv.data()), static_cast<std::streamsize>(flo.uv.size() * sizeof(float)));
  if (!in) throw std::runtime_error(file.string() + ": shorter than its header says");
  return flo;
}

vision::FlowField sampled(const FloFile& flo, const std::vector<std::uint8_t>& mask) {
  vision::FlowField field;
  field.columns = vision::FlowField::kMaxColumns, field.rows = vision::FlowField::kMaxRows;
  for (int r = 0; r < field.rows; ++r)
    for (int c = 0; c < field.columns; ++c) {
      const int x = (2 * c + 1) * flo.width / (2 * field.columns), y = (2 * r + 1) * flo.height / (2 * field.rows);
      const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(flo.width) + static_cast<std::size_t>(x);
      const float u = flo.uv[2 * at], v = flo.uv[2 * at + 1];
      const bool known = std::abs(u) < 1e9f && std::abs(v) < 1e9f && (at >= mask.size() || mask[at] != 0);
      field.at(c, r) = {
          static_cast<float>(x), static_cast<float>(y), u, v, 1.f, 0.f, static_cast<std::uint8_t>(known ? 1 : 0)};
    }
  return field;
}

/// Truth from flow<N>.flo by a joint fit; its own uncertainty is printed beside the errors.
std::vector<MotionTruth> truth_from_flow(const fs::path& folder, const Intrinsics& k, std::vector<Figure>& figures) {
  std::vector<MotionTruth> truths;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string stem = entry.path().stem().string();
    if (entry.path().extension() != ".flo" || !stem.starts_with("flow") || stem.size() < 5) continue;
    const std::string number = stem.substr(4);
    if (number.find_first_not_of("0123456789") != std::string::npos) continue;
    std::vector<std::uint8_t> mask;
    if (const fs::path sky = folder / ("not_sky" + number + ".png"); fs::exists(sky))
      mask = drivers::load_gray8(sky).pixels;
    const auto foe = vision::find_foe_and_rotation({}, sampled(read_flo(entry.path()), mask), k);
    if (!foe.valid) continue;
    truths.push_back({std::stol(number), direction_of(k, foe), foe.rotation_rad});
    figures.push_back({"truth_fit_residual", static_cast<double>(foe.residual_px), "px"});
    figures.push_back({"truth_fit_sigma", static_cast<double>(foe.sigma_px / k.fx_px) * kDegree, "deg"});
    figures.push_back({"truth_foe_x", static_cast<double>(foe.x_px), "px"});
    figures.push_back({"truth_foe_y", static_cast<double>(foe.y_px), "px"});
  }
  return truths;
}

std::vector<MotionTruth> truth_from_table(const NumberTable& table) {
  std::vector<MotionTruth> truths;
  for (const auto& [frame, row] : table) {
    const auto at = [&row](const char* name) { return static_cast<float>(row.at(name)); };
    truths.push_back(
        {frame, Vec3(at("tx_m"), at("ty_m"), at("tz_m")).normalized(), Vec3(at("rx_rad"), at("ry_rad"), at("rz_rad"))});
  }
  return truths;
}

/// Errors of one way to find the focus.
struct Errors {
  std::string name;
  std::vector<double> degrees;
  double tried = 0, valid = 0;

  void add(const vision::Foe& foe, const Intrinsics& k, const Vec3& truth) {
    tried += 1;
    if (!foe.valid) return;
    valid += 1;
    degrees.push_back(angle_deg(direction_of(k, foe), truth));
  }
  void print(std::vector<Figure>& figures) const {
    const Spread s = spread(degrees);
    figures.push_back({name + "_valid_share", valid / tried, ""});
    figures.push_back({name + "_error_median", s.median, "deg"});
    figures.push_back({name + "_error_max", s.max, "deg"});
  }
};

struct Ways {
  Errors derotated{"derotated", {}}, solved{"turn_solved", {}}, raw{"not_derotated", {}}, printed{"printed", {}};
  std::vector<double> times_us;
};

void try_pair(Ways& ways, const Intrinsics& k, const MotionTruth& truth, const vision::FlowField& flow) {
  vision::FlowField derotated = flow;
  const float angle = truth.rotation_rad.norm();
  if (angle > 0.f) {
    const Mat3 R_first_second = Eigen::AngleAxisf(angle, truth.rotation_rad / angle).toRotationMatrix();
    vision::derotate({.intrinsics = k}, flow, R_first_second.transpose(), derotated);
  }
  const auto begin = std::chrono::steady_clock::now();
  const vision::Foe foe = vision::find_foe({}, derotated);
  ways.times_us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
  ways.derotated.add(foe, k, truth.direction_cam);
  ways.solved.add(vision::find_foe_and_rotation({}, flow, k), k, truth.direction_cam);
  ways.raw.add(vision::find_foe({}, flow), k, truth.direction_cam);
  ways.printed.add(vision::printed_foe({}, derotated), k, truth.direction_cam);
}

}  // namespace

std::vector<Figure> eval_foe(const drivers::Recording& recording, const EvalOptions&) {
  const auto frames = read_sequence(recording.folder());
  const Intrinsics k = read_intrinsics(recording.folder(), frames[0]);
  std::vector<Figure> figures{{"frames", static_cast<double>(frames.size()), ""},
                              {"focal_length", static_cast<double>(k.fx_px), "px"}};
  const NumberTable table = read_numbers(recording.folder() / "motion_per_frame.csv");
  const auto truths = table.empty() ? truth_from_flow(recording.folder(), k, figures) : truth_from_table(table);
  if (truths.empty())
    throw std::runtime_error(recording.folder().string() + ": no motion_per_frame.csv or flow<N>.flo to compare with");
  Ways ways;
  WindowFlow flow(frames[0].width_px, frames[0].height_px);
  for (std::size_t i = 0; i + 1 < frames.size(); ++i)
    for (const MotionTruth& truth : truths) {
      if (truth.from != frames[i].number || frames[i + 1].number != truth.from + 1) continue;
      try_pair(ways, k, truth, flow.track(frames[i], frames[i + 1], {0, 0, k.width_px, k.height_px}));
    }
  figures.push_back({"pairs", ways.derotated.tried, ""});
  for (const Errors* errors : {&ways.derotated, &ways.solved, &ways.raw, &ways.printed}) errors->print(figures);
  add_times(figures, ways.times_us);
  return figures;
}

}  // namespace wasp::tools
