#include "sim/sim_config.h"

#include <gtest/gtest.h>

#include <cmath>
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

TEST(SimConfig, TheKindOfWorldIsAWordAmongTheKinds) {
  const SimConfig config = parse_sim_config("[run]\nseed = 5\n[world]\nkind = \"corridor-obstacles\"", "t");
  EXPECT_EQ(config.world_kind, "corridor-obstacles");
  EXPECT_EQ(generated_scene(config).title, "corridor-obstacles");
  const std::string error = error_of("[world]\nkind = \"moon\"");
  EXPECT_NE(error.find("world.kind"), std::string::npos);
  for (const SceneKind& kind : scene_kinds()) EXPECT_NE(error.find(kind.name), std::string::npos) << kind.name;
  EXPECT_NE(error_of("[world]\nkind = 3"), "");
  EXPECT_EQ(parse_sim_config("", "t").world_kind, "laboratory");
}

TEST(SimConfig, TheRunsSeedMakesTheWorld) {
  SimConfig config;
  config.world_kind = "wall", config.seed = 3;
  EXPECT_EQ(generated_scene(config).world.vertices_ned_m, make_scene("wall", 3).world.vertices_ned_m);
}

TEST(SimConfig, APresetSetsVehicleAndCameraAndTheOtherKeysStandWhateverTheirOrder) {
  const SimConfig gumstix = parse_sim_config("[vehicle]\npreset = \"gumstix\"", "t");
  EXPECT_EQ(gumstix.vehicle.mass_kg, 0.7);
  EXPECT_NEAR((gumstix.camera.R_body_cam * Vec3::UnitZ()).z(), 1, 1e-6) << "looks straight down";
  const SimConfig kontron = parse_sim_config("[vehicle]\npreset = \"kontron\"", "t");
  EXPECT_EQ(kontron.vehicle.mass_kg, 1.23);
  EXPECT_NEAR((kontron.camera.R_body_cam * Vec3::UnitZ()).x(), 1, 1e-6) << "looks ahead";
  const SimConfig kinect = parse_sim_config("[vehicle]\npreset = \"kontron_kinect\"", "t");
  EXPECT_EQ(kinect.vehicle.mass_kg, SimConfig{}.vehicle.mass_kg);
  EXPECT_EQ(kinect.vehicle.inertia_kgm2.xx, SimConfig{}.vehicle.inertia_kgm2.xx);
  EXPECT_TRUE(kinect.camera.R_body_cam.isApprox(SimConfig{}.camera.R_body_cam));
  const SimConfig both =
      parse_sim_config("[camera]\npitch_down_deg = 45\n[vehicle]\nmass_kg = 0.9\npreset = \"gumstix\"", "t");
  EXPECT_EQ(both.vehicle.mass_kg, 0.9);
  EXPECT_NEAR((both.camera.R_body_cam * Vec3::UnitZ()).z(), std::sqrt(0.5), 1e-6);
  EXPECT_NE(error_of("[vehicle]\npreset = \"zeppelin\"").find("gumstix"), std::string::npos);
}

TEST(SimConfig, AnglesOfWindAndStandAreDegreesInTheFileOnly) {
  const SimConfig config = parse_sim_config(
      "[wind]\nmean_mps = 2\nmean_direction_deg = 90\n[stand]\nturntable = true\namplitude_degps = 90\n"
      "profile = \"steps\"",
      "t");
  EXPECT_NEAR(config.wind.from_rad, 1.5707963, 1e-6);
  EXPECT_NEAR(config.stand.amplitude_radps, 1.5707963, 1e-6);
  EXPECT_EQ(config.stand.profile, StandProfile::kSteps);
  EXPECT_NE(error_of("[wind]\ngust_time_s = 0"), "");
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
  EXPECT_EQ(file.world_kind, defaults.world_kind);
  EXPECT_EQ(file.vehicle.mass_kg, defaults.vehicle.mass_kg);
  EXPECT_EQ(file.pilot.cruise_mps, defaults.pilot.cruise_mps);
  EXPECT_EQ(file.wind.gust_time_s, defaults.wind.gust_time_s);
  EXPECT_EQ(file.stand.turntable, defaults.stand.turntable);
  EXPECT_NEAR(file.stand.amplitude_radps, defaults.stand.amplitude_radps, 1e-3);
  EXPECT_EQ(file.stand.period_s, defaults.stand.period_s);
  EXPECT_EQ(file.world.city.tallest_m, defaults.world.city.tallest_m);
  EXPECT_EQ(file.world.ground_edges_per_m, defaults.world.ground_edges_per_m);
  EXPECT_EQ(file.world.arena_step_at_s, defaults.world.arena_step_at_s);
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
