// Turntable and known heights: simulated with known truth, on real rest, and what must be refused.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <sstream>

#include "calibration/calibrate_baro.h"
#include "calibration/calibrate_gyro.h"
#include "tests/calibration/synthetic_sensor.h"
#include "tests/tools/program.h"

namespace wasp::calibration {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

std::vector<double> values(const TomlSection& section, const std::string& key) {
  for (const auto& line : section.lines()) {
    if (!line.starts_with(key + " = ")) continue;
    std::string text = line.substr(key.size() + 3);
    for (char& c : text)
      if (c == '[' || c == ']' || c == ',') c = ' ';
    std::istringstream in(text);
    std::vector<double> out;
    for (double v = 0; in >> v;) out.push_back(v);
    return out;
  }
  ADD_FAILURE() << "no " << key;
  return {0, 0, 0};
}

struct Gyro {
  Vector3d bias{0.02, -0.01, 0.05}, scale{1.03, 0.98, 1.01}, slope = Vector3d::Zero();  ///< reads = scale * rate + bias
  double noise = 0.003;

  fs::path log(const fs::path& file, const Vector3d& rate, std::uint32_t seed, double from_degc = 25,
               double to_degc = 25, double most = 100) const {
    test::Table table(file, "t_s,gx_radps,gy_radps,gz_radps,temperature_degc");
    sim::Random random(seed);
    for (int i = 0; i < 4000; ++i) {
      const double spin_up = std::min(1.0, i / 400.0), degc = from_degc + (to_degc - from_degc) * i / 4000;
      Vector3d v = scale.cwiseProduct(rate * spin_up) + bias + slope * (degc - 25);
      for (int k = 0; k < 3; ++k) v[k] = std::clamp(v[k] + noise * random.normal(), -most, most);
      table.row({0.005 * i, v.x(), v.y(), v.z(), degc});
    }
    table.close();
    return file;
  }
};

std::string refusal_of(const GyroOptions& o) {
  ProgressBar bar("test");
  try {
    solve_gyro(o, bar);
  } catch (const Refusal& refusal) {
    return refusal.what();
  }
  return "";
}

/// Rest and both directions about each axis at 33 1/3 turns a minute.
GyroOptions turntable(const fs::path& folder, const Gyro& gyro) {
  GyroOptions o;
  o.samples.source = gyro.log(folder / "rest.csv", Vector3d::Zero(), 1).string();
  const double rate = 100.0 / 3 * 2 * std::numbers::pi / 60;
  for (int axis = 0; axis < 3; ++axis)
    for (const int sign : {1, -1}) {
      const auto name = std::string(1, "xyz"[axis]) + (sign > 0 ? "p" : "m") + ".csv";
      const auto file =
          gyro.log(folder / name, sign * rate * Vector3d::Unit(axis), static_cast<std::uint32_t>(10 + axis * 2 + sign));
      o.turns.push_back(std::string(1, "xyz"[axis]) + (sign > 0 ? ",+33.333333rpm," : ",-200degps,") + file.string());
    }
  return o;
}

TEST(CalibrateGyro, ThreePointsAnAxis) {
  const test::TemporaryFolder folder;
  const Gyro gyro;
  ProgressBar bar("test");
  const Solution s = solve_gyro(turntable(folder.path, gyro), bar);
  const auto neutral = values(s.flight.at(0), "gyro_neutral_radps"), matrix = values(s.flight.at(0), "gyro_matrix");
  const auto sigma = values(s.evidence, "bias_sigma");
  for (std::size_t i = 0; i < 3; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    // 20 means of 200 readings: 0.003 / sqrt(4000) = 5e-5 rad/s.
    EXPECT_NEAR(neutral[i], gyro.bias[k], 2e-4);
    EXPECT_LT(std::fabs(neutral[i] - gyro.bias[k]), 3.5 * sigma[i]);
    EXPECT_NEAR(matrix[4 * i], 1 / gyro.scale[k], 1e-4);
  }
}

TEST(CalibrateGyro, RestAloneGivesBiasAndItsSlope) {
  const test::TemporaryFolder folder;
  Gyro gyro;
  gyro.slope = {0.0005, -0.0003, 0.001};
  GyroOptions o;
  o.samples.source = gyro.log(folder.path / "warming.csv", Vector3d::Zero(), 3, 20, 40).string();
  ProgressBar bar("test");
  const Solution s = solve_gyro(o, bar);
  const auto slope = values(s.flight.at(0), "gyro_neutral_per_degc");
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(slope[i], gyro.slope[static_cast<Eigen::Index>(i)], 3e-5);
}

TEST(CalibrateGyro, RefusesRatesTooCloseOneDirectionSaturationAndTurningRest) {
  const test::TemporaryFolder folder;
  const Gyro gyro;
  GyroOptions o;
  o.samples.source = gyro.log(folder.path / "rest.csv", Vector3d::Zero(), 1).string();
  const auto turn = [&](const std::string& head, double rate, double most = 100) {
    return head + gyro.log(folder.path / (std::to_string(rate) + ".csv"), {0, 0, rate}, 2, 25, 25, most).string();
  };
  o.turns = {turn("z,0.1radps,", 0.1), turn("z,-0.1radps,", -0.1)};
  EXPECT_NE(refusal_of(o).find("too close"), std::string::npos);
  o.turns = {turn("z,3.5radps,", 3.5)};
  EXPECT_NE(refusal_of(o).find("other way"), std::string::npos);
  o.turns = {turn("z,3.5radps,", 3.5, 2.5), turn("z,-3.5radps,", -3.5)};
  EXPECT_NE(refusal_of(o).find("saturates"), std::string::npos);
  o.turns = {turn("z,-3.5radps,", 3.5), turn("z,3.5radps,", -3.5)};
  EXPECT_NE(refusal_of(o).find("sign"), std::string::npos);
  o.turns = {};
  o.samples.source = gyro.log(folder.path / "turning.csv", {0, 0, 2}, 5).string();
  EXPECT_NE(refusal_of(o).find("turning"), std::string::npos);
}

TEST(CalibrateGyro, TurnsAreReadStrictly) {
  EXPECT_NEAR(parse_turn("z,33.3333333rpm,a.csv").rate_radps, 3.4906585, 1e-6);
  EXPECT_NEAR(parse_turn("x,-200degps,a,b.csv").rate_radps, -3.4906585, 1e-6);
  EXPECT_EQ(parse_turn("y,3.49radps,b.csv").file, "b.csv");
  for (const char* bad : {"w,3radps,f", "z,3,f", "z,0radps,f", "z,3radps", "z,rpm,f"})
    EXPECT_THROW(parse_turn(bad), std::runtime_error) << bad;
}

TEST(CalibrateGyro, RealGyroscopeAtRest) {
  const fs::path file = fs::path(WASP_SOURCE_DIR) / "../shared/data/euroc_v101/imu_static.csv";
  if (!fs::exists(file)) GTEST_SKIP() << "no ../shared/data/euroc_v101";
  GyroOptions o;
  o.samples.source = file.string();
  ProgressBar bar("test");
  const Solution s = solve_gyro(o, bar);
  const auto bias = values(s.flight.at(0), "gyro_neutral_radps");
  // Its owners' filter later says (-0.002, 0.021, 0.077).
  EXPECT_NEAR(bias[0], -0.0023, 0.006);
  EXPECT_NEAR(bias[1], 0.0215, 0.006);
  EXPECT_NEAR(bias[2], 0.0769, 0.006);
}

std::string refusal_of(const BaroOptions& o) {
  ProgressBar bar("test");
  try {
    solve_baro(o, bar);
  } catch (const Refusal& refusal) {
    return refusal.what();
  }
  return "";
}

double pressure_at(double altitude_m) { return 1013.25 * std::pow(1 - altitude_m / 44330.77, 1 / 0.190263); }

/// Readings at each height in turn; the sensor shows `scale` times the change of pressure; the weather drifts.
fs::path heights_log(const fs::path& file, const std::vector<double>& heights, double scale, double noise_hpa,
                     double drift_hpa_per_s, int outlier_level = -1) {
  test::Table table(file, "t_s,height_m,pressure_hpa");
  sim::Random random(4);
  double t = 0;
  for (std::size_t level = 0; level < heights.size(); ++level)
    for (int i = 0; i < 200; ++i, t += 0.05) {
      const double p = pressure_at(120 + heights[level]), p0 = pressure_at(120);
      table.row({t, heights[level],
                 p0 + scale * (p - p0) + noise_hpa * random.normal() + drift_hpa_per_s * t +
                     (static_cast<int>(level) == outlier_level ? 2.0 : 0.0)});
    }
  table.close();
  return file;
}

TEST(CalibrateBaro, ScaleThroughDriftAndAWrongLevel) {
  const test::TemporaryFolder folder;
  BaroOptions o;
  o.table = heights_log(folder.path / "h.csv", {0, 5, 10, 15, 20, 15, 10, 5, 0}, 1.05, 0.03, 0.0005, 4).string();
  ProgressBar bar("test");
  const Solution s = solve_baro(o, bar);
  // 0.03 hPa is 0.25 m; means of 200: 0.018 m over 20 m and eight levels: 0.1 %.
  EXPECT_NEAR(values(s.flight.at(0), "pressure_scale")[0], 1 / 1.05, 0.004);
  EXPECT_NEAR(values(s.evidence, "drift_m_per_h")[0], -0.0005 * 3600 * 8.4, 1.5);
  EXPECT_EQ(values(s.evidence, "outliers")[0], 1);
}

TEST(CalibrateBaro, CountsOfARawConverter) {
  const test::TemporaryFolder folder;
  test::Table table(folder.path / "c.csv", "height_m,baro_counts");
  sim::Random random(4);
  for (int k = 0; k < 6; ++k)
    for (int i = 0; i < 100; ++i) table.row({2.0 * k, std::round(31000 - 14.2 * 2.0 * k + 6 * random.normal())});
  table.close();
  BaroOptions o;
  o.table = table.path.string();
  ProgressBar bar("test");
  const Solution s = solve_baro(o, bar);
  EXPECT_TRUE(s.flight.empty());
  const double per_count = values(s.evidence, "metres_per_unit")[0],
               sigma = values(s.evidence, "metres_per_unit_sigma")[0];
  EXPECT_NEAR(per_count, -1 / 14.2, 0.02 / 14.2);
  EXPECT_LT(std::fabs(per_count + 1 / 14.2), 3.5 * sigma);
}

TEST(CalibrateBaro, RefusesSmallSpansFewHeightsAndNonsense) {
  const test::TemporaryFolder folder;
  BaroOptions o;
  o.table = heights_log(folder.path / "s.csv", {0, 0.2, 0.4, 0.6}, 1, 0.03, 0).string();
  EXPECT_NE(refusal_of(o).find("span"), std::string::npos);
  o.table = heights_log(folder.path / "two.csv", {0, 20}, 1, 0.03, 0).string();
  EXPECT_NE(refusal_of(o).find("three"), std::string::npos);
  o.table = heights_log(folder.path / "noisy.csv", {0, 0.5, 1.0, 1.5}, 1, 1.5, 0).string();
  EXPECT_NE(refusal_of(o), "");
  o.table = heights_log(folder.path / "up.csv", {0, 5, 10, 15}, -1, 0.03, 0).string();
  EXPECT_NE(refusal_of(o).find("wrong"), std::string::npos);
}

}  // namespace
}  // namespace wasp::calibration
