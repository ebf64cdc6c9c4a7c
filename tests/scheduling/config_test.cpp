// Configuration is read strictly: file, line and value are named, nothing unknown passes.
#include "scheduling/config.h"

#include <gtest/gtest.h>

#include <unistd.h>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "behaviours.h"
#include "scheduling/default_config.h"

namespace wasp::scheduling {
namespace {

const std::vector<std::string> kNames{"ground_altitude", "edge_altitude"};

/// Those with a section in the shipped file, the two above first.
std::vector<std::string> shipped_names() {
  std::vector<std::string> names = kNames;
  for (const auto& row : all_behaviours())
    if (std::find(names.begin(), names.end(), row.name) == names.end()) names.push_back(row.name);
  return names;
}

class ConfigTest : public ::testing::Test {
 protected:
  std::string write(const std::string& text) {
    path_ = std::filesystem::temp_directory_path() / ("wasp_config_" + std::to_string(getpid()) + ".toml");
    std::ofstream(path_) << text;
    return path_.string();
  }
  /// Error text of loading `text`, empty if it loads.
  std::string error_of(const std::string& text) {
    try {
      load_config({write(text)}, kNames);
    } catch (const ConfigError& e) {
      return e.what();
    }
    return {};
  }
  void TearDown() override { std::filesystem::remove(path_); }
  std::filesystem::path path_;
};

TEST_F(ConfigTest, ShippedDefaultsLoadAndMatchTheBuiltInOnes) {
  const auto names = shipped_names();
  const Config file = load_config({WASP_SOURCE_DIR "/config/wasp.toml"}, names);
  const Config built_in = load_config({}, names);
  EXPECT_EQ(file.control_period_ns, built_in.control_period_ns);
  EXPECT_EQ(file.control_deadline_ns, built_in.control_deadline_ns);
  EXPECT_EQ(file.control.mission.leg_count, built_in.control.mission.leg_count);
  EXPECT_FLOAT_EQ(file.control.altitude_hold.kd_nspm, built_in.control.altitude_hold.kd_nspm);
  EXPECT_FLOAT_EQ(file.control.altitude_hold.mass_kg, built_in.control.altitude_hold.mass_kg);
  EXPECT_EQ(file.control_thread.priority, built_in.control_thread.priority);
  EXPECT_EQ(file.control.link_age_limit_ns, built_in.control.link_age_limit_ns);
  // The promises of docs/faults.md: limit, one tick, and 5 ms for the tick itself.
  EXPECT_LE(file.control.link_age_limit_ns + file.control_period_ns, 295 * kMillisecond);
  for (const auto& row : file.control.arbiter.rows)
    EXPECT_LE(row.age_limit_ns + file.control_period_ns, 145 * kMillisecond);
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(file.behaviours[i].enabled, i < kNames.size()) << names[i];
    EXPECT_EQ(file.behaviours[i].enabled, built_in.behaviours[i].enabled);
    EXPECT_EQ(file.control.arbiter.rows[i].height_rank, built_in.control.arbiter.rows[i].height_rank);
    EXPECT_EQ(file.behaviours[i].priority, built_in.behaviours[i].priority);
    TomlTable file_params = file.behaviour_params[i], built_in_params = built_in.behaviour_params[i];
    double a = -1, b = -2;
    file_params.number("edges_per_m", a, 0, 1000);
    built_in_params.number("edges_per_m", b, 0, 1000);
    if (names[i] == "edge_altitude") {
      EXPECT_EQ(a, b);
    }
  }
  EXPECT_EQ(built_in.control.arbiter.rows[0].height_rank, 0);  // without it nobody would say the height
}

TEST_F(ConfigTest, TheBuiltInTextIsTheShippedFileWithoutItsComments) {
  const toml::value file = toml::parse(WASP_SOURCE_DIR "/config/wasp.toml");
  std::istringstream text(kDefaultConfig);
  const toml::value built_in = toml::parse(text, "built-in");
  EXPECT_TRUE(file == built_in);
  EXPECT_GE(file.as_table().size(), 8u);
}

TEST_F(ConfigTest, APartialFileKeepsTheHeightRanks) {
  const Config c = load_config({write("[mission]\npatience_s = 3.0\n")}, kNames);
  EXPECT_EQ(c.control.arbiter.rows[0].height_rank, 0);
  EXPECT_EQ(c.control.arbiter.rows[1].height_rank, -1);
  EXPECT_EQ(c.control.mission.leg_count, 2);
}

TEST_F(ConfigTest, WhatIsNotSaidFollowsFromTheFlavour) {
  const Config own = load_config({}, kNames);
  EXPECT_EQ(own.autopilot.mode(), 1u);
  EXPECT_FLOAT_EQ(own.control.mission.patience_s, 20.f);
  EXPECT_EQ(own.control.failsafe_action, control::FailsafeAction::kDescend);
  const Config px4 = load_config({write("[autopilot]\nflavour = \"px4\"\n")}, kNames);
  EXPECT_EQ(px4.autopilot.mode(), 6u);
  EXPECT_FLOAT_EQ(px4.control.mission.patience_s, 120.f);
  EXPECT_EQ(px4.control.failsafe_action, control::FailsafeAction::kStopStream);
  const Config copter = load_config({write("[autopilot]\nflavour = \"ardupilot\"\nfollow_mode = 4\narm = false\n"
                                           "endpoint = \"serial:/dev/ttyS0:57600\"\n"
                                           "[control]\nfailsafe_action = \"descend\"\n[mission]\npatience_s = 7\n")},
                                    kNames);
  EXPECT_EQ(copter.autopilot.mode(), 4u);
  EXPECT_TRUE(copter.control.mission.pilot_arms);
  EXPECT_FLOAT_EQ(copter.control.mission.patience_s, 7.f);
  EXPECT_EQ(copter.control.failsafe_action, control::FailsafeAction::kDescend);
  EXPECT_LT(copter.autopilot.wish(0.26f).stream_hz, 40.0) << "a slow line";
  EXPECT_THROW(load_config({write("[autopilot]\nflavour = \"paparazzi\"\n")}, kNames), ConfigError);
}

TEST_F(ConfigTest, PoliciesAreReadWhereTheyMakeSense) {
  const Config c = load_config({write("[run]\nadmission = \"warn\"\n[threads.control]\noverrun = \"catch_up\"\n"
                                      "[threads.camera]\noverrun = \"stop\"\n"
                                      "[behaviour.edge_altitude]\nframes = \"in_order\"\n")},
                               kNames);
  EXPECT_EQ(c.admission, AdmissionMode::kWarn);
  EXPECT_EQ(c.control_thread.overrun, rt::OverrunPolicy::kCatchUp);
  EXPECT_EQ(c.camera_thread.overrun, rt::OverrunPolicy::kStop);
  EXPECT_FALSE(c.behaviours[0].frames_in_order);
  EXPECT_TRUE(c.behaviours[1].frames_in_order);
  EXPECT_NE(error_of("[threads.link]\noverrun = \"skip\"\n").find("overrun"), std::string::npos);
  EXPECT_NE(error_of("[threads.control]\noverrun = \"hurry\"\n").find("catch_up"), std::string::npos);
}

TEST_F(ConfigTest, TheBrakeOfAnAvoidIsInDegreesInTheFile) {
  EXPECT_NEAR(load_config({}, kNames).control.avoid_brake_rad, 0.08727f, 1e-4f);
  EXPECT_NEAR(load_config({write("[control]\navoid_brake_deg = 10.0\n")}, kNames).control.avoid_brake_rad, 0.17453f,
              1e-4f);
  EXPECT_EQ(load_config({write("[control]\navoid_brake_deg = 0.0\n")}, kNames).control.avoid_brake_rad, 0.f);
  EXPECT_NE(error_of("[control]\navoid_brake_deg = -5.0\n").find("avoid_brake_deg"), std::string::npos);
}

TEST_F(ConfigTest, LaterFilesOverrideSingleKeys) {
  const auto path = write("[control]\ndeadline_us = 7000\n");
  const Config c = load_config({WASP_SOURCE_DIR "/config/wasp.toml", path}, shipped_names());
  EXPECT_EQ(c.control_deadline_ns, 7 * kMillisecond);
  EXPECT_EQ(c.control_period_ns, 50 * kMillisecond);
  EXPECT_EQ(c.control.mission.leg_count, 2);
}

TEST_F(ConfigTest, BehavioursAreSwitchedByTheirSection) {
  const Config c = load_config({write("[behaviour.edge_altitude]\nenabled = false\n")}, {"edge_altitude", "nobody"});
  EXPECT_FALSE(c.behaviours[0].enabled);
  EXPECT_FALSE(c.behaviours[1].enabled);  // no section: not enabled
  EXPECT_FALSE(error_of("[behaviour.edge_altitude]\nenabled = 1\n").empty());
}

TEST_F(ConfigTest, TwoCamerasWithLensesOfTheirOwn) {
  const Config c = load_config({write("[camera]\nk1 = -0.25\n[camera_down]\nenabled = true\nrate_hz = 15\nfx_px = 90\n"
                                      "fisheye_k = [0.1, 0.0, 0.0, -0.02]\npitch_down_deg = 80\n")},
                               kNames);
  EXPECT_EQ(c.camera.lens_kind, LensKind::kPinhole);
  EXPECT_FLOAT_EQ(c.camera.intrinsics.k1, -0.25f);
  EXPECT_TRUE(c.camera_down.enabled);
  EXPECT_EQ(c.camera_down.rate_hz, 15.0);
  EXPECT_EQ(c.camera_down.geometry.lens_kind, LensKind::kFisheye);
  EXPECT_FLOAT_EQ(c.camera_down.geometry.intrinsics.fx_px, 90.f);
  EXPECT_FLOAT_EQ(c.camera_down.geometry.fisheye_k[3], -0.02f);
  EXPECT_TRUE(c.camera_down.geometry.R_body_cam.isApprox(R_body_cam_from_pitch_down(to_radians(Degrees{80.0}))));
  const Config shipped = load_config({}, kNames);
  EXPECT_FALSE(shipped.camera_down.enabled);
  EXPECT_NE(error_of("[camera]\nlens = \"mirror\"\n").find("fisheye"), std::string::npos);
  EXPECT_NE(error_of("[camera_down]\nfisheye_k = [1.0]\n").find("fisheye_k"), std::string::npos);
  EXPECT_NE(error_of("[camera_down]\ndriver = \"replay\"\n").find("driver"), std::string::npos);
}

TEST_F(ConfigTest, UnknownKeyNamesFileAndLine) {
  const std::string e = error_of("[control]\nrate_hz = 20.0\nturbo = true\n");
  EXPECT_NE(e.find("turbo"), std::string::npos) << e;
  EXPECT_NE(e.find(":3"), std::string::npos) << e;
}

TEST_F(ConfigTest, UnknownSectionsAreErrorsToo) {
  EXPECT_NE(error_of("[controll]\nrate_hz = 20.0\n").find("controll"), std::string::npos);
  EXPECT_NE(error_of("[behaviour.teleport]\npriority = 3\n").find("teleport"), std::string::npos);
  EXPECT_NE(error_of("[threads.ghost]\npriority = 3\n").find("ghost"), std::string::npos);
}

TEST_F(ConfigTest, OutOfRangeNamesTheRange) {
  const std::string e = error_of("[threads.control]\npriority = 120\n");
  EXPECT_NE(e.find("1 ... 99"), std::string::npos) << e;
  EXPECT_FALSE(error_of("[control]\nrate_hz = nan\n").empty());
  EXPECT_FALSE(error_of("[mission]\nheights_m = [0.5]\nseconds = [1.0, 2.0]\n").empty());
  EXPECT_FALSE(error_of("[control]\nmass_kg = 9.0\n").empty());
}

TEST_F(ConfigTest, WrongTypesAndBrokenSyntax) {
  EXPECT_FALSE(error_of("[control]\nrate_hz = \"fast\"\n").empty());
  EXPECT_FALSE(error_of("[threads.control]\npriority = 3.5\n").empty());
  EXPECT_FALSE(error_of("[run]\nstrict_syscalls = 1\n").empty());
  EXPECT_FALSE(error_of("[camera]\ndriver = \"crystal ball\"\n").empty());
  EXPECT_FALSE(error_of("control = 3\n").empty());
  EXPECT_FALSE(error_of("[control\n").empty());
}

TEST_F(ConfigTest, NumbersThatFitNoIntegerAreOutOfRange) {
  for (const char* number : {"1e300", "-1e300", "nan", "inf", "-inf"})
    EXPECT_NE(error_of("[camera]\nwidth_px = " + std::string(number) + "\n").find("must lie in"), std::string::npos)
        << number;
}

TEST_F(ConfigTest, ValuesThatDoNotFitEachOtherNameFileAndLine) {
  for (const char* text :
       {"\n[camera]\nposition_body_m = [1, 2]\n", "\n[mission]\nheights_m = [1.0, 2.0]\nseconds = [3]\n",
        "\n[control]\nmin_height_m = 5\nmax_height_m = 4\n", "\n[control]\nmass_kg = 50\nfull_thrust_n = 1\n"})
    EXPECT_NE(error_of(text).find(".toml:2"), std::string::npos) << text << error_of(text);
}

TEST_F(ConfigTest, AMissingFileIsNamed) {
  try {
    load_config({"/nowhere/wasp.toml"}, kNames);
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_NE(std::string(e.what()).find("/nowhere/wasp.toml"), std::string::npos);
  }
}

}  // namespace
}  // namespace wasp::scheduling
