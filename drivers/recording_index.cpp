// Line by line, with a message for every line that makes no sense. toml11 reads camera.toml.
#include "drivers/recording_index.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <stdexcept>

#include "drivers/recording_folder.h"
#include "drivers/text_rows.h"
#include "drivers/toml_text.h"

namespace wasp::drivers {
namespace {

double number(const toml::value& value, const std::string& key, const std::filesystem::path& file, double low,
              double high) {
  const double x = value.is_integer()    ? static_cast<double>(value.as_integer())
                   : value.is_floating() ? value.as_floating()
                                         : std::numeric_limits<double>::quiet_NaN();
  if (!(x >= low && x <= high))
    throw std::runtime_error(file.string() + ":" + std::to_string(value.location().line()) + ": " + key +
                             " is not a number within " + std::to_string(low) + " ... " + std::to_string(high));
  return x;
}

template <std::size_t N>
std::array<float, N> numbers(const toml::value& value, const std::string& key, const std::filesystem::path& file,
                             double limit) {
  if (!value.is_array() || value.as_array().size() != N)
    throw std::runtime_error(file.string() + ": " + key + " is not an array of " + std::to_string(N) + " numbers");
  std::array<float, N> out;
  for (std::size_t i = 0; i < N; ++i)
    out[i] = static_cast<float>(number(value.as_array()[i], key, file, -limit, limit));
  return out;
}

LensKind lens(const toml::value& value, const std::filesystem::path& file) {
  const std::string name = value.is_string() ? value.as_string().str : "";
  if (name != "pinhole" && name != "fisheye")
    throw std::runtime_error(file.string() + ": lens is neither \"pinhole\" nor \"fisheye\"");
  return name == "fisheye" ? LensKind::kFisheye : LensKind::kPinhole;
}

float* distortion_of(Intrinsics& k, const std::string& key) {
  return key == "k1"   ? &k.k1
         : key == "k2" ? &k.k2
         : key == "p1" ? &k.p1
         : key == "p2" ? &k.p2
         : key == "k3" ? &k.k3
                       : nullptr;
}

}  // namespace

std::vector<ListedFrame> read_index(const std::filesystem::path& index, bool is_depth, RecordingProblems& problems,
                                    const std::function<void(std::string_view)>& comment) {
  std::vector<ListedFrame> frames;
  const auto read = [&](const TextRow& row) {
    ListedFrame frame;
    if (row.fields.size() != 2 || !parse_seconds(row.fields[0], frame.time_ns) || row.fields[1].empty())
      return problems.add_line(ProblemKind::kUnreadable, index, row.line, "expected \"<seconds> <file>\"");
    const std::filesystem::path file = index.parent_path() / row.fields[1];
    const bool numbered = file.filename().string().starts_with("frame-");
    const auto fallback = static_cast<std::uint32_t>(frames.size());
    frame.sequence = numbered ? trailing_number(file).value_or(fallback) : fallback;
    (is_depth ? frame.depth_file : frame.gray_file) = file;
    frame.origin = index.string() + ":" + std::to_string(row.line);
    frames.push_back(std::move(frame));
  };
  visit_rows(index, read, comment);
  if (!frames.empty() && frames[0].any_file().parent_path() != index.parent_path())
    tell_unlisted(frames[0].any_file().parent_path(), frames, problems);
  drop_unordered(frames, problems);
  return frames;
}

namespace {

/// Index of the frame nearest in time; `frames` is not empty and rises.
std::size_t nearest(const std::vector<ListedFrame>& frames, TimeNs time_ns) {
  const auto after = std::lower_bound(frames.begin(), frames.end(), time_ns,
                                      [](const ListedFrame& f, TimeNs t) { return f.time_ns < t; });
  const auto at = static_cast<std::size_t>(after - frames.begin());
  if (at == 0) return 0;
  if (at == frames.size()) return at - 1;
  return frames[at].time_ns - time_ns < time_ns - frames[at - 1].time_ns ? at : at - 1;
}

}  // namespace

std::vector<ListedFrame> pair_frames(const std::vector<ListedFrame>& depth, const std::vector<ListedFrame>& gray,
                                     DurationNs tolerance_ns) {
  std::vector<ListedFrame> out;
  std::vector<bool> taken(gray.size());
  for (std::size_t d = 0; d < depth.size(); ++d) {
    out.push_back(depth[d]);
    if (gray.empty()) continue;
    const std::size_t g = nearest(gray, depth[d].time_ns);
    if (std::abs(gray[g].time_ns - depth[d].time_ns) > tolerance_ns || nearest(depth, gray[g].time_ns) != d) continue;
    out.back().gray_file = gray[g].gray_file;
    taken[g] = true;
  }
  for (std::size_t g = 0; g < gray.size(); ++g)
    if (!taken[g]) out.push_back(gray[g]);
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.time_ns < b.time_ns; });
  return out;
}

void read_camera_toml(const std::filesystem::path& file, Listing& listing) {
  const toml::value root = parse_toml_file(file);
  Intrinsics& k = listing.intrinsics;
  const auto real = [](double x) { return static_cast<float>(x); };
  for (const auto& [key, value] : root.as_table()) {
    if (key == "width_px")
      k.width_px = static_cast<int>(number(value, key, file, 1, 16384));
    else if (key == "height_px")
      k.height_px = static_cast<int>(number(value, key, file, 1, 16384));
    else if (key == "fx_px")
      k.fx_px = real(number(value, key, file, 1, 1e5));
    else if (key == "fy_px")
      k.fy_px = real(number(value, key, file, 1, 1e5));
    else if (key == "cx_px")
      k.cx_px = real(number(value, key, file, -1e5, 1e5));
    else if (key == "cy_px")
      k.cy_px = real(number(value, key, file, -1e5, 1e5));
    else if (float* distortion = distortion_of(k, key))
      *distortion = real(number(value, key, file, -10, 10));
    else if (key == "lens")
      listing.lens_kind = lens(value, file);
    else if (key == "fisheye_k")
      listing.fisheye_k = numbers<4>(value, key, file, 10);
    else if (key == "pitch_down_deg")
      listing.pitch_down = to_radians(Degrees{number(value, key, file, -90, 90)});
    else if (key == "depth_units_per_m")
      listing.depth_units_per_m = number(value, key, file, 1, 1e6);
    else if (key == "rate_hz")
      listing.nominal_rate_hz = number(value, key, file, 0.01, 10000);
    else if (key == "position_body_m")
      listing.position_body_m = Vec3(numbers<3>(value, key, file, 100).data());
    else
      throw std::runtime_error(file.string() + ":" + std::to_string(value.location().line()) + ": unknown key '" + key +
                               "'");
  }
}

}  // namespace wasp::drivers
