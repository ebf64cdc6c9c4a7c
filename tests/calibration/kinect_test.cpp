// A Kinect's depth model and its two cameras, from simulated data of known truth; and data that leave them open.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "calibration/calibrate_kinect_depth.h"
#include "calibration/calibrate_kinect_pair.h"
#include "calibration/kinect_pairs_fit.h"
#include "calibration/kinect_readings.h"
#include "scheduling/config.h"
#include "sim/sensor_model.h"
#include "tests/calibration/board_renderer.h"
#include "tests/tools/program.h"

namespace wasp::calibration {
namespace {

namespace fs = std::filesystem;
using drivers::KinectDepthModel, drivers::KinectModel;

/// The raw value, with fractions, that a model gives a depth.
double raw_of(const KinectDepthModel& model, double depth_m) {
  double low = 200, high = 1041;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (drivers::model_depth_m(model, middle) < depth_m ? low : high) = middle;
  }
  return low;
}

std::vector<double> distances(double from_m, double to_m, int n) {
  std::vector<double> out;
  for (int i = 0; i < n; ++i) out.push_back(from_m * std::pow(to_m / from_m, i / (n - 1.0)));
  return out;
}

struct Table {
  test::TemporaryFolder folder;
  std::string file = (folder.path / "readings.csv").string();

  /// Seven readings at each distance, in whole steps; the tape is 3 mm wrong, one standard deviation.
  Table(const KinectDepthModel& truth, const std::vector<double>& at_m, std::uint32_t seed,
        const std::function<double(double)>& tape = [](double z) { return z; }) {
    sim::Random random(seed);
    std::ofstream out(file);
    out << "raw,distance_m\n";
    for (const double z : at_m) {
      const double tape_m = tape(z) + 0.003 * random.normal();
      for (int i = 0; i < 7; ++i) out << std::lround(raw_of(truth, z) + 0.36 * random.normal()) << ',' << tape_m << '\n';
    }
  }
};

Solution solve(const std::string& file, const std::string& model = "auto") {
  ProgressBar bar("test");
  KinectDepthOptions o;
  o.table = file;
  o.model = model;
  return solve_kinect_depth(o, bar);
}

std::string refusal(const std::function<void()>& calibrate) {
  try {
    calibrate();
  } catch (const Refusal& r) {
    return r.what();
  }
  return "not refused";
}
bool says(const std::string& text, const std::string& what) { return text.find(what) != std::string::npos; }

/// What a flight makes of the section.
scheduling::Config configured(const Solution& s) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path / "solution.toml";
  std::ofstream(file) << s.flight.at(0).toml();
  return scheduling::load_config({file.string()}, {});
}

KinectDepthModel flown(const Solution& s) {
  const scheduling::Config c = configured(s);
  KinectDepthModel m;
  drivers::published_model(c.camera_settings.depth_model, m);
  std::copy(c.camera_settings.depth_coefficients.begin(), c.camera_settings.depth_coefficients.end(),
            m.coefficients.begin());
  m.range = {c.camera_settings.depth_range_m[0], c.camera_settings.depth_range_m[1]};
  return m;
}

/// Worst share of the depth by which `got` differs from `want` over the range.
double worst_share(const KinectDepthModel& got, const KinectDepthModel& want, double from_m, double to_m) {
  double worst = 0;
  for (double z = from_m; z <= to_m; z += 0.05)
    worst = std::max(worst, std::fabs(drivers::model_depth_m(got, raw_of(want, z)) / z - 1));
  return worst;
}

TEST(KinectDepthCalibration, FindsEveryModelItWasMadeWith) {
  for (const KinectDepthModel& truth : {drivers::kBurrusLinear, drivers::kMagnenatTangent, drivers::kThesisGaussians})
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {
      const Table table(truth, distances(0.5, 6.3, 16), seed);
      const Solution s = solve(table.file, std::string(drivers::name_of(truth.kind)));
      EXPECT_LT(worst_share(flown(s), truth, 0.5, 6.2), 0.015) << drivers::name_of(truth.kind) << " seed " << seed;
      EXPECT_LT(s.residual_rms, 1.0);
      EXPECT_EQ(s.pictures.size(), 2u);
      EXPECT_NEAR(flown(s).range.min_m, 0.475f, 0.02f);
      EXPECT_NEAR(flown(s).range.max_m, 6.6f, 0.1f);
    }
}

TEST(KinectDepthCalibration, ChoosesAModelThatTheSensorObeys) {
  const Table table(drivers::kThesisGaussians, distances(0.5, 6.3, 16), 4);
  EXPECT_EQ(flown(solve(table.file)).kind, KinectModel::kTwoGaussians) << "nothing else bends as it does";
  const Table straight(drivers::kBurrusLinear, distances(0.5, 6.3, 16), 4);
  EXPECT_LT(worst_share(flown(solve(straight.file)), drivers::kBurrusLinear, 0.5, 6.2), 0.015);
}

TEST(KinectDepthCalibration, ReadsPicturesOfAWallInEitherByteOrder) {
  test::TemporaryFolder folder;
  std::ofstream table(folder.path / "walls.csv");
  table << "file,distance_m\n";
  sim::SensorModel sensor({}, 640, 580, 9);
  const drivers::KinectTable to_mm = drivers::make_kinect_table(drivers::kBurrusLinear);
  int i = 0;
  for (const double z : distances(0.6, 5.0, 9)) {
    const std::vector<float> truth(640, static_cast<float>(z));
    std::vector<std::uint16_t> mm(640);
    std::string bytes;
    for (int row = 0; row < 480; ++row) {
      sensor.depth_row(static_cast<std::uint32_t>(i), row, truth.data(), mm.data());
      for (const std::uint16_t depth : mm) {
        const std::uint16_t raw = drivers::kinect_raw(to_mm, depth);
        const char low = static_cast<char>(raw & 0xff), high = static_cast<char>(raw >> 8);
        bytes += i % 2 == 0 ? std::string{low, high} : std::string{high, low};  // fakenect's, the format's
      }
    }
    const std::string name = "wall" + std::to_string(i++) + ".pgm";
    std::ofstream(folder.path / name, std::ios::binary) << "P5 640 480 65535\n" << bytes;
    table << name << ',' << z << '\n';
  }
  table << "missing.pgm,3.0\n";
  table.close();
  const Solution s = solve((folder.path / "walls.csv").string());
  EXPECT_LT(worst_share(flown(s), drivers::kBurrusLinear, 0.6, 5.0), 0.01);
  EXPECT_EQ(s.samples, 9u);
  bool told = false;
  for (const auto& note : s.notes) told |= says(note, "walls.csv:11") && says(note, "missing.pgm");
  EXPECT_TRUE(told);
}

TEST(KinectDepthCalibration, RefusesWhatLeavesItOpen) {
  const auto& truth = drivers::kBurrusLinear;
  const Table few(truth, {0.8, 2.0, 4.0}, 1), near(truth, distances(0.8, 1.6, 12), 1);
  EXPECT_PRED2(says, refusal([&] { solve(few.file); }), "3 distances, 4 are the least");
  EXPECT_PRED2(says, refusal([&] { solve(near.file); }), "the farthest must be 2.5 times the nearest");
  const Table seven(truth, distances(0.6, 5, 7), 1);
  EXPECT_PRED2(says, refusal([&] { solve(seven.file, "two-gaussians"); }), "7 distances, 8 are the least");
  EXPECT_NO_THROW(solve(seven.file, "linear"));
  const Table mistyped(truth, distances(0.6, 5, 9), 1, [](double z) { return std::fabs(z - 1.7) < 0.1 ? z * 1.25 : z; });
  EXPECT_PRED2(says, refusal([&] { solve(mistyped.file, "linear"); }), "is off by") << "names the row";
  const Table falling(truth, distances(0.6, 5, 9), 1, [](double z) { return 6 - z; });
  EXPECT_PRED2(says, refusal([&] { solve(falling.file); }), "raw values rise with distance");
  const Table straight_line(truth, distances(0.6, 5, 9), 1, [&](double z) { return 0.004 * (raw_of(truth, z) - 500); });
  EXPECT_PRED2(says, refusal([&] { solve(straight_line.file, "linear"); }), "misses the readings");
}

constexpr double kSquare = 30;
const cv::Size kBoard(9, 6);

struct Rig {
  Lens rgb, ir;
  Eigen::Matrix3d R;  ///< ir to rgb
  Eigen::Vector3d T_mm;
};

/// The baseline of a Kinect, turned by as much as table A.3 says.
Rig kinect_rig() {
  Rig rig;
  rig.rgb.intrinsics = {640, 480, 522.f, 525.f, 329.f, 262.f, 0.2f, -0.45f, -0.002f, 0.0015f, 0.f};
  rig.ir.intrinsics = {640, 480, 585.f, 583.f, 321.f, 238.f, -0.1f, 0.25f, -0.0008f, 0.001f, 0.f};
  rig.R = (Eigen::AngleAxisd(0.012, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(-0.018, Eigen::Vector3d::UnitY()) *
           Eigen::AngleAxisd(-0.0016, Eigen::Vector3d::UnitZ()))
              .toRotationMatrix();
  rig.T_mm = {20.9, -0.7, -3.4};
  return rig;
}

struct Shoot {
  int pairs = 16;
  double tilt_rad = 0.5;
  double moved_mm = 0;  ///< between the two images of a pair
};

void shoot(const fs::path& folder, const Rig& rig, const Shoot& how, std::uint32_t seed) {
  const test::BoardRenderer rgb(rig.rgb, kBoard, kSquare), ir(rig.ir, kBoard, kSquare);
  sim::Random random(seed);
  for (int i = 0; i < how.pairs; ++i) {
    const double z = random.uniform(420, 650);
    const Eigen::Vector3d centre(random.uniform(-0.5, 0.5) * (z * 0.5 - 130), random.uniform(-0.9, 0.9) * (z * 0.4 - 90), z);
    const auto pose = test::board_pose(kBoard, kSquare, centre, random.uniform(-how.tilt_rad, how.tilt_rad),
                                       random.uniform(-how.tilt_rad, how.tilt_rad), random.uniform(-0.3, 0.3));
    const Eigen::Vector3d moved(how.moved_mm * random.normal(), how.moved_mm * random.normal(), 0);
    const auto write = [&](const char* prefix, const cv::Mat& image) {
      cv::imwrite((folder / (prefix + std::to_string(100 + i) + ".png")).string(), image);
    };
    write("ir_", ir.render(pose.R, pose.t, 2.0, seed + static_cast<std::uint32_t>(2 * i)));
    write("rgb_", rgb.render(rig.R * pose.R, rig.R * (pose.t + moved) + rig.T_mm, 2.0,
                             seed + static_cast<std::uint32_t>(2 * i + 1)));
  }
}

Solution solve_pair(const fs::path& folder) {
  ProgressBar bar("test");
  KinectPairOptions o;
  o.folder = folder.string();
  o.square_mm = kSquare;
  return solve_kinect_pair(o, bar);
}

/// A key of the evidence.
std::vector<double> evidence(const Solution& s, const std::string& key) {
  for (const auto& line : s.evidence.lines()) {
    if (!line.starts_with(key + " =")) continue;
    std::string text = line.substr(line.find('=') + 1);
    text = text.substr(0, text.find('#'));
    for (char& c : text)
      if (c == '[' || c == ']' || c == ',') c = ' ';
    std::istringstream in(text);
    std::vector<double> numbers;
    for (double x = 0; in >> x;) numbers.push_back(x);
    return numbers;
  }
  return {};
}

TEST(KinectExtrinsics, FindsHowTheTwoCamerasStand) {
  for (const std::uint32_t seed : {1u, 2u}) {
    test::TemporaryFolder folder;
    const Rig rig = kinect_rig();
    shoot(folder.path, rig, {}, 100 * seed);
    const Solution s = solve_pair(folder.path);
    const auto T = evidence(s, "T_rgb_ir_m"), T_sigma = evidence(s, "T_sigma_m"), R = evidence(s, "R_rgb_ir");
    ASSERT_EQ(T.size(), 3u);
    ASSERT_EQ(R.size(), 9u);
    for (int k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      EXPECT_NEAR(1000 * T[i], rig.T_mm[k], k == 2 ? 4.0 : 2.0) << "axis " << k;
      EXPECT_LT(std::fabs(1000 * T[i] - rig.T_mm[k]), 5 * std::max(1000 * T_sigma[i], 0.2)) << "its own uncertainty";
    }
    const Eigen::Matrix3d found = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(R.data());
    EXPECT_LT(Eigen::AngleAxisd(found * rig.R.transpose()).angle(), 0.005);
    EXPECT_NEAR(evidence(s, "rgb_fx_px").at(0), 522, 4);
    EXPECT_NEAR(evidence(s, "ir_fx_px").at(0), 585, 4);
    EXPECT_NEAR(evidence(s, "rgb_cy_px").at(0), 262, 4);
    EXPECT_LT(s.residual_rms, 0.3);
    const scheduling::Config c = configured(s);
    EXPECT_NEAR(c.camera.intrinsics.fx_px, 522.f, 4.f);
  }
}

TEST(KinectExtrinsics, RefusesWhatLeavesThemOpen) {
  const Rig rig = kinect_rig();
  test::TemporaryFolder few, parallel, moved, alone;
  shoot(few.path, rig, {.pairs = 5}, 7);
  EXPECT_PRED2(says, refusal([&] { solve_pair(few.path); }), "8 pairs are the least");
  shoot(parallel.path, rig, {.pairs = 10, .tilt_rad = 0.01}, 8);
  const std::string why = refusal([&] { solve_pair(parallel.path); });
  EXPECT_TRUE(says(why, "nearly parallel") || says(why, "finds no lenses")) << why;
  shoot(moved.path, rig, {.pairs = 12, .moved_mm = 6}, 9);
  EXPECT_PRED2(says, refusal([&] { solve_pair(moved.path); }), "did the board move");
  cv::imwrite((alone.path / "rgb_1.png").string(), cv::Mat::zeros(480, 640, CV_8U));
  EXPECT_THROW(solve_pair(alone.path), std::runtime_error);
}

}  // namespace
}  // namespace wasp::calibration
