#include "scheduling/replay_script.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace wasp::scheduling {
namespace {

class ReplayScriptTest : public ::testing::Test {
 protected:
  ReplayScriptTest() : folder_(std::filesystem::temp_directory_path() / ("wasp_script_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~ReplayScriptTest() override { std::filesystem::remove_all(folder_); }
  void write(const std::string& rows) {
    std::ofstream(folder_ / "cues.csv")
        << "exposed_at_ns,behaviour,frame_sequence,attitude_valid,q_w,q_x,q_y,q_z,rate_x_body_radps,rate_y_body_radps,"
           "rate_z_body_radps\n"
        << rows;
  }
  std::filesystem::path folder_;
};

TEST_F(ReplayScriptTest, FloatsComeBackToTheBit) {
  write("1000,a,7,1,0.999999881,0.000345466979,1.17549435e-38,-0.1,0.333333343,0,0\n");
  const auto scripts = load_replay_script(folder_.string());
  const ScriptedStep* step = find_step(scripts.at("a"), 7);
  ASSERT_NE(step, nullptr);
  EXPECT_EQ(step->attitude.q_ned_body[0], 0.999999881f);
  EXPECT_EQ(step->attitude.q_ned_body[2], 1.17549435e-38f);
  EXPECT_EQ(step->attitude.rate_body_radps[0], 0.333333343f);
  EXPECT_TRUE(step->attitude_valid);
  EXPECT_EQ(find_step(scripts.at("a"), 8), nullptr);
}

TEST_F(ReplayScriptTest, AbsentIsEmptyMalformedNamesTheLine) {
  EXPECT_TRUE(load_replay_script("/nowhere").empty());
  write("1000,a,7,1,1,0,0,0,0,0,0\n1000,a,x,1,1,0,0,0,0,0,0\n");
  try {
    load_replay_script(folder_.string());
    FAIL();
  } catch (const std::exception& e) {
    EXPECT_NE(std::string(e.what()).find("cues.csv:3"), std::string::npos) << e.what();
  }
}

TEST_F(ReplayScriptTest, SpecificForceComesBackToTheBitWhereItWasRecorded) {
  write("1000,a,7,1,1,0,0,0,0,0,0\n");
  EXPECT_FALSE(load_replay_script(folder_.string()).at("a")[0].accel_valid);  // older than these columns
  std::ofstream(folder_ / "cues.csv")
      << "exposed_at_ns,behaviour,frame_sequence,attitude_valid,q_w,q_x,q_y,q_z,rate_x_body_radps,rate_y_body_radps,"
         "rate_z_body_radps,accel_valid,accel_x_body_mps2,accel_y_body_mps2,accel_z_body_mps2\n"
      << "1000,a,7,1,1,0,0,0,0,0,0,1,0.333333343,-0.1,-9.80664921\n1001,a,8,1,1,0,0,0,0,0,0,0,0,0,0\n";
  const auto script = load_replay_script(folder_.string()).at("a");
  EXPECT_TRUE(script[0].accel_valid);
  EXPECT_EQ(script[0].accel_body_mps2, (std::array<float, 3>{0.333333343f, -0.1f, -9.80664921f}));
  EXPECT_FALSE(script[1].accel_valid);
}

}  // namespace
}  // namespace wasp::scheduling
