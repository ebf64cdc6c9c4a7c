#include "sim/sim_config.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace wasp::sim {
namespace {

/// What a text is refused with; empty when it is accepted.
std::string error_of(const std::string& text) {
  try {
    parse_sim_config(text, "test.toml");
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return {};
}

TEST(SimConfig, UnknownKeysAndSectionsAreErrorsThatNameThem) {
  EXPECT_NE(error_of("[camera]\nrate_hx = 30").find("camera.rate_hx"), std::string::npos);
  EXPECT_NE(error_of("[cammera]\nrate_hz = 30").find("cammera.rate_hz"), std::string::npos);
  EXPECT_NE(error_of("seed = 1").find("seed"), std::string::npos);
  EXPECT_NE(error_of("[run]\nseed = 1\nseed = 2"), "");
  EXPECT_NE(error_of("[run\n"), "");
}

TEST(SimConfig, ValuesOutOfRangeOrOfTheWrongKindAreErrors) {
  EXPECT_NE(error_of("[camera]\nrate_hz = 500").find("allowed are 1 ... 120"), std::string::npos);
  EXPECT_NE(error_of("[camera]\nrate_hz = nan"), "");
  EXPECT_NE(error_of("[camera]\nrate_hz = \"fast\"").find("camera.rate_hz"), std::string::npos);
  EXPECT_NE(error_of("[camera]\nwidth_px = 642").find("multiples of 4"), std::string::npos);
  EXPECT_NE(error_of("[sensor]\nmin_range_m = 2.0\nmax_range_m = 1.0"), "");
  EXPECT_EQ(error_of("[camera]\nrate_hz = 60"), "");
}

TEST(SimConfig, SetsWhatItSays) {
  const SimConfig config =
      parse_sim_config("[run]\nseed = 9\nsafety_pilot = false\n[camera]\npitch_down_deg = 90", "t");
  EXPECT_EQ(config.seed, 9u);
  EXPECT_FALSE(config.safety_pilot);
  EXPECT_NEAR((config.camera.R_body_cam * Vec3::UnitZ()).z(), 1, 1e-6) << "looks straight down";
}

TEST(SimConfig, TheDocumentedFileListsEveryKeyAndHoldsTheDefaults) {
  const std::string path = WASP_SOURCE_DIR "/config/sim.toml";
  const SimConfig file = load_sim_config(path), defaults;
  EXPECT_EQ(file.seed, defaults.seed);
  EXPECT_EQ(file.camera_rate_hz, defaults.camera_rate_hz);
  EXPECT_TRUE(file.camera.R_body_cam.isApprox(defaults.camera.R_body_cam));
  EXPECT_EQ(file.camera.position_body_m, defaults.camera.position_body_m);
  EXPECT_EQ(file.imu.accel_bias_mps2, defaults.imu.accel_bias_mps2);
  EXPECT_EQ(file.sensor.depth_noise_steps, defaults.sensor.depth_noise_steps);
  EXPECT_EQ(file.clock_offset_s, defaults.clock_offset_s);
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  for (const std::string& key : sim_config_keys()) {
    std::string line = key.substr(key.find('.') + 1);
    line += " = ";
    EXPECT_NE(text.str().find(line), std::string::npos) << key;
  }
}

TEST(SimConfig, AMissingFileIsNamed) {
  try {
    load_sim_config("/nonexistent/sim.toml");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/nonexistent/sim.toml"), std::string::npos);
  }
}

}  // namespace
}  // namespace wasp::sim
