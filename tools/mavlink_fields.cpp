#include "tools/mavlink_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <map>
#include <stdexcept>

namespace wasp::tools {
namespace {

using nlohmann::ordered_json;

std::span<const std::uint8_t> payload_of(const MavlinkLog& log, const FoundFrame& frame) {
  return std::span(log.stream).subspan(frame.payload, frame.length);
}

std::string cell(const ordered_json& value) {
  if (!value.is_string()) return value.dump();
  std::string quoted = "\"";
  for (const char c : value.get<std::string>()) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

/// Column names and cells of a message's fields; an array takes a column an element.
std::string heads(const ordered_json& fields) {
  std::string line;
  for (const auto& [name, value] : fields.items()) {
    if (!value.is_array()) line += ',' + name;
    for (std::size_t i = 0; value.is_array() && i < value.size(); ++i) line += fmt::format(",{}[{}]", name, i);
  }
  return line;
}
std::string cells(const ordered_json& fields) {
  std::string line;
  for (const auto& value : fields) {
    if (!value.is_array()) line += ',' + cell(value);
    for (std::size_t i = 0; value.is_array() && i < value.size(); ++i) line += ',' + cell(value[i]);
  }
  return line;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  return text;
}

}  // namespace

ordered_json frame_json(const MavlinkDescription& description, const MavlinkLog& log, const FoundFrame& frame,
                        std::size_t index) {
  ordered_json line = {{"index", index}};
  if (const auto time = log.time_us(frame.begin)) line["time_us"] = *time;
  line.update({{"version", frame.version}, {"system", frame.system_id}, {"component", frame.component_id}});
  line.update({{"sequence", frame.sequence}, {"id", frame.id}, {"signed", frame.is_signed}});
  const MessageDescription& message = *description.find(frame.id);
  line["name"] = message.name;
  line["fields"] = decode(message, payload_of(log, frame));
  return line;
}

void print_fields(const std::string& file, const MavlinkDescription& description, const MavlinkLog& log,
                  const LogScan& scan) {
  for (std::size_t i = 0; i < scan.frames.size(); ++i) {
    ordered_json line = {{"file", file}};
    line.update(frame_json(description, log, scan.frames[i], i));
    fmt::print("{}\n", line.dump());
  }
}

void write_fields(const std::filesystem::path& folder, const std::string& stem, const MavlinkDescription& description,
                  const MavlinkLog& log, const LogScan& scan) {
  std::filesystem::create_directories(folder);
  std::map<std::uint32_t, std::ofstream> files;
  for (std::size_t i = 0; i < scan.frames.size(); ++i) {
    const FoundFrame& f = scan.frames[i];
    const MessageDescription& message = *description.find(f.id);
    const ordered_json fields = decode(message, payload_of(log, f));
    auto [file, is_new] = files.try_emplace(f.id);
    if (is_new) {
      const auto path = folder / (stem + '.' + lower(message.name) + ".csv");
      file->second.open(path);
      if (!file->second) throw std::runtime_error(path.string() + ": cannot be written");
      file->second << "index,time_us,system,component,sequence" << heads(fields) << '\n';
    }
    const auto time = log.time_us(f.begin);
    file->second << fmt::format("{},{},{},{},{}", i, time ? std::to_string(*time) : "", f.system_id, f.component_id,
                                f.sequence)
                 << cells(fields) << '\n';
  }
}

}  // namespace wasp::tools
