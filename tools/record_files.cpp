// The files of a recording apart from its tables: the folder in TUM layout, camera.toml, stages.json, record.json.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "rt/clock.h"
#include "tools/record_session.h"
#include "types/camera.h"

namespace wasp::tools {
namespace {

constexpr const char* kTables[] = {"imu.csv", "attitude.csv", "cues.csv", "commands.csv"};

/// Whole or not at all: written beside and renamed. A refused write leaves the old file.
void replace_file(const std::filesystem::path& path, const std::string& content) {
  const std::filesystem::path beside = path.string() + ".part";
  bool ok = false;
  {
    std::ofstream out(beside, std::ios::binary | std::ios::trunc);
    ok = static_cast<bool>(out << content << std::flush);
  }
  std::error_code error;
  if (ok)
    std::filesystem::rename(beside, path, error);
  else
    std::filesystem::remove(beside, error);
}

/// Room for the account, taken while there is some: a disk that fills up in flight must not keep the losses from being
/// told.
constexpr off_t kAccountRoom_bytes = 64 * 1024;

std::filesystem::path reserve_path(const std::filesystem::path& path) { return path.string() + ".reserve"; }

/// Writes `content` into the room reserved for `path` and gives the file its name.
bool fill_reserve(const std::filesystem::path& path, const std::string& content) {
  const int fd = open(reserve_path(path).c_str(), O_WRONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool whole = write(fd, content.data(), content.size()) == static_cast<ssize_t>(content.size()) &&
                     ftruncate(fd, static_cast<off_t>(content.size())) == 0;
  close(fd);
  std::error_code error;
  if (whole) std::filesystem::rename(reserve_path(path), path, error);
  return whole && !error;
}

std::string text_of(const nlohmann::json& document, int indent) {
  return document.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

/// The table under a second name; where the file system has no hard links, a symbolic one.
void link_table(const std::filesystem::path& log, const std::filesystem::path& recording, const char* name) {
  std::filesystem::remove(recording / name);
  std::error_code error;
  std::filesystem::create_hard_link(log / name, recording / name, error);
  if (error) std::filesystem::create_symlink(std::filesystem::path("../log") / name, recording / name);
}

}  // namespace

void RecordSession::reserve_account() const {
  const int fd = open(reserve_path(log("record.json")).c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) return;
  posix_fallocate(fd, 0, kAccountRoom_bytes);
  close(fd);
}

void RecordSession::open_recording() {
  const auto recording = options_.directory / "recording";
  std::filesystem::create_directories(recording);
  rgb_ = std::make_unique<ImageStream>(recording, "rgb");
  depth_ = std::make_unique<ImageStream>(recording, "depth");
  pool_ = std::make_unique<ImagePool>();
  for (const char* name : kTables) link_table(options_.directory / "log", recording, name);
  if (options_.camera_toml.empty()) return;
  std::filesystem::copy_file(options_.camera_toml, recording / "camera.toml",
                             std::filesystem::copy_options::overwrite_existing);
}

/// Width and height from the frames, the Kinect's usual intrinsics scaled to them.
void RecordSession::write_camera_toml() const {
  if (!options_.camera_toml.empty() || !frame_size_) return;
  const Intrinsics usual;
  const double scale = static_cast<double>(frame_size_->width_px) / usual.width_px;
  const auto focal = [scale](float f) { return static_cast<double>(f) * scale; };
  const auto centre = [scale](float c) { return (static_cast<double>(c) + 0.5) * scale - 0.5; };
  replace_file(
      options_.directory / "recording" / "camera.toml",
      fmt::format("# Size from the frames; the rest is the usual Kinect geometry, not measured.\n"
                  "width_px = {}\nheight_px = {}\nfx_px = {:.6f}\nfy_px = {:.6f}\ncx_px = {:.6f}\ncy_px = {:.6f}\n"
                  "pitch_down_deg = 0.0\ndepth_units_per_m = 1000\nposition_body_m = [0.0, 0.0, 0.0]\n",
                  frame_size_->width_px, frame_size_->height_px, focal(usual.fx_px), focal(usual.fy_px),
                  centre(usual.cx_px), centre(usual.cy_px)));
}

void RecordSession::write_stages() const {
  if (stages_.empty() && !run_.present) return;
  nlohmann::json document = latency_json(stages_, run_, true);
  for (const auto& camera : cameras_) document["cameras"].push_back(to_json(camera));
  replace_file(log("stages.json"), text_of(document, -1));
}

void RecordSession::write_account(const std::string& reason) const {
  nlohmann::json topics = nlohmann::json::array(), events = nlohmann::json::array();
  for (const auto& [key, c] : counts_) {
    std::uint64_t failed = 0;
    if (pool_ && c.type == "Frame" && keeps(c)) failed = pool_->failed(c.topic == "depth" ? *depth_ : *rgb_);
    topics.push_back({{"region", c.region},
                      {"topic", c.topic},
                      {"type", c.type},
                      {"recorded", c.taken},
                      {"lost", c.lost},
                      {"before_attach", c.before_attach},
                      {"rejected", c.rejected},
                      {"refused_by_disk", failed},
                      {"polls_with_queue_full", c.queue_full},
                      {"kept", keeps(c)}});
  }
  for (const auto& e : events_) events.push_back({{"at_ns", e.at_ns}, {"region", e.region}, {"what", e.what}});
  const std::string account = text_of({{"instance", options_.instance},
                                       {"started_at_ns", started_at_ns_},
                                       {"ended_at_ns", rt::now()},
                                       {"reason", reason},
                                       {"topics", topics},
                                       {"lines_refused_by_disk", refused_lines()},
                                       {"events", events},
                                       {"events_dropped", events_dropped_}},
                                      2);
  if (fill_reserve(log("record.json"), account)) return;
  std::filesystem::remove(reserve_path(log("record.json")));
  replace_file(log("record.json"), account);
}

}  // namespace wasp::tools
