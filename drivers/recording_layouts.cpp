// Each layout is one function that returns a Listing when the folder's contents fit it, and nothing otherwise; the
// table at the end is tried from top to bottom, the most telling first.
#include "drivers/recording_layouts.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <stdexcept>

#include "drivers/flow_file.h"
#include "drivers/image_file.h"
#include "drivers/recording_folder.h"
#include "drivers/recording_index.h"

namespace wasp::drivers {
namespace {

namespace fs = std::filesystem;
/// Frames on the nominal grid, timed from the first number.
std::vector<ListedFrame> depth_frames(const fs::path& folder, const std::map<std::uint32_t, std::string>& files,
                                      double rate_hz) {
  std::vector<ListedFrame> frames;
  for (const auto& [number, name] : files)
    frames.push_back({at_rate(number - files.begin()->first, rate_hz), number, folder / name, {}, name});
  return frames;
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

/// Middlebury: frame10.png, frame11.png and flow10.flo, the true flow from the first to the second. Each .flo is held
/// against the frames of its number and the next.
void add_true_flows(const fs::path& folder, const Names& names, Listing& listing) {
  std::set<std::uint32_t> numbers;
  for (const ListedFrame& frame : listing.frames) numbers.insert(frame.sequence);
  for (const std::string& name : names) {
    if (!name.ends_with(".flo")) continue;
    const auto number = trailing_number(name);
    try {
      const FlowFileInfo info = probe_flow(folder / name);
      if (!number || !numbers.contains(*number) || !numbers.contains(*number + 1))
        listing.problems.add(ProblemKind::kAlone, folder,
                             (folder / name).string() + ": no frames of its number and the next beside it");
      else if (info.width_px != listing.intrinsics.width_px || info.height_px != listing.intrinsics.height_px)
        listing.problems.add(ProblemKind::kOtherSize, folder, (folder / name).string() + ": not of the frames' size");
      else
        listing.true_flows.push_back(folder / name);
    } catch (const std::runtime_error& error) {
      listing.problems.add(ProblemKind::kDamaged, folder, error.what());
    }
  }
  if (!listing.true_flows.empty() && listing.frames.size() == 2) listing.layout = "middlebury";
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
      listing.problems.add(ProblemKind::kDamaged, folder, error.what());
    }
  }
  add_true_flows(folder, names, listing);
  return listing;
}

constexpr std::array kLayouts = {&list_tum,   &list_7scenes,     &list_tum_pair, &list_pgm,      &list_named_depth,
                                 &list_hover, &list_hover_clips, &list_rawseeds, &list_asl,      &list_numbered_png};

/// A folder of recordings is none itself; say which of its sub-folders are.
[[noreturn]] void refuse(const fs::path& folder) {
  std::string list;
  for (const std::string& name : folder_names(folder)) {
    const Names names = file_names(folder / name);
    const bool one = contains(names, "gt_per_frame.csv") || contains(names, "depth.txt") || contains(names, "rgb.txt") ||
                     contains(names, "data.csv") || fs::exists(folder / name / "mav0") ||
                     std::any_of(names.begin(), names.end(), [](const std::string& n) { return n.ends_with(".png"); });
    if (one) list += (list.empty() ? "" : ", ") + name;
  }
  if (list.empty())
    throw std::runtime_error(folder.string() + ": no recording here (no depth.txt, rgb.txt, mav0/cam0/data.csv, " +
                             "frame-*.depth.png, FRONTAL_*.png, depth_*.pgm, *_depth.png, test*.png or numbered PNG " +
                             "files)");
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
