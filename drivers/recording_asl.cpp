// EuRoC ASL (Burri et al., IJRR 2016): mav0/ with cam0/data.csv ("ns,file") and cam0/data/, sensor.yaml beside each
// data.csv, imu0/ (gyro rad/s, accelerometer m/s^2) and state_groundtruth_estimate0/ or mocap0/ (position, quaternion
// w x y z of the body, world z up). Opened by the folder that holds mav0, by mav0, by cam0, or as a flat excerpt: a
// folder cam0_X of images with cam0_sensor.yaml, imu_X.csv and gt_X.csv beside it. Without data.csv the images' names
// are their times.
#include <charconv>

#include "drivers/image_file.h"
#include "drivers/motion_tables.h"
#include "drivers/recording_folder.h"
#include "drivers/sensor_yaml.h"
#include "drivers/text_rows.h"

namespace wasp::drivers {
namespace {

namespace fs = std::filesystem;

/// Where the parts of one recording lie; files that are not there are empty streams.
struct Parts {
  fs::path images, index, camera_yaml, imu, imu_yaml, truth, truth_yaml;
};

Parts parts_of_mav(const fs::path& mav) {
  Parts parts{mav / "cam0" / "data",      mav / "cam0" / "data.csv",    mav / "cam0" / "sensor.yaml",
              mav / "imu0" / "data.csv", mav / "imu0" / "sensor.yaml", {}, {}};
  for (const char* name : {"state_groundtruth_estimate0", "mocap0"})
    if (parts.truth.empty() && fs::exists(mav / name / "data.csv"))
      parts.truth = mav / name / "data.csv", parts.truth_yaml = mav / name / "sensor.yaml";
  return parts;
}

/// "…/cam0_static" -> cam0_sensor.yaml, imu_static.csv, gt_static.csv beside it.
Parts parts_of_flat(const fs::path& images) {
  const fs::path beside = images.parent_path();
  const std::string name = images.filename().string();
  Parts parts{images, images / "data.csv", beside / "cam0_sensor.yaml", {}, beside / "imu0_sensor.yaml", {}, {}};
  if (name.starts_with("cam0_"))
    parts.imu = beside / ("imu_" + name.substr(5) + ".csv"), parts.truth = beside / ("gt_" + name.substr(5) + ".csv");
  else
    parts.camera_yaml = images / "sensor.yaml";
  return parts;
}

/// A name that is a time in nanoseconds since 1970 (19 digits; 16 and more are taken for one).
bool is_time(const std::string& name) {
  const std::size_t digits = name.find_first_not_of("0123456789");
  return digits != std::string::npos && digits >= 16 && digits <= 19 && name.substr(digits) == ".png";
}

std::optional<Parts> parts_of(const fs::path& folder, const Names& names) {
  if (fs::exists(folder / "mav0" / "cam0" / "data.csv")) return parts_of_mav(folder / "mav0");
  if (fs::exists(folder / "cam0" / "data.csv")) return parts_of_mav(folder);
  const fs::path real = fs::canonical(folder);
  if (contains(names, "data.csv") && fs::is_directory(folder / "data") && real.filename() == "cam0")
    return parts_of_mav(real.parent_path());
  for (const std::string& name : names)
    if (is_time(name)) return parts_of_flat(real);
  for (const std::string& name : folder_names(folder))
    if (name.starts_with("cam0_") && fs::exists(folder / name / "data.csv")) return parts_of_flat(real / name);
  return std::nullopt;
}

void add_frame(const Parts& parts, TimeNs time_ns, const std::string& name, std::string origin, Listing& listing) {
  const auto index = static_cast<std::uint32_t>(listing.frames.size());
  listing.frames.push_back({time_ns, index, {}, parts.images / name, std::move(origin)});
}

void list_by_index(const Parts& parts, Listing& listing) {
  visit_rows(parts.index, [&](const TextRow& row) {
    TimeNs time_ns = 0;
    if (row.line == 1 && row.fields[0].starts_with("timestamp")) return;
    if (row.fields.size() != 2 || !parse_nanoseconds(row.fields[0], time_ns) || row.fields[1].empty())
      return listing.problems.add_line(ProblemKind::kUnreadable, parts.index, row.line, "expected <nanoseconds>,<file>");
    add_frame(parts, time_ns, std::string(row.fields[1]), parts.index.string() + ":" + std::to_string(row.line),
              listing);
  });
  tell_unlisted(parts.images, listing.frames, listing.problems);
}

void list_by_name(const Parts& parts, Listing& listing) {
  if (!fs::is_directory(parts.images)) return;
  for (const std::string& name : file_names(parts.images)) {
    TimeNs time_ns = 0;
    if (!is_time(name)) continue;
    if (parse_nanoseconds(name.substr(0, name.find('.')), time_ns))
      add_frame(parts, time_ns, name, name, listing);
    else
      listing.problems.add(ProblemKind::kUnreadable, parts.images, (parts.images / name).string() + ": no time in nanoseconds");
  }
}

/// A yaml that is no good is a problem, and what it would have said stays unknown.
SensorYaml yaml_of(const fs::path& file, Listing& listing) try {
  return fs::exists(file) ? read_sensor_yaml(file) : SensorYaml{};
} catch (const std::runtime_error& error) {
  listing.problems.add(ProblemKind::kDamaged, file, error.what());
  return {};
}

std::optional<Eigen::Matrix3d> rotation_of(const SensorYaml& yaml) {
  if (!yaml.T_body_sensor) return std::nullopt;
  return Eigen::Matrix3d(yaml.T_body_sensor->topLeftCorner<3, 3>());
}

void read_camera(const SensorYaml& yaml, Listing& listing) {
  if (yaml.rate_hz) listing.nominal_rate_hz = *yaml.rate_hz;
  if (!yaml.lens) {
    if (!listing.frames.empty()) assume_centred(listing.frames.front().gray_file, listing);
    listing.notes.emplace_back("no sensor.yaml of the camera: focal length 525 px assumed, centred");
    return;
  }
  listing.intrinsics = yaml.lens->intrinsics;
  listing.lens_kind = yaml.lens->kind;
  listing.fisheye_k = yaml.lens->fisheye_k;
}

void read_motion(const Parts& parts, const SensorYaml& camera, Listing& listing) {
  RecordingMotion& motion = listing.motion;
  const auto R_body_cam = rotation_of(camera), R_body_imu = rotation_of(yaml_of(parts.imu_yaml, listing)),
             R_body_truth = rotation_of(yaml_of(parts.truth_yaml, listing));
  read_inertial(parts.imu, {}, motion.inertial, listing.problems);
  if (R_body_cam)
    motion.inertial.R_cam_imu = R_body_cam->transpose() * R_body_imu.value_or(Eigen::Matrix3d::Identity());
  read_poses(parts.truth, {}, motion.poses, listing.problems);
  motion.poses.level = true;
  if (R_body_cam)
    motion.poses.R_sensor_cam = R_body_truth.value_or(Eigen::Matrix3d::Identity()).transpose() * *R_body_cam;
}

}  // namespace

std::optional<Listing> list_asl(const fs::path& folder, const Names& names) {
  const auto parts = parts_of(folder, names);
  if (!parts) return std::nullopt;
  Listing listing{.layout = "asl"};
  listing.nominal_rate_hz = 20.0;
  if (fs::exists(parts->index))
    list_by_index(*parts, listing);
  else
    list_by_name(*parts, listing);
  if (listing.frames.empty() && listing.problems.total() == 0) return std::nullopt;
  const SensorYaml camera = yaml_of(parts->camera_yaml, listing);
  read_camera(camera, listing);
  read_motion(*parts, camera, listing);
  return listing;
}

}  // namespace wasp::drivers
