// The hover_mocap layout: test<N>.png of a camera that looks down, 320x240 at 60 Hz; gt_per_frame.csv (frame, t_s, ...)
// and mocap_500hz_raw.csv (time_s, latest_image_frame, X, Y, Z, qx, qy, qz) of a motion capture.
//
// t_s is the capture's time minus the lag that the table's maker found; what the recorder itself knew of an image is the
// row in which its number first stands, and that is its stamp. The recorder hears of some images late, by up to 32 ms.
// Axes (the data's README): the body's z is up, image right is body y, image down is body x; the recorded quaternion
// (qx, qy, qz) is (-qy, qx, -qz) of the body in the world.
#include <charconv>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "drivers/motion_tables.h"
#include "drivers/recording_folder.h"
#include "drivers/text_rows.h"

namespace wasp::drivers {
namespace {

namespace fs = std::filesystem;

constexpr TimeNs kLongestClip = 1'000'000 * kSecond;
constexpr const char* kRaw = "mocap_500hz_raw.csv";

bool parse_frame(std::string_view text, std::uint32_t& out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc{} && end == text.data() + text.size();
}

/// t_s by frame number from gt_per_frame.csv (columns frame, t_s, ...).
std::map<std::uint32_t, TimeNs> frame_times(const fs::path& file, RecordingProblems& problems) {
  std::map<std::uint32_t, TimeNs> times;
  visit_rows(file, [&](const TextRow& row) {
    std::uint32_t frame = 0;
    TimeNs time_ns = 0;
    if (row.line == 1 && row.fields[0] == "frame") return;
    if (row.fields.size() < 2 || !parse_frame(row.fields[0], frame) || !parse_seconds(row.fields[1], time_ns) ||
        time_ns > kLongestClip)
      return problems.add_line(ProblemKind::kUnreadable, file, row.line, "expected <frame>,<seconds>,...");
    if (!times.emplace(frame, time_ns).second)
      problems.add_line(ProblemKind::kDuplicate, file, row.line, "frame " + std::to_string(frame) + " was there before");
  });
  return times;
}

/// A vector part that is too long for a unit quaternion is false.
bool quaternion_of(const std::array<double, 3>& q, Eigen::Quaterniond& out) {
  const double rest = 1.0 - q[0] * q[0] - q[1] * q[1] - q[2] * q[2];
  if (!(rest >= 0)) return false;
  out = Eigen::Quaterniond(std::sqrt(rest), -q[1], q[0], -q[2]);
  return true;
}

/// One table, two readings of it: the poses, and when the recorder first named each image.
struct Capture {
  PoseStream poses;
  std::map<std::uint32_t, TimeNs> first_named;
};

Capture read_capture(const fs::path& file, RecordingProblems& problems) {
  Capture capture;
  std::vector<int> lines;
  if (!fs::exists(file)) return capture;
  visit_rows(file, [&](const TextRow& row) {
    PoseSample pose;
    std::uint32_t frame = 0;
    std::array<double, 3> q{};
    if (row.line == 1 && row.fields[0] == "time_s") return;
    if (row.fields.size() != 8 || !parse_seconds(row.fields[0], pose.time_ns) || !parse_frame(row.fields[1], frame) ||
        !parse_numbers(row, 2, {pose.position_m.data(), 3}) || !parse_numbers(row, 5, q) ||
        !quaternion_of(q, pose.q_world_sensor))
      return problems.add_line(ProblemKind::kUnreadable, file, row.line, "expected time_s,frame,X,Y,Z,qx,qy,qz");
    capture.poses.samples.push_back(pose);
    lines.push_back(row.line);
    // The first row's image may have been there for long.
    if (capture.poses.samples.size() > 1) capture.first_named.emplace(frame, pose.time_ns);
  });
  drop_unordered(file, lines, capture.poses.samples, problems);
  capture.poses.source = file.string();
  return capture;
}

/// Camera against body: image right is body y, image down is body x.
Eigen::Matrix3d R_body_cam() {
  Eigen::Matrix3d R;
  R << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  return R;
}

}  // namespace

std::optional<Listing> list_hover(const fs::path& folder, const Names& names) {
  const auto files = numbered(names, "test", ".png");
  if (files.empty() || (!contains(names, "gt_per_frame.csv") && !contains(names, kRaw))) return std::nullopt;
  Listing listing{.layout = "hover_mocap"};
  listing.intrinsics = pinhole(320, 240, 390.f, 390.f, 159.5f, 119.5f);
  listing.pitch_down = Radians{std::numbers::pi / 2};
  listing.nominal_rate_hz = 60.0;
  std::map<std::uint32_t, TimeNs> times;
  if (contains(names, "gt_per_frame.csv")) times = frame_times(folder / "gt_per_frame.csv", listing.problems);
  Capture capture = read_capture(folder / kRaw, listing.problems);
  if (times.empty()) times = capture.first_named;
  const bool timed = !times.empty();
  if (!timed) listing.notes.emplace_back("no table of times could be read: frames stand on the 60 Hz grid");
  for (const auto& [number, name] : files) {
    ListedFrame frame{at_rate(number - files.begin()->first, 60.0), number, {}, folder / name, name};
    if (timed && !times.contains(number)) {
      listing.problems.add(ProblemKind::kAlone, folder, (folder / name).string() + ": no row of the tables has its time");
      continue;
    }
    if (timed) frame.time_ns = times.at(number);
    if (const auto named = capture.first_named.find(number); named != capture.first_named.end())
      frame.stamped_ns = named->second;
    listing.frames.push_back(std::move(frame));
  }
  for (const auto& [number, time_ns] : times)
    if (contains(names, "gt_per_frame.csv") && !files.contains(number))
      listing.problems.add(ProblemKind::kMissing, folder, (folder / "gt_per_frame.csv").string() + ": frame " +
                                                              std::to_string(number) + " has a row and no image");
  listing.motion.poses = std::move(capture.poses);
  listing.motion.poses.level = true;
  listing.motion.poses.R_sensor_cam = R_body_cam();
  listing.motion.poses.floor_z_m = 0.013;  // the data's README
  return listing;
}

/// A folder of such clips, played one after the other in order of their frame numbers, a tenth of a second apart. Their
/// motion is left out: its clock does not run through.
std::optional<Listing> list_hover_clips(const fs::path& folder, const Names&) {
  std::map<std::uint32_t, Listing> clips;
  for (const std::string& name : folder_names(folder))
    if (auto clip = list_hover(folder / name, file_names(folder / name)); clip && !clip->frames.empty())
      clips.emplace(clip->frames.front().sequence, *std::move(clip));
  if (clips.empty()) return std::nullopt;
  Listing all = clips.begin()->second;
  all.layout = "hover_mocap_clips";
  all.motion = {};
  for (auto next = std::next(clips.begin()); next != clips.end(); ++next) {
    const DurationNs shift_ns = all.frames.back().time_ns + 100 * kMillisecond - next->second.frames.front().time_ns;
    for (ListedFrame frame : next->second.frames) {
      frame.time_ns += shift_ns;
      all.frames.push_back(std::move(frame));
    }
    all.problems.append(next->second.problems);
  }
  return all;
}

}  // namespace wasp::drivers
