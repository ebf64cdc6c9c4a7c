#include "tools/recording_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace wasp::tools {
namespace {

using drivers::Recording;

constexpr double kGap = 1.5;  ///< usual intervals

double rate_of(const auto& samples) {
  if (samples.size() < 2) return 0;
  return static_cast<double>(samples.size() - 1) / to_seconds(samples.back().time_ns - samples.front().time_ns);
}

void time_entries(const Recording& recording, RecordingFacts& facts) {
  const auto& entries = recording.entries();
  std::vector<DurationNs> intervals;
  for (std::size_t i = 1; i < entries.size(); ++i) intervals.push_back(entries[i].offset_ns - entries[i - 1].offset_ns);
  facts.length_s = to_seconds(entries.back().offset_ns);
  if (intervals.empty()) return;
  std::vector<DurationNs> sorted = intervals;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  facts.median_interval_s = to_seconds(sorted[sorted.size() / 2]);
  for (std::size_t i = 0; i < intervals.size(); ++i)
    if (to_seconds(intervals[i]) > kGap * facts.median_interval_s)
      facts.gaps.push_back({to_seconds(entries[i].offset_ns), to_seconds(intervals[i]), i});
}

void decode_all(const Recording& recording, RecordingFacts& facts) {
  std::vector<std::uint16_t> depth(recording.depth_size().pixels());
  std::vector<std::uint8_t> gray(recording.gray_size().pixels());
  const auto attempt = [&](const auto& load) {
    try {
      load();
    } catch (const std::runtime_error& error) {
      facts.undecodable.emplace_back(error.what());
    }
  };
  for (std::size_t i = 0; i < recording.entries().size(); ++i) {
    if (recording.entries()[i].has_depth()) attempt([&] { recording.load_depth(i, depth); });
    if (recording.entries()[i].has_gray()) attempt([&] { recording.load_gray(i, gray); });
  }
}

std::string size_text(Recording::Size size) {
  return size.pixels() == 0 ? "none" : fmt::format("{}x{}", size.width_px, size.height_px);
}

std::string inertial_text(const drivers::InertialStream& s) {
  if (s.samples.empty()) return "none";
  return fmt::format("{} samples at {:.1f} Hz ({}{}{}), axes against the camera {}; {}", s.samples.size(),
                     rate_of(s.samples), s.has_gyro ? "gyro" : "", s.has_gyro && s.has_accel ? " and " : "",
                     s.has_accel ? "accelerometer" : "", s.R_cam_imu ? "known" : "not stated", s.source);
}

std::string poses_text(const drivers::PoseStream& s) {
  if (s.samples.empty()) return "none";
  return fmt::format("{} poses at {:.1f} Hz, world {}, camera on the body {}; {}", s.samples.size(), rate_of(s.samples),
                     s.level ? "level" : "with no stated vertical", s.R_sensor_cam ? "known" : "not stated", s.source);
}

}  // namespace

RecordingFacts facts_of(const Recording& recording, bool decode) {
  RecordingFacts facts;
  for (const auto& entry : recording.entries()) {
    facts.depth += entry.has_depth() ? 1 : 0;
    facts.gray += entry.has_gray() ? 1 : 0;
    facts.both += entry.has_depth() && entry.has_gray() ? 1 : 0;
    if (drivers::attitude_of(recording.motion(), recording.geometry().R_body_cam, recording.time_ns(entry)))
      ++facts.with_attitude;
  }
  time_entries(recording, facts);
  if (decode) decode_all(recording, facts);
  facts.problems = recording.problem_counts().total() + facts.undecodable.size();
  return facts;
}

std::string facts_text(const Recording& recording, const RecordingFacts& f) {
  const auto line = [](const char* name, const std::string& value) { return fmt::format("{:<14}{}\n", name, value); };
  const auto& k = recording.intrinsics();
  std::string text = line("layout", recording.layout());
  text += line("entries", fmt::format("{}: {} with depth and grey, {} depth only, {} grey only",
                                      recording.entries().size(), f.both, f.depth - f.both, f.gray - f.both));
  text += line("depth", size_text(recording.depth_size()));
  text += line("grey", size_text(recording.gray_size()));
  text += line("camera", fmt::format("{}, f {:.1f} {:.1f}, c {:.1f} {:.1f}",
                                     recording.geometry().lens_kind == LensKind::kFisheye ? "fisheye" : "pinhole",
                                     k.fx_px, k.fy_px, k.cx_px, k.cy_px));
  text += line("length",
               fmt::format("{:.3f} s from {:.9f}, interval {:.4f} s (nominal {:.2f} Hz)", f.length_s,
                           to_seconds(recording.begins_at_ns()), f.median_interval_s, recording.nominal_rate_hz()));
  text += line("inertial", inertial_text(recording.motion().inertial));
  text += line("ground truth", poses_text(recording.motion().poses));
  text +=
      line("attitude", fmt::format("for {} of {} entries of a replay", f.with_attitude, recording.entries().size()));
  if (!recording.true_flows().empty())
    text += line("true flow", fmt::format("{} files", recording.true_flows().size()));
  for (const auto& note : recording.notes()) text += line("note", note);
  for (const auto& gap : f.gaps)
    text += line("gap", fmt::format("{:.3f} s after entry {} ({:.3f} s)", gap.length_s, gap.after_entry, gap.after_s));
  for (const auto& problem : recording.problems()) text += line("problem", problem);
  for (const auto& problem : f.undecodable) text += line("problem", problem);
  text += line("counts",
               fmt::format("{} entries, {} gaps, {} problems", recording.entries().size(), f.gaps.size(), f.problems));
  for (std::size_t i = 0; i < drivers::kProblemKinds; ++i) {
    const auto kind = static_cast<drivers::ProblemKind>(i);
    if (const auto n = recording.problem_counts().count(kind); n > 0)
      text += line("", fmt::format("{} {}", n, drivers::name_of(kind)));
  }
  if (!f.undecodable.empty()) text += line("", fmt::format("{} images that cannot be decoded", f.undecodable.size()));
  return text;
}

std::string facts_json(const Recording& recording, const RecordingFacts& f) {
  nlohmann::ordered_json j;
  const auto& motion = recording.motion();
  j["layout"] = recording.layout();
  j["entries"] = recording.entries().size();
  j["depth_and_gray"] = f.both, j["depth_only"] = f.depth - f.both, j["gray_only"] = f.gray - f.both;
  j["depth_size"] = {recording.depth_size().width_px, recording.depth_size().height_px};
  j["gray_size"] = {recording.gray_size().width_px, recording.gray_size().height_px};
  j["length_s"] = f.length_s, j["median_interval_s"] = f.median_interval_s;
  j["begins_at_ns"] = recording.begins_at_ns();
  j["inertial"] = {{"samples", motion.inertial.samples.size()},
                   {"rate_hz", rate_of(motion.inertial.samples)},
                   {"gyro", motion.inertial.has_gyro},
                   {"accelerometer", motion.inertial.has_accel},
                   {"axes_known", motion.inertial.R_cam_imu.has_value()}};
  j["ground_truth"] = {{"poses", motion.poses.samples.size()},
                       {"rate_hz", rate_of(motion.poses.samples)},
                       {"level", motion.poses.level && !motion.poses.samples.empty()}};
  j["with_attitude"] = f.with_attitude;
  j["true_flows"] = recording.true_flows().size();
  j["gaps"] = nlohmann::json::array();
  for (const auto& gap : f.gaps) j["gaps"].push_back({{"after_entry", gap.after_entry}, {"length_s", gap.length_s}});
  j["notes"] = recording.notes();
  j["problems"] = recording.problems();
  for (const auto& problem : f.undecodable) j["problems"].push_back(problem);
  for (std::size_t i = 0; i < drivers::kProblemKinds; ++i) {
    const auto kind = static_cast<drivers::ProblemKind>(i);
    j["counts"][std::string(drivers::name_of(kind))] = recording.problem_counts().count(kind);
  }
  j["counts"]["undecodable images"] = f.undecodable.size();
  return j.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace wasp::tools
