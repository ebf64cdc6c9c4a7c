// Rawseeds (Bonarini et al., 2006; Ceriani et al., 2009): a session's folder holds one folder of images a camera
// (FRONTAL, SVS_L, SVS_R, SVS_T, OMNI) with CAMERA_<seconds>.<microseconds>.png, and tables without heading:
//   SESSION-IMU_STRETCHED.csv  seconds, counter, acceleration (3, m/s^2), angular rate (3, rad/s), magnetic field (3),
//                              orientation (9)
//   SESSION-GROUNDTRUTH.csv    seconds, x, y, heading, covariance (9)
//   SESSION-LISTS/SESSION-CAMERA.lst and .csv: names and times of all images, where unpacked
// The data themselves are no longer served; this is what published readers of them say (docs/recordings.md names them).
// The camera's axes against the robot's (forward, left, up), for FRONTAL: forward is z, left is -x, up is -y.
#include "drivers/motion_tables.h"
#include "drivers/recording_folder.h"
#include "drivers/text_rows.h"

namespace wasp::drivers {
namespace {

namespace fs = std::filesystem;

constexpr std::array kCameras = {"FRONTAL", "SVS_L", "SVS_R", "SVS_T", "OMNI"};

/// "FRONTAL_1235604664.906455.png" of camera "FRONTAL".
bool parse_name(const std::string& name, const std::string& camera, TimeNs& time_ns) {
  if (!name.starts_with(camera + "_") || !name.ends_with(".png")) return false;
  const std::string seconds = name.substr(camera.size() + 1, name.size() - camera.size() - 5);
  return seconds.find('.') != std::string::npos && parse_seconds(seconds, time_ns);
}

struct Parts {
  fs::path session, images;
  std::string camera;
};

/// The camera whose images lie in a folder; empty: none.
std::string camera_in(const fs::path& folder) {
  if (!fs::is_directory(folder)) return {};
  TimeNs time_ns = 0;
  for (const std::string& name : file_names(folder))
    for (const char* camera : kCameras)
      if (parse_name(name, camera, time_ns)) return camera;
  return {};
}

std::optional<Parts> parts_of(const fs::path& folder) {
  const fs::path real = fs::canonical(folder);
  if (const std::string camera = camera_in(real); !camera.empty()) return Parts{real.parent_path(), real, camera};
  for (const char* camera : kCameras)
    if (camera_in(real / camera) == camera) return Parts{real, real / camera, camera};
  return std::nullopt;
}

/// The session's file that ends so; empty: none.
fs::path table(const fs::path& session, const std::string& ending) {
  for (const std::string& name : file_names(session))
    if (name.ends_with(ending)) return session / name;
  return {};
}

/// Images that the session's own list names and that are not there.
void check_list(const Parts& parts, Listing& listing) {
  for (const std::string& folder : folder_names(parts.session)) {
    if (!folder.ends_with("LISTS")) continue;
    const fs::path list = table(parts.session / folder, "-" + parts.camera + ".lst");
    if (list.empty()) continue;
    visit_rows(list, [&](const TextRow& row) {
      const fs::path file = parts.images / fs::path(row.fields[0]).filename();
      if (!fs::exists(file))
        listing.problems.add_line(ProblemKind::kMissing, list, row.line, file.string() + ": is not there");
    });
  }
}

void list_images(const Parts& parts, Listing& listing) {
  for (const std::string& name : file_names(parts.images)) {
    TimeNs time_ns = 0;
    if (parse_name(name, parts.camera, time_ns)) {
      const auto index = static_cast<std::uint32_t>(listing.frames.size());
      listing.frames.push_back({time_ns, index, {}, parts.images / name, name});
    } else if (name.ends_with(".png")) {
      listing.problems.add(ProblemKind::kUnreadable, parts.images, (parts.images / name).string() + ": no time in its name");
    }
  }
  std::stable_sort(listing.frames.begin(), listing.frames.end(),
                   [](const auto& a, const auto& b) { return a.time_ns < b.time_ns; });
}

void read_motion(const Parts& parts, Listing& listing) {
  RecordingMotion& motion = listing.motion;
  Eigen::Matrix3d R_robot_cam;
  R_robot_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  if (const fs::path imu = table(parts.session, "IMU_STRETCHED.csv"); !imu.empty())
    read_inertial(imu, {TimeUnit::kSeconds, 5, 2}, motion.inertial, listing.problems);
  if (const fs::path truth = table(parts.session, "GROUNDTRUTH.csv"); !truth.empty())
    read_planar_poses(truth, motion.poses, listing.problems);
  motion.poses.level = true;
  if (parts.camera != "FRONTAL") return;
  motion.inertial.R_cam_imu = R_robot_cam.transpose();  // the IMU's axes are the robot's
  motion.poses.R_sensor_cam = R_robot_cam;
}

}  // namespace

std::optional<Listing> list_rawseeds(const fs::path& folder, const Names&) {
  const auto parts = parts_of(folder);
  if (!parts) return std::nullopt;
  Listing listing{.layout = "rawseeds"};
  listing.notes.push_back("camera " + parts->camera + "; focal length 525 px assumed, centred: the calibration is a MATLAB file");
  list_images(*parts, listing);
  assume_centred(listing.frames.front().gray_file, listing);
  if (parts->camera == "FRONTAL") listing.pitch_down = Radians{0.0};
  check_list(*parts, listing);
  read_motion(*parts, listing);
  return listing;
}

}  // namespace wasp::drivers
