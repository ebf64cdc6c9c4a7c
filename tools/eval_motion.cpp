// Sequences are found by what the names share, so that masks and depth images in the same folder stay out.
#include "tools/eval_motion.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "drivers/image_file.h"

namespace wasp::tools {
namespace {

namespace fs = std::filesystem;

struct Numbered {
  std::string prefix;
  long number = 0;
};

/// "test0620.png" -> "test", 620. Very long numbers (nanoseconds) keep their last 18 digits.
bool split_name(const fs::path& file, Numbered& out) {
  if (file.extension() != ".png") return false;
  const std::string stem = file.stem().string();
  std::size_t digits = stem.size();
  while (digits > 0 && std::isdigit(static_cast<unsigned char>(stem[digits - 1])) != 0) --digits;
  if (digits == stem.size()) return false;
  out.prefix = stem.substr(0, digits);
  const std::string number = stem.substr(digits);
  out.number = std::stol(number.size() > 18 ? number.substr(number.size() - 18) : number);
  return true;
}

MotionFrame read_frame(const fs::path& file, long number) {
  auto image = drivers::load_gray8(file);
  return {number, image.width_px, image.height_px, std::move(image.pixels)};
}

std::vector<double> numbers_of(const std::string& line, const fs::path& file, int number) {
  std::vector<double> values;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, ',');) try {
      values.push_back(std::stod(field));
    } catch (const std::exception&) {
      throw std::runtime_error(file.string() + ":" + std::to_string(number) + ": no number: " + field);
    }
  return values;
}

std::vector<std::string> names_of(const std::string& line) {
  std::vector<std::string> names;
  std::istringstream in(line);
  for (std::string name; std::getline(in, name, ',');) {
    if (!name.empty() && name.back() == '\r') name.pop_back();
    names.push_back(name);
  }
  return names;
}

}  // namespace

std::vector<MotionFrame> read_sequence(const fs::path& folder) {
  std::map<std::string, std::map<long, fs::path>> groups;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    Numbered name;
    if (!entry.is_regular_file() || !split_name(entry.path(), name)) continue;
    if (drivers::probe_image(entry.path()).bits == 8) groups[name.prefix].emplace(name.number, entry.path());
  }
  const auto largest = std::max_element(groups.begin(), groups.end(),
                                        [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  if (largest == groups.end() || largest->second.size() < 2)
    throw std::runtime_error(folder.string() + ": no sequence of 8-bit PNG files");
  std::vector<MotionFrame> frames;
  for (const auto& [number, file] : largest->second) {
    MotionFrame frame = read_frame(file, number);
    if (!frames.empty() && (frame.width_px != frames[0].width_px || frame.height_px != frames[0].height_px)) continue;
    frames.push_back(std::move(frame));
  }
  return frames;
}

NumberTable read_numbers(const fs::path& file) {
  NumberTable table;
  std::ifstream in(file);
  std::string line;
  if (!in || !std::getline(in, line)) return table;
  const std::vector<std::string> names = names_of(line);
  for (int number = 2; std::getline(in, line); ++number) {
    if (line.empty()) continue;
    const std::vector<double> values = numbers_of(line, file, number);
    if (values.size() != names.size())
      throw std::runtime_error(file.string() + ":" + std::to_string(number) + ": " + std::to_string(values.size()) +
                               " fields, the heading has " + std::to_string(names.size()));
    auto& row = table[static_cast<long>(values[0])];
    for (std::size_t i = 0; i < names.size(); ++i) row[names[i]] = values[i];
  }
  return table;
}

WindowFlow::WindowFlow(int width_px, int height_px, const vision::FlowGridParams& params)
    : grid_(width_px, height_px, params) {}

const vision::FlowField& WindowFlow::track(const MotionFrame& first, const MotionFrame& second, const Window& window) {
  grid_.track(window.of(first.view()), window.of(second.view()), field_);
  for (int i = 0; i < field_.count(); ++i) {
    field_.cells[static_cast<std::size_t>(i)].x_px += static_cast<float>(window.x);
    field_.cells[static_cast<std::size_t>(i)].y_px += static_cast<float>(window.y);
  }
  return field_;
}

}  // namespace wasp::tools
