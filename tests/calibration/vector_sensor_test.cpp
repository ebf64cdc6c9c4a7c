// Accelerometer and magnetometer on sensors of known faults: found within three of their own standard deviations and
// an absolute tolerance; and everything that does not determine the answer is refused.
#include "calibration/calibrate_vector_sensor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/calibration/synthetic_sensor.h"
#include "tests/tools/program.h"

namespace wasp::calibration {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;
using test::FaultySensor;

constexpr double kG = 9.80665;

std::vector<EllipsoidSample> readings(const FaultySensor& sensor, double norm, int count, std::uint32_t seed,
                                      double warm_span = 0) {
  sim::Random random(seed);
  std::vector<EllipsoidSample> out;
  for (int i = 0; i < count; ++i) {
    const double degc = 25 + warm_span * (random.uniform() - 0.5);
    out.push_back({sensor.read(norm * test::random_direction(random), random, degc), degc, i});
  }
  return out;
}

/// Errors in units of their own standard deviation: neutrals, then K's upper triangle, then slopes.
std::vector<double> normalised_errors(const Ellipsoid& e, const FaultySensor& truth) {
  std::vector<double> z;
  const Vector3d neutral = truth.neutral + truth.slope * (e.at_degc - 25);
  for (int i = 0; i < 3; ++i) z.push_back((e.neutral[i] - neutral[i]) / e.neutral_sigma[i]);
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < (e.model.cross_axis ? 3 : i + 1); ++j)
      z.push_back((e.K(i, j) - truth.K(i, j)) / e.K_sigma(i, j));
  for (int i = 0; i < 3 && e.model.temperature; ++i)
    z.push_back((e.neutral_per_degc[i] - truth.slope[i]) / e.neutral_per_degc_sigma[i]);
  return z;
}

/// Over many seeds the stated deviations are those of the errors: honest, neither boast nor excuse.
void expect_honest(const EllipsoidModel& model, const FaultySensor& sensor, double norm, int count, double warm_span) {
  double sum = 0;
  int n = 0, beyond_three = 0;
  for (std::uint32_t seed = 1; seed <= 30; ++seed) {
    const auto e = fit_ellipsoid(readings(sensor, norm, count, seed, warm_span), model, norm, 0);
    ASSERT_TRUE(e.has_value()) << seed;
    for (const double z : normalised_errors(*e, sensor)) {
      EXPECT_LT(std::fabs(z), 5.0) << "seed " << seed;
      sum += z * z, ++n, beyond_three += std::fabs(z) > 3 ? 1 : 0;
    }
  }
  EXPECT_GT(sum / n, 0.5);
  EXPECT_LT(sum / n, 1.6);
  EXPECT_LE(beyond_three, n / 50);
}

TEST(EllipsoidFit, StandardDeviationsAreHonestForSixParameters) {
  expect_honest({false, false}, {Vector3d(1.02, 0.97, 1.05).asDiagonal(), {0.3, -0.2, 0.5}, 0.02}, kG, 40, 0);
}

TEST(EllipsoidFit, StandardDeviationsAreHonestForNineParameters) {
  expect_honest({true, false}, {test::symmetric(1.02, 0.97, 1.05, 0.02, -0.015, 0.03), {0.3, -0.2, 0.5}, 0.02}, kG, 60,
                0);
}

TEST(EllipsoidFit, StandardDeviationsAreHonestWithTemperature) {
  expect_honest({true, true},
                {test::symmetric(1.02, 0.97, 1.05, 0.02, -0.015, 0.03), {0.3, -0.2, 0.5}, 0.02, {0.004, -0.003, 0.01}},
                kG, 120, 30);
}

TEST(EllipsoidFit, AThirdOfTheReadingsMayBeWrong) {
  const FaultySensor sensor{test::symmetric(1.1, 0.9, 1.0, 0.03, 0.02, -0.04), {0.1, -0.2, 0.15}, 0.002};
  auto samples = readings(sensor, 0.5, 300, 3);
  sim::Random random(9);
  for (std::size_t i = 0; i < samples.size(); i += 3)
    samples[i].value += random.uniform(0.1, 1.0) * test::random_direction(random);
  const auto e = fit_ellipsoid(samples, {true, false}, 0.5, 0);
  ASSERT_TRUE(e.has_value());
  EXPECT_LT((e->neutral - sensor.neutral).norm(), 0.002);
  EXPECT_LT((e->K - sensor.K).norm(), 0.01);
  EXPECT_GE(300 - e->used_count, 85u);  // a wrong one may fall onto the ellipsoid by chance
}

/// A 200 Hz log with rests of two seconds and turns of one between them.
struct Log {
  Log(const std::filesystem::path& file, const FaultySensor& sensor, const std::vector<Vector3d>& directions,
      double unit, std::uint32_t seed, double degc_span = 0, bool times = true)
      : table(file, times ? "t_s,ax,ay,az,temperature_degc" : "ax,ay,az") {
    sim::Random random(seed);
    for (std::size_t k = 0; k < directions.size(); ++k) {
      const double degc = 25 + degc_span * (static_cast<double>(k) / static_cast<double>(directions.size()) - 0.5);
      for (int i = 0; i < 400; ++i) add(sensor.read(unit * kG * directions[k], random, degc), degc, times);
      const Vector3d next = directions[(k + 1) % directions.size()];
      for (int i = 0; i < 200; ++i) {  // the hand turns and shakes it
        const Vector3d way =
            directions[k] + (next - directions[k]) * (i / 200.0) + 0.2 * test::random_direction(random);
        add(sensor.read(unit * kG * way, random, degc), degc, times);
      }
    }
    table.close();
  }
  void add(const Vector3d& v, double degc, bool times) {
    if (times)
      table.row({0.005 * n++, v.x(), v.y(), v.z(), degc});
    else
      table.row({std::round(v.x()), std::round(v.y()), std::round(v.z())});
  }
  test::Table table;
  int n = 0;
};

std::vector<Vector3d> spread(int count) {
  std::vector<Vector3d> out;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count, a = 2.399963 * i, r = std::sqrt(1 - z * z);
    out.emplace_back(r * std::cos(a), r * std::sin(a), z);
  }
  return out;
}

/// Rests in an order in which temperature and direction do not go together.
std::vector<Vector3d> mixed(int count, int step) {
  const auto directions = spread(count);
  std::vector<Vector3d> out;
  for (int i = 0; i < count; ++i) out.push_back(directions[static_cast<std::size_t>(i * step % count)]);
  return out;
}

VectorSensorOptions accel_options(const std::filesystem::path& file) {
  VectorSensorOptions o;
  o.sensor = {Sensor::kAccel, "accel", kG, 0.01, 0.01, "m/s^2"};
  o.samples.source = file.string();
  o.samples.unit = "m/s^2";
  return o;
}

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
  return {};
}

std::string refusal_of(const VectorSensorOptions& o) {
  ProgressBar bar("test");
  try {
    solve_vector_sensor(o, bar);
  } catch (const Refusal& refusal) {
    return refusal.what();
  }
  return "";
}

TEST(CalibrateAccel, FindsRestsAndTheSensorsFaults) {
  const test::TemporaryFolder folder;
  const FaultySensor sensor{test::symmetric(1.02, 0.97, 1.05, 0.01, -0.02, 0.015), {0.3, -0.2, 0.5}, 0.08};
  Log log(folder.path / "a.csv", sensor, spread(24), 1, 1);
  ProgressBar bar("test");
  const Solution s = solve_vector_sensor(accel_options(log.table.path), bar);
  const auto neutral = values(s.flight.at(0), "accel_neutral_mps2"), matrix = values(s.flight.at(0), "accel_matrix");
  ASSERT_EQ(neutral.size(), 3u);
  ASSERT_EQ(matrix.size(), 9u);
  // 24 rests of 400 readings: 0.08 / sqrt(400) = 0.004 each, so neutrals to about 0.004 / sqrt(24 / 3) = 0.0015.
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(neutral[static_cast<std::size_t>(i)], sensor.neutral[i], 0.006);
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(matrix[static_cast<std::size_t>(i)], sensor.K(i / 3, i % 3), 0.0012);
  EXPECT_LT(s.residual_rms, 0.01);
  EXPECT_EQ(s.samples, 24u);
  EXPECT_EQ(s.pictures.size(), 2u);
}

TEST(CalibrateAccel, TakesRawCountsWithoutTimesAndSlopesOfTemperature) {
  const test::TemporaryFolder folder;
  const double per_count = 0.0479;  // a 10-bit converter, 3.3 V, ADXL320
  const FaultySensor counts{Vector3d(per_count, 1.03 * per_count, 0.97 * per_count).asDiagonal(), {512, 498, 530}, 1.0};
  Log raw(folder.path / "raw.csv", counts, spread(20), 1, 2, 0, false);
  auto o = accel_options(raw.table.path);
  o.samples.unit = "counts";
  ProgressBar bar("test");
  const Solution s = solve_vector_sensor(o, bar);
  EXPECT_TRUE(s.flight.empty());  // nothing a flight could use
  const auto neutral = values(s.evidence, "neutral"), scale = values(s.evidence, "scale");
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(neutral[static_cast<std::size_t>(i)], counts.neutral[i], 0.5);
    EXPECT_NEAR(scale[static_cast<std::size_t>(i)] / counts.K(i, i), 1, 0.003);
  }
  const FaultySensor warm{Matrix3d::Identity(), {0.1, 0.2, -0.1}, 0.05, {0.01, -0.005, 0.02}};
  Log heat(folder.path / "heat.csv", warm, mixed(30, 11), 1, 3, 30);
  const Solution t = solve_vector_sensor(accel_options(heat.table.path), bar);
  const auto slope = values(t.flight.at(0), "accel_neutral_per_degc");
  ASSERT_EQ(slope.size(), 3u);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(slope[static_cast<std::size_t>(i)], warm.slope[i], 0.001);
}

TEST(CalibrateAccel, FindsCrossAxisTermsBesideADrift) {
  const test::TemporaryFolder folder;
  const FaultySensor sensor{
      test::symmetric(1.02, 0.97, 1.05, 0.02, -0.03, 0.025), {0.3, -0.2, 0.5}, 0.05, {0.02, -0.01, 0.03}};
  Log log(folder.path / "both.csv", sensor, mixed(36, 13), 1, 5, 30);
  ProgressBar bar("test");
  const Solution s = solve_vector_sensor(accel_options(log.table.path), bar);
  const auto matrix = values(s.flight.at(0), "accel_matrix"), slope = values(s.flight.at(0), "accel_neutral_per_degc");
  ASSERT_EQ(slope.size(), 3u);
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(matrix[static_cast<std::size_t>(i)], sensor.K(i / 3, i % 3), 0.002);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(slope[static_cast<std::size_t>(i)], sensor.slope[i], 0.001);
}

// It is turned from top to bottom while it warms: a drift then passes for scales and cross-axis terms.
TEST(CalibrateAccel, TemperatureThatGoesWithDirectionTellsNoSlope) {
  const test::TemporaryFolder folder;
  const FaultySensor sensor{Matrix3d::Identity(), {0.1, 0.2, -0.1}, 0.05, {0.01, -0.005, 0.02}};
  Log log(folder.path / "together.csv", sensor, spread(30), 1, 3, 30);
  ProgressBar bar("test");
  const Solution s = solve_vector_sensor(accel_options(log.table.path), bar);
  EXPECT_TRUE(values(s.flight.at(0), "accel_neutral_per_degc").empty());
  ASSERT_EQ(s.notes.size(), 1u);
  EXPECT_NE(s.notes[0].find("temperature changed by 29 degrees"), std::string::npos) << s.notes[0];
}

TEST(CalibrateAccel, SixFacesDetermineTheThesisModelAndNoMore) {
  const test::TemporaryFolder folder;
  const FaultySensor sensor{Vector3d(1.02, 0.97, 1.05).asDiagonal(), {0.3, -0.2, 0.5}, 0.05};
  std::vector<Vector3d> faces;
  for (int i = 0; i < 3; ++i) faces.push_back(Vector3d::Unit(i)), faces.push_back(-Vector3d::Unit(i));
  Log log(folder.path / "six.csv", sensor, faces, 1, 4);
  ProgressBar bar("test");
  const Solution s = solve_vector_sensor(accel_options(log.table.path), bar);
  const auto neutral = values(s.flight.at(0), "accel_neutral_mps2"), scale = values(s.evidence, "scale");
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(neutral[static_cast<std::size_t>(i)], sensor.neutral[i], 0.02);
    EXPECT_NEAR(scale[static_cast<std::size_t>(i)], sensor.K(i, i), 0.002);
  }
  EXPECT_FALSE(s.notes.empty());  // says that nothing is left to check it with
  auto o = accel_options(log.table.path);
  o.model = "full";
  EXPECT_NE(refusal_of(o).find("cross-axis"), std::string::npos);
}

TEST(CalibrateAccel, RefusesWhatDoesNotDetermineIt) {
  const test::TemporaryFolder folder;
  const FaultySensor sensor{Matrix3d::Identity(), {0.1, 0.1, 0.1}, 0.05};
  Log one(folder.path / "one.csv", sensor, {Vector3d(0, 0, -1)}, 1, 1);
  EXPECT_NE(refusal_of(accel_options(one.table.path)).find("rest"), std::string::npos);
  auto upper = spread(40);
  std::erase_if(upper, [](const Vector3d& d) { return d.z() < 0.3; });
  Log hemisphere(folder.path / "half.csv", sensor, upper, 1, 1);
  EXPECT_NE(refusal_of(accel_options(hemisphere.table.path)).find("gap"), std::string::npos);
  std::vector<Vector3d> level;
  for (int i = 0; i < 20; ++i) level.emplace_back(std::cos(0.31 * i), std::sin(0.31 * i), 0.05 * std::sin(2.0 * i));
  for (auto& d : level) d.normalize();
  Log band(folder.path / "band.csv", sensor, level, 1, 1);
  EXPECT_NE(refusal_of(accel_options(band.table.path)), "");
  // Never at rest: every reading another direction.
  test::Table moving(folder.path / "moving.csv", "t_s,ax,ay,az");
  sim::Random random(1);
  for (int i = 0; i < 6000; ++i) {
    const Vector3d v = sensor.read((kG + 2 * random.normal()) * test::random_direction(random), random);
    moving.row({0.005 * i, v.x(), v.y(), v.z()});
  }
  moving.close();
  EXPECT_NE(refusal_of(accel_options(moving.path)).find("rest"), std::string::npos);
  // At rest, but not linear: the norm is not constant under any ellipsoid.
  test::Table bent(folder.path / "bent.csv", "ax,ay,az");
  for (const Vector3d& d : spread(40)) {
    Vector3d v = kG * d;
    for (int i = 0; i < 3; ++i) v[i] += 0.03 * v[i] * std::fabs(v[i]) * (d.x() > 0 ? 1 : -1);
    bent.row({v.x(), v.y(), v.z()});
  }
  bent.close();
  EXPECT_NE(refusal_of(accel_options(bent.path)), "");
}

VectorSensorOptions mag_options(const std::filesystem::path& file, double norm = 0) {
  VectorSensorOptions o;
  o.sensor = {Sensor::kMag, "mag", norm, 0.1, 0.03, "gauss"};
  o.samples.source = file.string();
  return o;
}

/// Turned by hand for `seconds`: a smooth path over the sphere when `tumble`, else level turns.
std::filesystem::path mag_log(const std::filesystem::path& file, const FaultySensor& sensor, bool tumble,
                              double spikes) {
  test::Table table(file, "time_usec,xmag,ymag,zmag");
  sim::Random random(5);
  const Vector3d field_mgauss = 1000 * Vector3d(0.21, 0.02, 0.43);
  for (int i = 0; i < 6000; ++i) {
    const double t = 0.01 * i;
    const Eigen::Quaterniond q = Eigen::AngleAxisd(1.3 * t, Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(tumble ? 0.73 * t : 0.0, Vector3d::UnitY()) *
                                 Eigen::AngleAxisd(tumble ? 0.41 * t : 0.0, Vector3d::UnitX());
    Vector3d v = sensor.read(q.inverse() * field_mgauss, random);
    if (random.uniform() < spikes) v += 400 * test::random_direction(random);
    table.row({1e4 * i, std::round(v.x()), std::round(v.y()), std::round(v.z())});
  }
  table.close();
  return file;
}

TEST(CalibrateMag, HardAndSoftIronWithSpikes) {
  const test::TemporaryFolder folder;
  const FaultySensor sensor{test::symmetric(1.08, 0.95, 1.0, 0.05, -0.03, 0.02), {120, -80, 200}, 4};
  const double norm = 1e-3 * Vector3d(210, 20, 430).norm();
  ProgressBar bar("test");
  const Solution s = solve_vector_sensor(mag_options(mag_log(folder.path / "m.csv", sensor, true, 0.05), norm), bar);
  const auto neutral = values(s.flight.at(0), "mag_neutral_gauss"), matrix = values(s.flight.at(0), "mag_matrix");
  // 4 mgauss of noise on some thousand readings: 0.3 mgauss of neutral, 0.1 % of scale.
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(neutral[static_cast<std::size_t>(i)], 1e-3 * sensor.neutral[i], 1.5e-3);
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(matrix[static_cast<std::size_t>(i)], sensor.K(i / 3, i % 3), 0.004);
  // Without the norm the shape is the same, the mean scale one.
  const Solution free = solve_vector_sensor(mag_options(folder.path / "m.csv"), bar);
  const auto shape = values(free.flight.at(0), "mag_matrix");
  const double factor = std::cbrt(sensor.K.determinant());
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(shape[static_cast<std::size_t>(i)], sensor.K(i / 3, i % 3) / factor, 0.004);
}

TEST(CalibrateMag, RefusesLevelTurnsAndRest) {
  const test::TemporaryFolder folder;
  const FaultySensor sensor{Matrix3d::Identity(), {120, -80, 200}, 4};
  EXPECT_NE(refusal_of(mag_options(mag_log(folder.path / "level.csv", sensor, false, 0))), "");
  test::Table still(folder.path / "still.csv", "xmag,ymag,zmag");
  sim::Random random(1);
  for (int i = 0; i < 3000; ++i) {
    const Vector3d v = sensor.read({210, 20, 430}, random);
    still.row({v.x(), v.y(), v.z()});
  }
  still.close();
  EXPECT_NE(refusal_of(mag_options(still.path)), "");
}

}  // namespace
}  // namespace wasp::calibration
