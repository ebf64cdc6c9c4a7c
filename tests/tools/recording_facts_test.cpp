#include "tools/recording_facts.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "drivers/image_file.h"

namespace wasp::tools {
namespace {

namespace fs = std::filesystem;

TEST(RecordingFacts, GapsCountsAndWhatCannotBeDecoded) {
  const fs::path folder = fs::temp_directory_path() / ("wasp_facts_" + std::to_string(::getpid()));
  fs::remove_all(folder);
  fs::create_directories(folder / "rgb");
  std::ofstream index(folder / "rgb.txt");
  std::vector<std::uint8_t> pixels(64 * 64);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint8_t>(i * i / 7);
  for (int i = 0; i < 6; ++i) {
    const std::string name = "rgb/" + std::to_string(i) + ".png";
    drivers::save_png(folder / name, GrayView{pixels.data(), 64, 64, 64});
    index << 1.0 + 0.1 * i + (i > 3 ? 0.5 : 0.0) << " " << name << "\n";
  }
  index << "?\n";
  index.close();
  {
    std::fstream damaged(folder / "rgb/2.png", std::ios::in | std::ios::out | std::ios::binary);
    damaged.seekp(100);
    damaged.write("\0\0\0\0\0\0\0\0", 8);  // header and end are whole
  }
  const auto recording = drivers::Recording::open(folder);
  const RecordingFacts facts = facts_of(recording, true);
  EXPECT_EQ(facts.gray, 6u);
  EXPECT_EQ(facts.both, 0u);
  ASSERT_EQ(facts.gaps.size(), 1u);
  EXPECT_EQ(facts.gaps[0].after_entry, 3u);
  EXPECT_NEAR(facts.gaps[0].length_s, 0.6, 1e-6);
  EXPECT_NEAR(facts.median_interval_s, 0.1, 1e-6);
  ASSERT_EQ(facts.undecodable.size(), 1u);
  EXPECT_NE(facts.undecodable[0].find("2.png"), std::string::npos);
  EXPECT_EQ(facts.problems, 2u);
  EXPECT_EQ(facts_of(recording, false).undecodable.size(), 0u);
  const std::string text = facts_text(recording, facts);
  for (const char* part : {"layout        tum", "rgb.txt:7", "1 gaps, 2 problems", "1 unreadable lines"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
  const auto json = nlohmann::json::parse(facts_json(recording, facts));
  EXPECT_EQ(json["entries"], 6);
  EXPECT_EQ(json["counts"]["undecodable images"], 1);
  EXPECT_EQ(json["problems"].size(), 2u);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace wasp::tools
