// TUM RGB-D (Sturm et al., IROS 2012) and wasp's own recordings, which are of the same layout: rgb.txt and depth.txt name
// the images, groundtruth.txt has camera poses by motion capture (tx ty tz qx qy qz qw, world z up), accelerometer.txt
// three numbers a row. camera.toml is wasp's, and so is imu.csv, in the folder or in log/ beside it.
#include <charconv>

#include "drivers/motion_tables.h"
#include "drivers/recording_folder.h"
#include "drivers/recording_index.h"

namespace wasp::drivers {
namespace {

constexpr DurationNs kPairTolerance = 20 * kMillisecond;  // associate.py's

/// The intrinsics TUM publishes for its three cameras (colour, without distortion), by the number N of "freiburgN".
Intrinsics freiburg(int number) {
  return number == 1   ? pinhole(640, 480, 517.3f, 516.5f, 318.6f, 255.3f)
         : number == 2 ? pinhole(640, 480, 520.9f, 521.0f, 325.1f, 249.7f)
                       : pinhole(640, 480, 535.4f, 539.2f, 320.1f, 247.6f);
}

/// The index names the sequence it is of: "file: 'rgbd_dataset_freiburg1_xyz.bag'".
void note_camera(std::string_view comment, Listing& listing) {
  constexpr std::string_view kName = "freiburg";
  const auto at = comment.find(kName);
  if (at == std::string_view::npos || at + kName.size() >= comment.size()) return;
  const int number = comment[at + kName.size()] - '0';
  if (number < 1 || number > 3 || !listing.notes.empty()) return;
  listing.intrinsics = freiburg(number);
  listing.notes.push_back("intrinsics: those published for freiburg" + std::to_string(number) + ", named in the index");
}

/// `wasp`: a recording of ours, with the log of the inertial samples (body axes) in the folder or beside it.
void read_motion(const std::filesystem::path& folder, bool wasp, Listing& listing) {
  // Of the Kinect's accelerometer the benchmark says nothing: its axes stay unknown.
  InertialStream& inertial = listing.motion.inertial;
  read_inertial(folder / "accelerometer.txt", {TimeUnit::kSeconds, -1, 1}, inertial, listing.problems);
  for (const auto& log : {folder / "imu.csv", folder / ".." / "log" / "imu.csv"})
    if (inertial.samples.empty() && wasp) read_inertial(log, {TimeUnit::kNanoseconds, 6, 3}, inertial, listing.problems);
  if (inertial.has_gyro && listing.pitch_down)
    inertial.R_cam_imu =
        R_body_cam_from_pitch_down(*listing.pitch_down).transpose().cast<double>();
  PoseStream& poses = listing.motion.poses;
  read_poses(folder / "groundtruth.txt", {TimeUnit::kSeconds, 1, 4, QuaternionOrder::kXyzw}, poses, listing.problems);
  poses.level = true;
  poses.R_sensor_cam = Eigen::Matrix3d::Identity();
}

}  // namespace

std::optional<Listing> list_tum(const std::filesystem::path& folder, const Names& names) {
  if (!contains(names, "depth.txt") && !contains(names, "rgb.txt")) return std::nullopt;
  Listing listing{.layout = "tum"};
  listing.depth_units_per_m = 5000.0;
  const auto comment = [&](std::string_view text) { note_camera(text, listing); };
  std::vector<ListedFrame> depth, gray;
  if (contains(names, "depth.txt")) depth = read_index(folder / "depth.txt", true, listing.problems, comment);
  if (contains(names, "rgb.txt")) gray = read_index(folder / "rgb.txt", false, listing.problems, comment);
  const bool wasp = contains(names, "camera.toml");
  if (wasp) read_camera_toml(folder / "camera.toml", listing);
  listing.frames = pair_frames(depth, gray, kPairTolerance);
  read_motion(folder, wasp, listing);
  return listing;
}

}  // namespace wasp::drivers
