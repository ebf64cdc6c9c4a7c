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

TEST(SimConfig, LensFocusAndShutterOfEitherCamera) {
  const SimConfig config = parse_sim_config(
      "[camera]\nlens = \"fisheye\"\nfisheye_k1 = -0.02\nfield_of_view_deg = 160.0\nantialias = false\n"
      "aperture_m = 0.004\nfocus_m = 1.5\nexposure_ms = 8.0\n"
      "[camera_down]\nenabled = true\nlens = \"pinhole\"\nwidth_px = 160\nrate_hz = 60\nbelow_m = 0.1\n",
      "t");
  EXPECT_EQ(config.camera.lens_kind, LensKind::kFisheye);
  EXPECT_FLOAT_EQ(config.camera.fisheye_k[0], -0.02f);
  EXPECT_NEAR(config.optics.field_of_view_rad, 2.79253f, 1e-4f);
  EXPECT_FALSE(config.optics.antialias);
  EXPECT_FLOAT_EQ(config.optics.aperture_m, 0.004f);
  EXPECT_FLOAT_EQ(config.optics.focus_m, 1.5f);
  EXPECT_NEAR(config.optics.exposure_s, 0.008f, 1e-7f);
  EXPECT_TRUE(config.down.enabled);
  EXPECT_EQ(config.down.rate_hz, 60);
  EXPECT_EQ(config.down.setup.geometry.lens_kind, LensKind::kPinhole);
  EXPECT_EQ(config.down.setup.geometry.intrinsics.width_px, 160);
  EXPECT_FLOAT_EQ(config.down.setup.geometry.position_body_m.z(), 0.1f);
  EXPECT_FALSE(SimConfig{}.down.enabled);
}

TEST(SimConfig, TheDownwardCameraLooksDownWithItsTopAhead) {
  const Mat3 R = parse_sim_config("", "t").down.setup.geometry.R_body_cam;
  EXPECT_TRUE((R * Vec3::UnitZ()).isApprox(Vec3(0, 0, 1), 1e-5f));
  EXPECT_TRUE((R * -Vec3::UnitY()).isApprox(Vec3(1, 0, 0), 1e-5f));
  EXPECT_TRUE(R.isApprox(SimConfig{}.down.setup.geometry.R_body_cam));
}

TEST(SimConfig, AnUnknownLensOrOneThatFoldsItsImageBackIsAnError) {
  EXPECT_NE(error_of("[camera]\nlens = \"mirror\"").find("none of \"pinhole\", \"fisheye\""), std::string::npos);
  EXPECT_NE(error_of("[camera]\nlens = 1").find("camera.lens"), std::string::npos);
  EXPECT_NE(error_of("[camera_down]\nlens = true").find("camera_down.lens"), std::string::npos);
  EXPECT_NE(error_of("[camera_down]\nfisheye_k1 = -0.3").find("camera_down.fisheye_k1"), std::string::npos);
  EXPECT_EQ(error_of("[camera_down]\nfisheye_k1 = -0.3\nfield_of_view_deg = 60.0"), "");
  EXPECT_NE(error_of("[camera_down]\nheight_px = 242").find("camera_down.height_px"), std::string::npos);
  EXPECT_NE(error_of("[camera]\nfield_of_view_deg = 300.0").find("10 ... 220"), std::string::npos);
  EXPECT_NE(error_of("[camera]\nfocus_m = 0.0"), "");
  EXPECT_NE(error_of("[camera]\naperture_m = -0.001"), "");
  EXPECT_NE(error_of("[camera]\nexposure_ms = 101.0").find("0 ... 100"), std::string::npos);
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
  EXPECT_EQ(file.optics.antialias, defaults.optics.antialias);
  EXPECT_FLOAT_EQ(file.optics.field_of_view_rad, defaults.optics.field_of_view_rad);
  EXPECT_EQ(file.optics.aperture_m, defaults.optics.aperture_m);
  EXPECT_EQ(file.optics.exposure_s, defaults.optics.exposure_s);
  EXPECT_EQ(file.optics.focus_m, defaults.optics.focus_m);
  EXPECT_EQ(file.down.enabled, defaults.down.enabled);
  EXPECT_EQ(file.down.rate_hz, defaults.down.rate_hz);
  EXPECT_EQ(file.down.setup.geometry.lens_kind, defaults.down.setup.geometry.lens_kind);
  EXPECT_EQ(file.down.setup.geometry.intrinsics.fx_px, defaults.down.setup.geometry.intrinsics.fx_px);
  EXPECT_EQ(file.down.setup.geometry.position_body_m, defaults.down.setup.geometry.position_body_m);
  EXPECT_FLOAT_EQ(file.down.setup.optics.field_of_view_rad, defaults.down.setup.optics.field_of_view_rad);
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
