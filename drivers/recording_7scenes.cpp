// 7-Scenes (Shotton et al., CVPR 2013): frame-XXXXXX.depth.png in millimetres, .color.png, .pose.txt (4x4, camera to a
// world whose vertical nobody states), at 30 Hz by number. A number that is missing is a frame that was dropped.
#include <array>
#include <cmath>
#include <set>

#include "drivers/recording_folder.h"
#include "drivers/text_rows.h"

namespace wasp::drivers {
namespace {

namespace fs = std::filesystem;

/// Sixteen numbers of a rigid motion; throws std::runtime_error for anything else.
PoseSample read_pose(const fs::path& file) {
  std::vector<double> numbers;
  visit_rows(file, [&](const TextRow& row) {
    std::array<double, 4> four{};
    if (row.fields.size() != 4 || !parse_numbers(row, 0, four))
      throw std::runtime_error(file.string() + ":" + std::to_string(row.line) + ": expected four numbers");
    numbers.insert(numbers.end(), four.begin(), four.end());
  });
  if (numbers.size() != 16)
    throw std::runtime_error(file.string() + ": expected four rows, found " + std::to_string(numbers.size() / 4));
  const Eigen::Matrix4d T = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data());
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const double off = (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off < 0.02 && R.determinant() > 0)) throw std::runtime_error(file.string() + ": holds no rotation");
  PoseSample pose;
  pose.position_m = T.topRightCorner<3, 1>();
  pose.q_world_sensor = Eigen::Quaterniond(R).normalized();
  return pose;
}

void read_poses(const fs::path& folder, const Names& names, Listing& listing) {
  PoseStream& poses = listing.motion.poses;
  const auto files = numbered(names, "frame-", ".pose.txt");
  if (files.empty()) return;
  poses.source = (folder / "frame-*.pose.txt").string();
  poses.R_sensor_cam = Eigen::Matrix3d::Identity();
  for (const ListedFrame& frame : listing.frames) {
    const auto file = files.find(frame.sequence);
    if (file == files.end()) {
      listing.problems.add(ProblemKind::kAlone, folder, frame.any_file().string() + ": has no .pose.txt beside it");
      continue;
    }
    try {
      poses.samples.push_back(read_pose(folder / file->second));
      poses.samples.back().time_ns = frame.time_ns;
    } catch (const std::runtime_error& error) {
      listing.problems.add(ProblemKind::kDamaged, folder, error.what());
    }
  }
}

}  // namespace

std::optional<Listing> list_7scenes(const fs::path& folder, const Names& names) {
  const auto depth = numbered(names, "frame-", ".depth.png"), color = numbered(names, "frame-", ".color.png");
  if (depth.empty()) return std::nullopt;
  Listing listing{.layout = "7scenes"};
  listing.intrinsics = pinhole(640, 480, 585.f, 585.f, 320.f, 240.f);
  std::set<std::uint32_t> numbers;
  for (const auto& files : {depth, color})
    for (const auto& [number, name] : files) numbers.insert(number);
  const auto file = [&](const auto& files, std::uint32_t number) {
    const auto found = files.find(number);
    return found == files.end() ? fs::path{} : folder / found->second;
  };
  for (const std::uint32_t number : numbers) {
    ListedFrame frame{at_rate(number - *numbers.begin(), listing.nominal_rate_hz), number, file(depth, number),
                      file(color, number), {}};
    frame.origin = frame.any_file().filename().string();
    if (!color.empty() && (frame.depth_file.empty() || frame.gray_file.empty()))
      listing.problems.add(ProblemKind::kAlone, folder,
                           frame.any_file().string() + ": has no " +
                               (frame.gray_file.empty() ? ".color.png" : ".depth.png") + " beside it");
    listing.frames.push_back(std::move(frame));
  }
  read_poses(folder, names, listing);
  if (!color.empty()) listing.notes.emplace_back("colour and depth are not registered to each other; intrinsics are the depth camera's nominal ones");
  return listing;
}

}  // namespace wasp::drivers
