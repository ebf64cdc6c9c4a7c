// Which behaviours can have their stream: what is refused by name before a flight, and what a recording switches off.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>

#include "scheduling/behaviour_row.h"
#include "scheduling/flight_regions.h"

namespace wasp::scheduling {
namespace {

BehaviourRow row(const char* name, Stream stream, std::optional<Stream> publishes = std::nullopt) {
  BehaviourRow r;
  r.name = name;
  r.stream = stream;
  r.publishes = publishes;
  return r;
}

const BehaviourTable kTable{row("height", Stream::kDepth),
                            row("field", Stream::kGrayDepth, Stream::kFlow),
                            row("other_field", Stream::kGray, Stream::kFlow),
                            row("field_down", Stream::kDown, Stream::kFlowDown),
                            row("avoid", Stream::kFlow),
                            row("yaw", Stream::kFlowDown)};

Config config_of(const std::vector<std::string>& enabled, bool camera_down = true) {
  Config c;
  c.camera_down.enabled = camera_down;
  for (const auto& r : kTable) {
    c.behaviours.push_back({.name = r.name});
    c.behaviours.back().enabled = std::ranges::count(enabled, r.name) > 0;
  }
  return c;
}

std::string error_of(Config config) {
  try {
    check_streams(kTable, config);
  } catch (const ConfigError& e) {
    return e.what();
  }
  return {};
}

void expect_words(const std::string& text, const std::vector<std::string>& words) {
  for (const auto& word : words) EXPECT_NE(text.find(word), std::string::npos) << word << " is not in: " << text;
}

TEST(Streams, WhatFitsTogetherPassesAndKnowsItsCamera) {
  Config c = config_of({"height", "field", "field_down", "avoid", "yaw"});
  check_streams(kTable, c);
  EXPECT_FALSE(c.behaviours[1].looks_down);
  EXPECT_TRUE(c.behaviours[3].looks_down);
  EXPECT_TRUE(c.behaviours[5].looks_down);
  EXPECT_EQ(flow_topics(kTable, c), (std::vector<std::string>{"flow", "flow.down"}));
  EXPECT_EQ(flow_topics(kTable, config_of({"height"})), std::vector<std::string>{});
}

TEST(Streams, AReaderOfFlowWithoutASourceIsRefusedNamingBoth) {
  expect_words(error_of(config_of({"avoid"})), {"'avoid'", "'field' or 'other_field'", "not enabled"});
  expect_words(error_of(config_of({"yaw", "field"})), {"'yaw'", "'field_down'"});
}

TEST(Streams, TwoSourcesOfOneFieldAreRefusedNamingBoth) {
  expect_words(error_of(config_of({"field", "other_field", "avoid"})), {"'field'", "'other_field'", "'flow'"});
}

TEST(Streams, WhoLooksDownNeedsACameraThatDoes) {
  expect_words(error_of(config_of({"field_down"}, false)), {"'field_down'", "[camera_down]"});
  expect_words(error_of(config_of({"yaw"}, false)), {"'yaw'", "[camera_down]"});
}

TEST(Streams, ARecordingSwitchesOffWhatItCannotFeedAndWhoReadsItsFields) {
  Config c = config_of({"height", "field", "field_down", "avoid", "yaw"});
  const auto lines = disable_without_stream(kTable, {"gray", "depth"}, c);
  EXPECT_EQ(lines.size(), 2u);
  for (const std::size_t i : {0, 1, 4}) EXPECT_TRUE(c.behaviours[i].enabled) << kTable[i].name;
  for (const std::size_t i : {3, 5}) EXPECT_FALSE(c.behaviours[i].enabled) << kTable[i].name;
  check_streams(kTable, c);

  Config depth_only = config_of({"height", "field", "avoid"});
  EXPECT_EQ(disable_without_stream(kTable, {"depth"}, depth_only).size(), 2u);
  EXPECT_TRUE(depth_only.behaviours[0].enabled);
  EXPECT_FALSE(depth_only.behaviours[4].enabled);

  Config forgotten = config_of({"avoid"});  // the source was never enabled: still an error, not a line
  EXPECT_TRUE(disable_without_stream(kTable, {"gray", "depth"}, forgotten).empty());
  EXPECT_FALSE(error_of(forgotten).empty());
}

TEST(Streams, AFlightsRegionHasTheRingsOfEnabledBehavioursOnly) {
  const std::string instance = "test-rings-" + std::to_string(getpid());
  std::vector<std::string> names;
  for (int i = 0; i < 24; ++i) names.push_back("behaviour_" + std::to_string(i));
  const shm::Region region = create_flight_region(
      instance, {.names = names, .silent = {"behaviour_1"}, .flows = {shm::kFlow, shm::kFlowDown}}, false);
  EXPECT_TRUE(region.has("cue.behaviour_0"));
  EXPECT_FALSE(region.has("cue.behaviour_1"));
  EXPECT_TRUE(region.has("cue.behaviour_23"));
  EXPECT_TRUE(region.has("flow.down"));
  const RunStatus& status = run_status(region);
  EXPECT_EQ(status.behaviour_count, 24u);
  EXPECT_EQ(status.behaviour_state[1], static_cast<std::uint32_t>(BehaviourState::kOff));
  EXPECT_STREQ(status.behaviours[23].data(), "behaviour_23");
  StageTable& stages = stage_table(region);  // every row of a full house finds room
  for (const auto& name : names)
    for (const char* stage : {"wake-up", "compute", "age at use", "end to end"})
      EXPECT_NE(stages.add(name, stage, 0), nullptr);
  for (int i = 0; i < 8; ++i) EXPECT_NE(stages.add("control", std::to_string(i), 0), nullptr);
  shm::Region::remove(region.name());
}

}  // namespace
}  // namespace wasp::scheduling
