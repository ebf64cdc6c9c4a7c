#include "scheduling/behaviour_row.h"

#include <fmt/format.h>

#include <algorithm>

namespace wasp::scheduling {
namespace {

/// Enabled rows that make flow fields of this stream, by name.
std::vector<std::string> enabled_sources(const BehaviourTable& table, const Config& config, Stream stream) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < table.size(); ++i)
    if (config.behaviours[i].enabled && table[i].publishes == stream) names.push_back(table[i].name);
  return names;
}

/// "'flow_field', which makes them, is not enabled".
std::string missing_source(const BehaviourTable& table, Stream stream) {
  std::string names;
  for (const auto& row : table)
    if (row.publishes == stream) names += fmt::format("{}'{}'", names.empty() ? "" : " or ", row.name);
  return names.empty() ? "no behaviour of this program makes them" : names + ", which makes them, is not enabled";
}

void check_stream(const BehaviourTable& table, const Config& config, const BehaviourRow& row) {
  if (looks_down(row.stream) && !config.camera_down.enabled)
    throw ConfigError(fmt::format(
        "behaviour '{}' is enabled, but it sees through the camera that looks down: [camera_down] enabled = false",
        row.name));
  if (is_flow(row.stream) && enabled_sources(table, config, row.stream).empty())
    throw ConfigError(fmt::format("behaviour '{}' is enabled, but it reads flow fields ('{}'): {}", row.name,
                                  ring_of(row.stream), missing_source(table, row.stream)));
}

}  // namespace

std::vector<std::string> names_of(const BehaviourTable& table) {
  std::vector<std::string> names;
  for (const auto& row : table) names.push_back(row.name);
  return names;
}

void check_streams(const BehaviourTable& table, Config& config) {
  for (std::size_t i = 0; i < table.size(); ++i) {
    config.behaviours[i].looks_down = looks_down(table[i].stream);
    if (config.behaviours[i].enabled) check_stream(table, config, table[i]);
  }
  for (const Stream stream : {Stream::kFlow, Stream::kFlowDown})
    if (const auto names = enabled_sources(table, config, stream); names.size() > 1)
      throw ConfigError(
          fmt::format("behaviours '{}' and '{}' are both enabled, but only one may make flow fields ('{}')", names[0],
                      names[1], ring_of(stream)));
}

std::vector<std::string> disable_without_stream(const BehaviourTable& table, const std::vector<std::string>& offered,
                                                Config& config) {
  std::vector<std::string> lines;
  const auto disable = [&](std::size_t i, const std::string& why) {
    config.behaviours[i].enabled = false;
    lines.push_back(fmt::format("behaviour {} is switched off: {}", table[i].name, why));
  };
  const auto made_before = flow_topics(table, config);
  const auto has = [](const auto& list, const char* topic) { return std::ranges::find(list, topic) != list.end(); };
  for (std::size_t i = 0; i < table.size(); ++i)
    if (config.behaviours[i].enabled && !is_flow(table[i].stream) && !has(offered, ring_of(table[i].stream)))
      disable(i, fmt::format("the recording has no '{}'", ring_of(table[i].stream)));
  const auto made = flow_topics(table, config);
  for (std::size_t i = 0; i < table.size(); ++i) {
    const Stream stream = table[i].stream;
    const bool expected = looks_down(stream) || has(made_before, ring_of(stream));  // else: an error of configuration
    if (config.behaviours[i].enabled && is_flow(stream) && expected && !has(made, ring_of(stream)))
      disable(i, fmt::format("nobody makes '{}' from this recording", ring_of(stream)));
  }
  return lines;
}

std::vector<std::string> flow_topics(const BehaviourTable& table, const Config& config) {
  std::vector<std::string> topics;
  for (const Stream stream : {Stream::kFlow, Stream::kFlowDown})
    if (!enabled_sources(table, config, stream).empty()) topics.emplace_back(ring_of(stream));
  return topics;
}

}  // namespace wasp::scheduling
