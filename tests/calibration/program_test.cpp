// wasp-calibrate as a program: exit codes, and what it writes goes into a flight.
#include <gtest/gtest.h>

#include "calibration/calibrations.h"
#include "scheduling/config.h"
#include "tests/calibration/synthetic_sensor.h"
#include "tests/tools/program.h"

namespace wasp::calibration {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

std::string calibrate(const std::string& arguments) {
  return test::program_path("wasp-calibrate") + " " + arguments + " 2>&1";
}

fs::path rests(const fs::path& file, int count, bool all_over) {
  test::Table table(file, "ax_mps2,ay_mps2,az_mps2");
  sim::Random random(2);
  for (int i = 0; i < count; ++i) {
    Vector3d d = test::random_direction(random);
    if (!all_over) d = (Vector3d(0, 0, -1) + 0.1 * d).normalized();
    const Vector3d v = 9.80665 * d + Vector3d(0.1, 0.2, 0.3) + 0.005 * test::random_direction(random);
    table.row({v.x(), v.y(), v.z()});
  }
  table.close();
  return file;
}

TEST(CalibrateProgram, WritesWhatAFlightTakes) {
  const test::TemporaryFolder folder;
  const auto csv = rests(folder.path / "rests.csv", 50, true);
  const auto out = folder.path / "deep" / "accel.toml";
  const auto [text, code] = test::run_shell(calibrate("accel " + csv.string() + " --rests --out " + out.string()));
  ASSERT_EQ(code, 0) << text;
  EXPECT_NE(text.find("100 %"), std::string::npos);  // the bar
  EXPECT_NEAR(scheduling::load_config({out.string()}, {}).imu.accel.neutral[2], 0.3f, 0.02f);
  const std::string toml = test::read_text(out);
  for (const char* key :
       {"[calibration.accel]", "date = ", "source = ", "samples = 50", "residual_rms = ", "neutral_sigma = "})
    EXPECT_NE(toml.find(key), std::string::npos) << key;
  const std::string svg = test::read_text(folder.path / "deep" / "accel_residuals.svg");
  EXPECT_TRUE(svg.starts_with("<svg xmlns=")) << svg.substr(0, 40);
  EXPECT_NE(svg.find("calibrated"), std::string::npos);
}

TEST(CalibrateProgram, RefusesWithCodeOneAndWritesNothing) {
  const test::TemporaryFolder folder;
  const auto csv = rests(folder.path / "rests.csv", 50, false);
  const auto out = folder.path / "accel.toml";
  const auto [text, code] = test::run_shell(calibrate("accel " + csv.string() + " --rests --out " + out.string()));
  EXPECT_EQ(code, 1) << text;
  EXPECT_NE(text.find("refused"), std::string::npos);
  EXPECT_FALSE(fs::exists(out));
}

TEST(CalibrateProgram, SaysWhichFileIsNoGood) {
  const auto [text, code] = test::run_shell(calibrate("mag /nowhere/at/all.csv"));
  EXPECT_EQ(code, 2);
  EXPECT_NE(text.find("/nowhere/at/all.csv"), std::string::npos);
}

TEST(CalibrateProgram, HelpNamesEveryCalibration) {
  const auto [text, code] = test::run_shell(calibrate("--help"));
  EXPECT_EQ(code, 0);
  for (const Calibration& row : calibrations())
    EXPECT_NE(text.find(std::string(row.name)), std::string::npos) << row.name;
}

}  // namespace
}  // namespace wasp::calibration
