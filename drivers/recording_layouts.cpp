// Each layout is one function that returns a Listing when the folder's contents fit it, and nothing otherwise; the
// table at the end is tried from top to bottom, the most telling first.
#include "drivers/recording_layouts.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "drivers/image_file.h"
#include "drivers/recording_index.h"

namespace wasp::drivers {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;  // of the regular files in the folder, sorted

constexpr double kLongestClip_s = 1e6;
constexpr DurationNs kPairTolerance = 17 * kMillisecond;  // half a period of a 30 Hz camera

Names file_names(const fs::path& folder) {
  Names names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file()) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

bool contains(const Names& names, const std::string& name) {
  return std::binary_search(names.begin(), names.end(), name);
}

Intrinsics pinhole(int width_px, int height_px, float fx_px, float fy_px, float cx_px, float cy_px) {
  return {.width_px = width_px, .height_px = height_px, .fx_px = fx_px, .fy_px = fy_px, .cx_px = cx_px, .cy_px = cy_px};
}

TimeNs at_rate(std::uint32_t index, double rate_hz) { return std::llround(index * 1e9 / rate_hz); }

/// Files matching prefix + digits + suffix, by number. `prefix` may be empty.
std::map<std::uint32_t, std::string> numbered(const Names& names, const std::string& prefix,
                                              const std::string& suffix) {
  std::map<std::uint32_t, std::string> out;
  for (const std::string& name : names) {
    if (!name.starts_with(prefix) || !name.ends_with(suffix) || name.size() <= prefix.size() + suffix.size()) continue;
    const char* begin = name.data() + prefix.size();
    const char* end = name.data() + name.size() - suffix.size();
    std::uint32_t number = 0;
    const auto [stop, error] = std::from_chars(begin, end, number);
    if (error == std::errc{} && stop == end) out.emplace(number, name);
  }
  return out;
}

/// Frames on the nominal grid, timed from the first number.
std::vector<ListedFrame> depth_frames(const fs::path& folder, const std::map<std::uint32_t, std::string>& files,
                                      double rate_hz) {
  std::vector<ListedFrame> frames;
  for (const auto& [number, name] : files)
    frames.push_back({at_rate(number - files.begin()->first, rate_hz), number, folder / name, {}, name});
  return frames;
}

std::optional<Listing> list_tum(const fs::path& folder, const Names& names) {
  if (!contains(names, "depth.txt") && !contains(names, "rgb.txt")) return std::nullopt;
  Listing listing{.layout = "tum"};
  listing.depth_units_per_m = 5000.0;
  if (contains(names, "camera.toml")) read_camera_toml(folder / "camera.toml", listing);
  std::vector<ListedFrame> depth, gray;
  if (contains(names, "depth.txt")) depth = read_index(folder / "depth.txt", true, listing.problems);
  if (contains(names, "rgb.txt")) gray = read_index(folder / "rgb.txt", false, listing.problems);
  listing.frames = pair_frames(depth, gray, kPairTolerance);
  return listing;
}

std::optional<Listing> list_7scenes(const fs::path& folder, const Names& names) {
  const auto files = numbered(names, "frame-", ".depth.png");
  if (files.empty()) return std::nullopt;
  Listing listing{.layout = "7scenes"};
  listing.intrinsics = pinhole(640, 480, 585.f, 585.f, 320.f, 240.f);
  listing.frames = depth_frames(folder, files, listing.nominal_rate_hz);
  return listing;
}

std::optional<Listing> list_tum_pair(const fs::path& folder, const Names& names) {
  if (!contains(names, "dep_prev.png") || !contains(names, "dep_curr.png")) return std::nullopt;
  Listing listing{.layout = "tum_pair"};
  listing.depth_units_per_m = 5000.0;
  std::uint32_t index = 0;
  for (const std::string which : {"prev.png", "curr.png"}) {
    const fs::path gray = contains(names, "img_" + which) ? folder / ("img_" + which) : fs::path{};
    listing.frames.push_back({at_rate(index, 30.0), index, folder / ("dep_" + which), gray, "dep_" + which});
    ++index;
  }
  return listing;
}

std::optional<Listing> list_pgm(const fs::path& folder, const Names& names) {
  const auto files = numbered(names, "depth_", ".pgm");
  if (files.empty()) return std::nullopt;
  Listing listing{.layout = "depth_pgm"};
  listing.intrinsics = pinhole(640, 480, 518.f, 519.f, 325.5f, 253.5f);
  listing.frames = depth_frames(folder, files, listing.nominal_rate_hz);
  for (ListedFrame& frame : listing.frames) {
    const std::string color = "color_" + std::to_string(frame.sequence) + ".png";
    if (contains(names, color)) frame.gray_file = folder / color;
  }
  return listing;
}

std::optional<Listing> list_named_depth(const fs::path& folder, const Names& names) {
  constexpr std::string_view kSuffix = "_depth.png";
  Listing listing{.layout = "named_depth"};
  for (const std::string& name : names) {
    if (!name.ends_with(kSuffix)) continue;
    const std::string color = name.substr(0, name.size() - kSuffix.size()) + "_rgb.png";
    const auto index = static_cast<std::uint32_t>(listing.frames.size());
    listing.frames.push_back(
        {at_rate(index, 30.0), index, folder / name, contains(names, color) ? folder / color : fs::path{}, name});
  }
  if (listing.frames.empty()) return std::nullopt;
  return listing;
}

/// t_s by frame number from gt_per_frame.csv (columns frame, t_s, ...).
std::map<std::uint32_t, TimeNs> frame_times(const fs::path& file, std::vector<std::string>& problems) {
  std::map<std::uint32_t, TimeNs> times;
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  if (!line.starts_with("frame,t_s")) {
    problems.push_back(file.string() + ":1: expected columns frame,t_s,...");
    return times;
  }
  for (int number = 2; std::getline(in, line); ++number) {
    std::istringstream fields(line);
    std::uint32_t frame = 0;
    char comma = 0;
    double t_s = 0;
    if (fields >> frame >> comma >> t_s && comma == ',' && t_s >= 0 && t_s <= kLongestClip_s)
      times[frame] = std::llround(t_s * 1e9);
    else
      problems.push_back(file.string() + ":" + std::to_string(number) + ": expected <frame>,<seconds>,...");
  }
  return times;
}

/// A downward 320x240 camera at 60 Hz. The table's times are those of the motion capture, which hears of some frames
/// late (steps of 4 to 32 ms): they are used where they rise, else the frame sits on the 60 Hz grid.
std::optional<Listing> list_hover(const fs::path& folder, const Names& names) {
  const auto files = numbered(names, "test", ".png");
  if (files.empty() || !contains(names, "gt_per_frame.csv")) return std::nullopt;
  Listing listing{.layout = "hover_mocap"};
  listing.intrinsics = pinhole(320, 240, 390.f, 390.f, 159.5f, 119.5f);
  listing.pitch_down = Radians{std::numbers::pi / 2};
  listing.nominal_rate_hz = 60.0;
  const auto times = frame_times(folder / "gt_per_frame.csv", listing.problems);
  const bool complete = std::all_of(files.begin(), files.end(), [&](const auto& f) { return times.contains(f.first); });
  for (const auto& [number, name] : files) {
    const TimeNs time_ns = complete ? times.at(number) : at_rate(number - files.begin()->first, 60.0);
    listing.frames.push_back({time_ns, number, {}, folder / name, name});
  }
  return listing;
}

/// A folder of such clips, played one after the other in order of their frame numbers, a tenth of a second apart.
std::optional<Listing> list_hover_clips(const fs::path& folder, const Names&) {
  std::map<std::uint32_t, Listing> clips;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.is_directory())
      if (auto clip = list_hover(entry.path(), file_names(entry.path())))
        clips.emplace(clip->frames.front().sequence, *std::move(clip));
  if (clips.empty()) return std::nullopt;
  Listing all = clips.begin()->second;
  all.layout = "hover_mocap_clips";
  for (auto next = std::next(clips.begin()); next != clips.end(); ++next) {
    const DurationNs shift_ns = all.frames.back().time_ns + 100 * kMillisecond - next->second.frames.front().time_ns;
    for (ListedFrame frame : next->second.frames) {
      frame.time_ns += shift_ns;
      all.frames.push_back(std::move(frame));
    }
    all.problems.insert(all.problems.end(), next->second.problems.begin(), next->second.problems.end());
  }
  return all;
}

/// Size and centre of the first usable image; a damaged one is a problem, told when the frame is added.
void assume_centred(const fs::path& file, Listing& listing) {
  const ImageInfo info = probe_image(file);
  listing.intrinsics.width_px = info.width_px;
  listing.intrinsics.height_px = info.height_px;
  listing.intrinsics.cx_px = 0.5f * static_cast<float>(info.width_px - 1);
  listing.intrinsics.cy_px = 0.5f * static_cast<float>(info.height_px - 1);
}

/// EuRoC ASL: grey PNGs named by their time in nanoseconds.
std::optional<Listing> list_asl(const fs::path& folder, const Names& names) {
  constexpr std::size_t kDigits = 16;  // a time in nanoseconds since 1970 has 19
  Listing listing{.layout = "asl"};
  listing.nominal_rate_hz = 20.0;
  for (const std::string& name : names) {
    const std::size_t digits = name.find_first_not_of("0123456789");
    if (digits == std::string::npos || digits < kDigits || digits > 19 || name.substr(digits) != ".png") continue;
    const auto index = static_cast<std::uint32_t>(listing.frames.size());
    TimeNs time_ns = 0;
    if (std::from_chars(name.data(), name.data() + digits, time_ns).ec != std::errc{} || time_ns > INT64_MAX / 2)
      listing.problems.push_back((folder / name).string() + ": no time in nanoseconds");
    else
      listing.frames.push_back({time_ns, index, {}, folder / name, name});
  }
  if (listing.frames.empty()) return std::nullopt;
  assume_centred(listing.frames.front().gray_file, listing);
  return listing;
}

/// The fallback: PNGs whose names end in a number, of the stem that most of them share; 16-bit grey counts as depth.
std::optional<Listing> list_numbered_png(const fs::path& folder, const Names& names) {
  std::map<std::string, std::map<std::uint32_t, std::string>> by_stem;
  for (const std::string& name : names)
    if (const auto number = trailing_number(name); number && name.ends_with(".png"))
      by_stem[name.substr(0, name.find_last_not_of("0123456789", name.find('.') - 1) + 1)].emplace(*number, name);
  if (by_stem.empty()) return std::nullopt;
  const auto& files = std::max_element(by_stem.begin(), by_stem.end(), [](const auto& a, const auto& b) {
                        return a.second.size() < b.second.size();
                      })->second;
  Listing listing{.layout = "numbered_png"};
  for (const auto& [number, name] : files) {
    const TimeNs time_ns = at_rate(number - files.begin()->first, listing.nominal_rate_hz);
    try {
      const ImageInfo info = probe_image(folder / name);
      const bool depth = info.bits == 16 && !info.colour;
      if (listing.frames.empty()) assume_centred(folder / name, listing);
      listing.frames.push_back(
          {time_ns, number, depth ? folder / name : fs::path{}, depth ? fs::path{} : folder / name, name});
    } catch (const std::runtime_error& error) {
      listing.problems.emplace_back(error.what());
    }
  }
  return listing;
}

constexpr std::array kLayouts = {&list_tum,   &list_7scenes,     &list_tum_pair, &list_pgm,         &list_named_depth,
                                 &list_hover, &list_hover_clips, &list_asl,      &list_numbered_png};

/// A folder of clips is not a recording; say which of its sub-folders are.
[[noreturn]] void refuse(const fs::path& folder) {
  Names clips;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (!entry.is_directory()) continue;
    const Names names = file_names(entry.path());
    if (contains(names, "gt_per_frame.csv") || contains(names, "depth.txt") || contains(names, "rgb.txt"))
      clips.push_back(entry.path().filename().string());
  }
  std::sort(clips.begin(), clips.end());
  if (clips.empty())
    throw std::runtime_error(folder.string() + ": no recording here (no depth.txt, frame-*.depth.png, depth_*.pgm, " +
                             "*_depth.png, test*.png or numbered PNG files)");
  std::string list;
  for (const std::string& clip : clips) list += (list.empty() ? "" : ", ") + clip;
  throw std::runtime_error(folder.string() + ": holds several recordings; name one of them: " + list);
}

}  // namespace

Listing list_recording(const fs::path& folder) {
  if (!fs::exists(folder)) throw std::runtime_error(folder.string() + ": no such folder");
  if (!fs::is_directory(folder)) throw std::runtime_error(folder.string() + ": not a folder");
  const Names names = file_names(folder);
  for (const auto& list : kLayouts)
    if (std::optional<Listing> listing = list(folder, names)) return *std::move(listing);
  refuse(folder);
}

}  // namespace wasp::drivers
