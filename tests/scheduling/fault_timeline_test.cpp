// Timelines are read strictly: file, line and reason are named, and nothing this flight cannot have passes.
#include "scheduling/fault_timeline.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

namespace wasp::scheduling {
namespace {

const FaultScope kScope{{"", "ground_altitude"}, true};

std::vector<TimedFault> read(const std::string& text, const FaultScope& scope = kScope) {
  std::istringstream stream(text);
  return read_fault_timeline(stream, "f.toml", scope);
}

std::string error_of(const std::string& text, const FaultScope& scope = kScope) {
  try {
    read(text, scope);
  } catch (const ConfigError& e) {
    return e.what();
  }
  return {};
}

TEST(FaultTimeline, RowsComeInOrderWithDefaults) {
  const auto faults = read(
      "[[fault]]\nat_s = 5\nwhat = \"camera.late\"\nfor_s = 0.5\n"
      "[[fault]]\nat_s = 1.5\nafter = \"landing\"\nwhat = \"behaviour.spin\"\nfor_s = 2\nvalue = 7.5\n"
      "behaviour = \"ground_altitude\"\n"
      "[[fault]]\nat_s = 0\nafter = \"armed\"\nwhat = \"process.segv\"\n");
  ASSERT_EQ(faults.size(), 3u);
  EXPECT_EQ(faults[0].after, Milestone::kStart);
  EXPECT_EQ(faults[0].delay_ns, 5 * kSecond);
  EXPECT_EQ(faults[0].order.point, FaultPoint::kCameraLate);
  EXPECT_EQ(faults[0].order.for_ns, kSecond / 2);
  EXPECT_FLOAT_EQ(faults[0].order.value, row_of(FaultPoint::kCameraLate).value);
  EXPECT_EQ(faults[0].order.target, FaultBoard::kAnyTarget);
  EXPECT_EQ(faults[1].after, Milestone::kLanding);
  EXPECT_FLOAT_EQ(faults[1].order.value, 7.5f);
  EXPECT_EQ(faults[1].order.target, 1);
  EXPECT_EQ(faults[2].order.point, FaultPoint::kProcessSegv);
}

TEST(FaultTimeline, WhatIsWrongIsNamedWithFileAndLine) {
  const std::string good = "[[fault]]\nat_s = 1\nwhat = \"camera.drop\"\nfor_s = 1\n";
  ASSERT_EQ(error_of(good), "");
  struct Wrong {
    std::string text, line, why;
  };
  const std::vector<Wrong> all = {
      {good + "colour = 3\n", "f.toml:5", "unknown key 'colour'"},
      {"x = 1\n" + good, "f.toml:1", "unknown key 'x'"},
      {"[[fault]]\nat_s = 1\nwhat = \"camera.frozen\"\nfor_s = 1\n", "f.toml:1", "no fault point of this name"},
      {"[[fault]]\nwhat = \"camera.drop\"\nfor_s = 1\n", "f.toml:1", "needs 'at_s'"},
      {"[[fault]]\nat_s = 1\nfor_s = 1\n", "f.toml:1", "needs 'what'"},
      {"[[fault]]\nat_s = 1\nwhat = \"camera.drop\"\n", "f.toml:1", "for how long"},
      {"[[fault]]\nat_s = -1\nwhat = \"camera.drop\"\nfor_s = 1\n", "f.toml:2", "must lie in 0"},
      {"[[fault]]\nat_s = nan\nwhat = \"camera.drop\"\nfor_s = 1\n", "f.toml:2", "must lie in 0"},
      {"[[fault]]\nat_s = 1\nwhat = \"camera.drop\"\nfor_s = 0\n", "f.toml:1", "more than 0"},
      {"[[fault]]\nat_s = 1\nwhat = \"camera.drop\"\nfor_s = 1e9\n", "f.toml:1", "at most 3600"},
      {good + "value = 1.5\n", "f.toml:1", "0 ... 1 share"},
      {good + "value = \"much\"\n", "f.toml:5", "must be a number"},
      {"[[fault]]\nat_s = 1\nwhat = \"imu.nan\"\nfor_s = 1\nvalue = 1\n", "f.toml:1", "takes no value"},
      {good + "after = \"lunch\"\n", "f.toml:5", "must be one of: start, armed, flying, landing"},
      {good + "behaviour = \"ground_altitude\"\n", "f.toml:1", "not aimed at a behaviour"},
      {"[[fault]]\nat_s = 1\nwhat = \"behaviour.silent\"\nfor_s = 1\nbehaviour = \"avoid\"\n", "f.toml:1",
       "no behaviour of this name is enabled"},
      {"fault = 3\n", "f.toml:1", "[[fault]]"},
      {"fault = [3]\n", "f.toml:1", "must be a table"},
      {"", "f.toml", "there is no [[fault]]"},
      {"[[fault]\n", "f.toml", ""},
  };
  for (const auto& wrong : all) {
    const std::string error = error_of(wrong.text);
    EXPECT_NE(error.find(wrong.line), std::string::npos) << wrong.text << "\nsays: " << error;
    EXPECT_NE(error.find(wrong.why), std::string::npos) << wrong.text << "\nsays: " << error;
  }
}

TEST(FaultTimeline, AReplayRefusesFaultsOfTheCameraByName) {
  const FaultScope replay{{"", "ground_altitude"}, false};
  for (const char* what : {"camera.drop", "image.black", "depth.none"})
    EXPECT_NE(error_of("[[fault]]\nat_s = 1\nfor_s = 1\nwhat = \"" + std::string(what) + "\"\n", replay)
                  .find(std::string(what) + ": not in a replay"),
              std::string::npos);
  EXPECT_EQ(error_of("[[fault]]\nat_s = 1\nfor_s = 1\nwhat = \"imu.nan\"\n", replay), "");
}

TEST(FaultTimeline, TheShippedTimelinesAreGoodAndMeetEveryCameraSampleAndBehaviourPoint) {
  std::array<bool, kFaultPoints> met{};
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(WASP_SOURCE_DIR "/faults")) {
    if (entry.path().extension() != ".toml") continue;
    ++files;
    for (const auto& fault : load_fault_timeline(entry.path().string(), kScope))
      met[static_cast<std::size_t>(fault.order.point)] = true;
  }
  EXPECT_GE(files, 3);
  for (std::size_t i = 0; i < kFaultPoints; ++i)
    EXPECT_TRUE(met[i] || name_of(static_cast<FaultPoint>(i)) == "process.abort")
        << name_of(static_cast<FaultPoint>(i));
}

}  // namespace
}  // namespace wasp::scheduling
