#include "scheduling/replay_script.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string_view>

namespace wasp::scheduling {
namespace {

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> cells;
  while (true) {
    const auto comma = line.find(',');
    cells.push_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

/// Columns by name of a CSV whose first line is a header.
class Columns {
 public:
  Columns(std::string path, std::string_view header) : path_(std::move(path)) {
    const auto cells = split(header);
    for (std::size_t i = 0; i < cells.size(); ++i) index_[std::string(cells[i])] = i;
  }
  [[nodiscard]] std::size_t at(const std::string& name) const {
    if (const auto column = find(name)) return *column;
    throw std::runtime_error(path_ + ": no column '" + name + "'");
  }
  [[nodiscard]] std::optional<std::size_t> find(const std::string& name) const {
    const auto it = index_.find(name);
    return it == index_.end() ? std::nullopt : std::optional(it->second);
  }

 private:
  std::string path_;
  std::map<std::string, std::size_t> index_;
};

template <class T>
T parse(const std::vector<std::string_view>& cells, std::size_t column, const std::string& where) {
  T value{};
  if (column >= cells.size()) throw std::runtime_error(where + ": too few columns");
  const auto cell = cells[column];
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc{} || end != cell.data() + cell.size())
    throw std::runtime_error(where + ": '" + std::string(cell) + "' is not a number");
  return value;
}

}  // namespace

std::map<std::string, BehaviourScript> load_replay_script(const std::string& folder) {
  std::map<std::string, BehaviourScript> scripts;
  const std::string path = folder + "/cues.csv";
  std::ifstream file(path);
  std::string line;
  if (!file || !std::getline(file, line)) return scripts;
  const Columns columns(path, line);
  const std::size_t name = columns.at("behaviour"), frame = columns.at("frame_sequence"),
                    valid = columns.at("attitude_valid");
  const std::size_t exposed = columns.at("exposed_at_ns"), q = columns.at("q_w"),
                    rate = columns.at("rate_x_body_radps");
  const auto accel_valid = columns.find("accel_valid"), accel = columns.find("accel_x_body_mps2");
  for (int number = 2; std::getline(file, line); ++number) {
    const std::string where = path + ":" + std::to_string(number);
    const auto cells = split(line);
    ScriptedStep step;
    step.frame_sequence = parse<std::uint32_t>(cells, frame, where);
    step.attitude_valid = parse<int>(cells, valid, where) != 0;
    step.exposed_at_ns = parse<TimeNs>(cells, exposed, where);
    for (std::size_t i = 0; i < 4; ++i) step.attitude.q_ned_body[i] = parse<float>(cells, q + i, where);
    for (std::size_t i = 0; i < 3; ++i) step.attitude.rate_body_radps[i] = parse<float>(cells, rate + i, where);
    if (accel_valid && accel) {
      step.accel_valid = parse<int>(cells, *accel_valid, where) != 0;
      for (std::size_t i = 0; i < 3; ++i) step.accel_body_mps2[i] = parse<float>(cells, *accel + i, where);
    }
    if (name >= cells.size()) throw std::runtime_error(where + ": too few columns");
    scripts[std::string(cells[name])].push_back(step);
  }
  for (auto& [key, script] : scripts)
    std::stable_sort(script.begin(), script.end(),
                     [](const auto& a, const auto& b) { return a.frame_sequence < b.frame_sequence; });
  return scripts;
}

const ScriptedStep* find_step(const BehaviourScript& script, std::uint32_t frame_sequence) noexcept {
  const auto it = std::lower_bound(script.begin(), script.end(), frame_sequence,
                                   [](const ScriptedStep& s, std::uint32_t n) { return s.frame_sequence < n; });
  return it != script.end() && it->frame_sequence == frame_sequence ? &*it : nullptr;
}

}  // namespace wasp::scheduling
