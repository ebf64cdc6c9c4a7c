#include "drivers/recording_folder.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <stdexcept>

#include "drivers/image_file.h"
#include "drivers/rising_times.h"

namespace wasp::drivers {

namespace fs = std::filesystem;

namespace {

template <class Wanted>
Names names_where(const fs::path& folder, const Wanted& wanted) {
  Names names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (wanted(entry)) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

Names file_names(const fs::path& folder) {
  return names_where(folder, [](const fs::directory_entry& entry) { return entry.is_regular_file(); });
}

Names folder_names(const fs::path& folder) {
  return names_where(folder, [](const fs::directory_entry& entry) { return entry.is_directory(); });
}

bool contains(const Names& names, const std::string& name) {
  return std::binary_search(names.begin(), names.end(), name);
}

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

std::optional<std::uint32_t> trailing_number(const fs::path& file) {
  std::string name = file.filename().string();
  name = name.substr(0, name.find('.'));
  const std::size_t last = name.find_last_not_of("0123456789");
  const std::string digits = last == std::string::npos ? name : name.substr(last + 1);
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
  return value;
}

Intrinsics pinhole(int width_px, int height_px, float fx_px, float fy_px, float cx_px, float cy_px) {
  return {.width_px = width_px, .height_px = height_px, .fx_px = fx_px, .fy_px = fy_px, .cx_px = cx_px, .cy_px = cy_px};
}

void assume_centred(const fs::path& file, Listing& listing) try {
  const ImageInfo info = probe_image(file);
  listing.intrinsics.width_px = info.width_px;
  listing.intrinsics.height_px = info.height_px;
  listing.intrinsics.cx_px = 0.5f * static_cast<float>(info.width_px - 1);
  listing.intrinsics.cy_px = 0.5f * static_cast<float>(info.height_px - 1);
} catch (const std::runtime_error&) {  // told when the frame is added
}

TimeNs at_rate(std::uint32_t index, double rate_hz) { return std::llround(index * 1e9 / rate_hz); }

void drop_unordered(std::vector<ListedFrame>& frames, RecordingProblems& problems) {
  std::vector<TimeNs> times;
  for (const ListedFrame& frame : frames) times.push_back(frame.time_ns);
  const std::vector<TimeFate> fates = keep_rising(times);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    ListedFrame& frame = frames[i];
    if (fates[i] == TimeFate::kKept) {
      if (kept != i) frames[kept] = std::move(frame);
      ++kept;
      continue;
    }
    const bool duplicate = fates[i] == TimeFate::kDuplicate;
    problems.add(duplicate ? ProblemKind::kDuplicate : ProblemKind::kUnordered, frame.any_file().parent_path(),
                 frame.origin + ": " + frame.any_file().string() +
                     (duplicate ? ": its time was there before" : ": its time is not after the frame before it"));
  }
  frames.resize(kept);
}

void tell_unlisted(const fs::path& folder, const std::vector<ListedFrame>& frames, RecordingProblems& problems) {
  if (!fs::is_directory(folder)) return;
  std::set<std::string> listed;
  for (const ListedFrame& frame : frames)
    for (const fs::path& file : {frame.depth_file, frame.gray_file}) listed.insert(file.filename().string());
  Names unlisted;
  for (const std::string& name : file_names(folder))
    if (name.ends_with(".png") && !listed.contains(name)) unlisted.push_back(name);
  if (!unlisted.empty())
    problems.add_many(ProblemKind::kUnlisted, unlisted.size(),
                      folder.string() + ": " + std::to_string(unlisted.size()) +
                          " images that no readable line of the index names, the first " + unlisted.front());
}

}  // namespace wasp::drivers
