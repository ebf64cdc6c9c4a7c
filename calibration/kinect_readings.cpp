#include "calibration/kinect_readings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "drivers/image_file.h"
#include "tools/quantiles.h"

namespace wasp::calibration {
namespace {

namespace fs = std::filesystem;

constexpr double kSameDistance_m = 0.01;
constexpr double kLeastValid = 0.5;     ///< share of the part of an image that is looked at
constexpr double kMostSpread_steps = 8;  ///< between the quartiles: more is no wall, or one that stands askew

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, ',');) {
    const auto first = field.find_first_not_of(" \t\r"), last = field.find_last_not_of(" \t\r");
    fields.push_back(first == std::string::npos ? "" : field.substr(first, last - first + 1));
  }
  return fields;
}

std::size_t column(const std::vector<std::string>& head, const std::string& name) {
  return static_cast<std::size_t>(std::find(head.begin(), head.end(), name) - head.begin());
}

double number(const std::string& text) {
  std::size_t used = 0;
  try {
    const double value = std::stod(text, &used);
    if (used == text.size() && std::isfinite(value)) return value;
  } catch (const std::exception&) {
  }
  throw std::runtime_error("'" + text + "' is no number");
}

/// The median raw value in the middle of an image. Throws std::runtime_error with the reason why it has none.
double raw_in(const fs::path& file, double part) {
  drivers::Image<std::uint16_t> image = drivers::load_gray16(file);
  const auto eleven_bits = [](std::uint16_t v) { return v < drivers::kKinectRawValues; };
  const auto swapped = [](std::uint16_t v) { return static_cast<std::uint16_t>((v >> 8) | (v << 8)); };
  const auto all = static_cast<std::ptrdiff_t>(image.pixels.size());
  if (std::count_if(image.pixels.begin(), image.pixels.end(), eleven_bits) < all)
    std::transform(image.pixels.begin(), image.pixels.end(), image.pixels.begin(), swapped);
  if (std::count_if(image.pixels.begin(), image.pixels.end(), eleven_bits) < all)
    throw std::runtime_error("values of more than 11 bits: no raw readings of a Kinect");
  const int w = std::max(1, static_cast<int>(part * image.width_px)), h = std::max(1, static_cast<int>(part * image.height_px));
  std::vector<double> raw;
  for (int v = (image.height_px - h) / 2; v < (image.height_px + h) / 2; ++v)
    for (int u = (image.width_px - w) / 2; u < (image.width_px + w) / 2; ++u)
      if (const std::uint16_t x = image.view().row(v)[u]; x != drivers::kKinectNoReading && x != 0) raw.push_back(x);
  const double share = static_cast<double>(raw.size()) / (static_cast<double>(w) * h);
  if (share < kLeastValid) throw std::runtime_error(fmt::format("only {:.0f} % of its middle have a reading", 100 * share));
  std::sort(raw.begin(), raw.end());
  const double spread = raw[raw.size() * 3 / 4] - raw[raw.size() / 4];
  if (spread > kMostSpread_steps)
    throw std::runtime_error(fmt::format("its middle spans {:.0f} steps between the quartiles, {:.0f} are allowed: no "
                                         "wall seen straight on", spread, kMostSpread_steps));
  double sum = 0;  // of what lies between the quartiles: finer than a step
  const std::size_t first = raw.size() / 4, last = raw.size() * 3 / 4;
  for (std::size_t i = first; i <= last; ++i) sum += raw[i];
  return sum / static_cast<double>(last - first + 1);
}

/// One point a distance.
std::vector<KinectPoint> join(std::vector<KinectPoint> readings) {
  std::stable_sort(readings.begin(), readings.end(), [](const auto& a, const auto& b) { return a.distance_m < b.distance_m; });
  std::vector<KinectPoint> points;
  for (std::size_t i = 0; i < readings.size();) {
    std::vector<double> raw;
    const std::size_t first = i;
    for (; i < readings.size() && readings[i].distance_m - readings[first].distance_m < kSameDistance_m; ++i)
      raw.push_back(readings[i].raw);
    points.push_back({tools::median(raw), readings[first].distance_m, readings[first].name});
  }
  return points;
}

}  // namespace

KinectReadings read_kinect_readings(const std::string& table, double part) {
  std::ifstream in(table);
  std::string line;
  if (!in || !std::getline(in, line)) throw std::runtime_error(table + ": cannot be read");
  const std::vector<std::string> head = split(line);
  const std::size_t raw = column(head, "raw"), file = column(head, "file"), distance = column(head, "distance_m");
  if (distance == head.size() || (raw == head.size() && file == head.size()))
    throw std::runtime_error(table + ":1: wants the columns raw,distance_m or file,distance_m");
  KinectReadings result;
  std::vector<KinectPoint> readings;
  for (int number_of_line = 2; std::getline(in, line); ++number_of_line) {
    const std::vector<std::string> fields = split(line);
    if (fields.empty()) continue;
    ++result.readings;
    const std::string where = fmt::format("{}:{}", table, number_of_line);
    try {
      if (fields.size() < head.size()) throw std::runtime_error("too few fields");
      const double z = number(fields[distance]);
      if (z <= 0.1 || z > 20) throw std::runtime_error(fmt::format("{} m is no distance for a Kinect", z));
      const double x = raw < head.size() ? number(fields[raw]) : raw_in(fs::path(table).parent_path() / fields[file], part);
      if (x <= 0 || x >= drivers::kKinectNoReading) throw std::runtime_error(fmt::format("{} is no reading", x));
      readings.push_back({x, z, where});
    } catch (const std::exception& error) {
      result.skipped.push_back(where + ": " + error.what());
    }
  }
  result.points = join(std::move(readings));
  return result;
}

}  // namespace wasp::calibration
