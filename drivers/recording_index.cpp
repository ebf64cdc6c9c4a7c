// Line by line, with a message for every line that makes no sense. toml11 reads camera.toml.
#include "drivers/recording_index.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "drivers/toml_text.h"

namespace wasp::drivers {
namespace {

constexpr TimeNs kLatest = INT64_MAX / 2;  ///< the year 2116: differences of two instants up to it fit

/// Decimal seconds to nanoseconds without passing through a double, which holds epoch times to 0.2 us only.
bool parse_seconds(const std::string& text, TimeNs& out) {
  const std::size_t dot = text.find('.');
  std::string fraction = dot == std::string::npos ? "" : text.substr(dot + 1);
  if (fraction.size() > 9) fraction.resize(9);
  fraction.append(9 - fraction.size(), '0');
  const std::string digits = text.substr(0, dot) + fraction;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), out);
  return error == std::errc{} && end == digits.data() + digits.size() && dot != 0 && out >= 0 && out <= kLatest;
}

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

std::optional<std::uint32_t> trailing_number(const std::filesystem::path& file) {
  std::string name = file.filename().string();
  name = name.substr(0, name.find('.'));
  const std::size_t last = name.find_last_not_of("0123456789");
  const std::string digits = last == std::string::npos ? name : name.substr(last + 1);
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
  return value;
}

std::vector<ListedFrame> read_index(const std::filesystem::path& index, bool is_depth,
                                    std::vector<std::string>& problems) {
  std::ifstream in(index);
  if (!in) throw std::runtime_error(index.string() + ": cannot open");
  std::vector<ListedFrame> frames;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    line = line.substr(0, line.find('#'));
    std::istringstream fields(line);
    std::string seconds, name, more;
    if (!(fields >> seconds)) continue;
    const std::string origin = index.string() + ":" + std::to_string(number);
    ListedFrame frame;
    if (!(fields >> name) || fields >> more || !parse_seconds(seconds, frame.time_ns)) {
      problems.push_back(origin + ": expected \"<seconds> <file>\"");
      continue;
    }
    const std::filesystem::path file = index.parent_path() / name;
    const bool numbered = file.filename().string().starts_with("frame-");
    const auto fallback = static_cast<std::uint32_t>(frames.size());
    frame.sequence = numbered ? trailing_number(file).value_or(fallback) : fallback;
    (is_depth ? frame.depth_file : frame.gray_file) = file;
    frame.origin = origin;
    frames.push_back(std::move(frame));
  }
  return frames;
}

std::vector<ListedFrame> pair_frames(const std::vector<ListedFrame>& depth, const std::vector<ListedFrame>& gray,
                                     DurationNs tolerance_ns) {
  std::vector<ListedFrame> out;
  std::size_t g = 0;
  for (const ListedFrame& d : depth) {
    for (; g < gray.size() && gray[g].time_ns < d.time_ns - tolerance_ns; ++g) out.push_back(gray[g]);
    ListedFrame joined = d;
    if (g < gray.size() && gray[g].time_ns <= d.time_ns + tolerance_ns) joined.gray_file = gray[g++].gray_file;
    out.push_back(std::move(joined));
  }
  out.insert(out.end(), gray.begin() + static_cast<std::ptrdiff_t>(g), gray.end());
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
