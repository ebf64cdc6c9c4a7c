// The layouts people publish, whole and damaged, as they come: CRLF, comments, no last newline, unequal lists.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "drivers/image_file.h"
#include "drivers/recording.h"
#include "drivers/rising_times.h"

namespace wasp::drivers {
namespace {

namespace fs = std::filesystem;

class Layouts : public testing::Test {
 protected:
  void SetUp() override {
    folder = fs::temp_directory_path() / ("wasp_layouts_" + std::to_string(::getpid()));
    fs::remove_all(folder);
    fs::create_directories(folder);
  }
  void TearDown() override { fs::remove_all(folder); }

  void depth(const std::string& name) const {
    const std::vector<std::uint16_t> pixels(32 * 24, 1000);
    fs::create_directories((folder / name).parent_path());
    save_png(folder / name, DepthView{pixels.data(), 32, 24, 32});
  }
  void gray(const std::string& name, int width = 32) const {
    const std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width) * 24, 9);
    fs::create_directories((folder / name).parent_path());
    save_png(folder / name, GrayView{pixels.data(), width, 24, width});
  }
  void text(const std::string& name, const std::string& content) const {
    fs::create_directories((folder / name).parent_path());
    std::ofstream(folder / name, std::ios::binary) << content;
  }
  static std::string told(const Recording& r) {
    std::string all;
    for (const auto& line : r.problems()) all += line + "\n";
    return all;
  }

  fs::path folder;
};

TEST(RisingTimes, OneWrongTimeCostsOneEntry) {
  using enum TimeFate;
  EXPECT_EQ(keep_rising({1, 2, 99, 3, 4}), (std::vector{kKept, kKept, kUnordered, kKept, kKept}));
  EXPECT_EQ(keep_rising({10, 9, 16}), (std::vector{kKept, kUnordered, kKept}));
  EXPECT_EQ(keep_rising({1, 3, 2, 4}), (std::vector{kKept, kKept, kUnordered, kKept}));
  EXPECT_EQ(keep_rising({5, 5, 6}), (std::vector{kKept, kDuplicate, kKept}));
  EXPECT_TRUE(keep_rising({}).empty());
}

TEST_F(Layouts, TumJoinsTheNearestAndKeepsWhatHasNoPartner) {
  std::string rgb = "# color images\r\n# file: 'rgbd_dataset_freiburg2_desk.bag'\r\n# timestamp filename\r\n",
              dep = rgb;
  for (int i = 0; i < 6; ++i) {
    gray("rgb/" + std::to_string(i) + ".png");
    rgb += "1305031102." + std::to_string(100000 + 33000 * i) + " rgb/" + std::to_string(i) + ".png\r\n";
  }
  for (const int i : {0, 1, 3, 4}) {  // 10 ms after; the one of frame 2 was lost, of frame 5 too
    depth("depth/" + std::to_string(i) + ".png");
    dep += "1305031102." + std::to_string(110000 + 33000 * i) + "   depth/" + std::to_string(i) + ".png\r\n";
  }
  rgb.resize(rgb.size() - 2);  // no newline at the end
  text("rgb.txt", rgb);
  text("depth.txt", dep);
  text("groundtruth.txt",
       "# ground truth trajectory\n1305031102.0000 1 2 3 0 0 0 1\n1305031102.0900 1 2 3 0 0 0.0998 0.995\n"
       "1305031102.1000 1 2 3 0 0 0 7\n1305031102.1500 1 2 3\n1305031102.3000 1 2 4 0 0 0 1");
  text("accelerometer.txt", "# t ax ay az\n1305031102.05 0.1 -9.8 0.2\n1305031102.06 0.1 -9.8 nan\n");
  const Recording r = Recording::open(folder);
  EXPECT_EQ(r.layout(), "tum");
  ASSERT_EQ(r.entries().size(), 6u) << told(r);
  int both = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    both += r.entries()[i].has_depth() && r.entries()[i].has_gray() ? 1 : 0;
    if (i > 0) {
      EXPECT_GT(r.entries()[i].sequence, r.entries()[i - 1].sequence);
    }
  }
  EXPECT_EQ(both, 4);
  EXPECT_NEAR(r.intrinsics().fx_px, 520.9f / 20, 0.01f);  // the published camera of the sequence named, at 32 px
  EXPECT_EQ(r.motion().poses.samples.size(), 3u);
  EXPECT_EQ(r.motion().inertial.samples.size(), 1u);
  EXPECT_EQ(r.problem_counts().count(ProblemKind::kUnreadable), 3u) << told(r);
  EXPECT_NE(told(r).find("groundtruth.txt:4"), std::string::npos) << told(r);
  EXPECT_NE(told(r).find("groundtruth.txt:5"), std::string::npos) << told(r);
  EXPECT_NE(told(r).find("accelerometer.txt:3"), std::string::npos) << told(r);
}

TEST_F(Layouts, TumDamageIsCountedByKind) {
  for (int i = 0; i < 8; ++i) gray("rgb/" + std::to_string(i) + ".png", i == 6 ? 16 : 32);
  fs::resize_file(folder / "rgb/1.png", 50);
  fs::remove(folder / "rgb/2.png");
  text("rgb.txt",
       "1.0 rgb/0.png\n1.1 rgb/1.png\n1.2 rgb/2.png\n900.0 rgb/3.png\n1.4 rgb/4.png\n1.4 rgb/5.png\n1.6 rgb/6.png\n"
       "what is this\n");
  const Recording r = Recording::open(folder);
  const auto& p = r.problem_counts();
  EXPECT_EQ(r.entries().size(), 2u) << told(r);
  EXPECT_EQ(p.count(ProblemKind::kDamaged), 1u);
  EXPECT_EQ(p.count(ProblemKind::kMissing), 1u);
  EXPECT_EQ(p.count(ProblemKind::kUnordered), 1u);
  EXPECT_EQ(p.count(ProblemKind::kDuplicate), 1u);
  EXPECT_EQ(p.count(ProblemKind::kOtherSize), 1u);
  EXPECT_EQ(p.count(ProblemKind::kUnreadable), 1u);
  EXPECT_EQ(p.count(ProblemKind::kUnlisted), 1u);  // 7.png
  EXPECT_EQ(p.total(), 7u);
  for (const char* where : {"rgb.txt:2", "rgb.txt:3", "rgb.txt:4", "rgb.txt:6", "rgb.txt:7", "rgb.txt:8", "7.png"})
    EXPECT_NE(told(r).find(where), std::string::npos) << where << " in\n" << told(r);
}

TEST_F(Layouts, AFloodOfProblemsIsCountedAndNotPrinted) {
  gray("rgb/0.png");
  std::string index = "1.0 rgb/0.png\n";
  for (int i = 0; i < 500; ++i) index += "garbage\n";
  text("rgb.txt", index);
  const Recording r = Recording::open(folder);
  EXPECT_EQ(r.problem_counts().count(ProblemKind::kUnreadable), 500u);
  EXPECT_EQ(r.problems().size(), RecordingProblems::kShown + 1);
  EXPECT_NE(r.problems().back().find("480 more"), std::string::npos);
}

TEST_F(Layouts, SevenScenesHasColourPosesAndGaps) {
  for (const int i : {10, 11, 13}) {
    const std::string stem = "seq-01/frame-0000" + std::to_string(i);
    depth(stem + ".depth.png");
    if (i != 11) gray(stem + ".color.png");
    text(stem + ".pose.txt", i == 13 ? "1 0 0 0\n0 1 0 0\n0 0 9 0\n0 0 0 1\n"
                                     : "  1.0e+00 0 0 1\t\r\n 0 1 0 2\r\n 0 0 1 3\r\n 0 0 0 1\r\n\r\n");
  }
  const Recording r = Recording::open(folder / "seq-01");
  EXPECT_EQ(r.layout(), "7scenes");
  ASSERT_EQ(r.entries().size(), 3u);
  EXPECT_TRUE(r.entries()[0].has_gray());
  EXPECT_FALSE(r.entries()[1].has_gray());
  EXPECT_NEAR(to_seconds(r.entries()[2].offset_ns), 0.1, 1e-6);
  ASSERT_EQ(r.motion().poses.samples.size(), 2u);
  EXPECT_DOUBLE_EQ(r.motion().poses.samples[0].position_m.y(), 2);
  EXPECT_FALSE(r.motion().poses.level);
  EXPECT_EQ(r.problem_counts().count(ProblemKind::kAlone), 1u) << told(r);
  EXPECT_EQ(r.problem_counts().count(ProblemKind::kDamaged), 1u) << told(r);
  try {
    Recording::open(folder);
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("name one of them: seq-01"), std::string::npos) << error.what();
  }
}

constexpr const char* kCameraYaml =
    "%YAML:1.0\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0.0, -1.0, 0.0, 0.1,\n         1.0, 0.0, "
    "0.0, 0.2,\n"
    "         0.0, 0.0, 1.0, 0.3,\n         0.0, 0.0, 0.0, 1.0]\nrate_hz: 20\nresolution: [32, 24]\ncamera_model: "
    "pinhole\n"
    "intrinsics: [30.5, 31.5, 15.5, 11.5] #fu, fv, cu, cv\ndistortion_model: radial-tangential\n"
    "distortion_coefficients: [-0.28, 0.07, 0.0002, 1.8e-05]\n";

TEST_F(Layouts, EurocAsDownloaded) {
  std::string index = "#timestamp [ns],filename\r\n", imu = "#timestamp [ns],wx,wy,wz,ax,ay,az\r\n",
              truth = "#timestamp,p,p,p,qw,qx,qy,qz,v,v,v,b,b,b,b,b,b\r\n";
  const auto stamp = [](int ms) { return std::to_string(1403715273262142976LL + ms * 1'000'000LL); };
  for (int i = 0; i < 5; ++i) {
    gray("mav0/cam0/data/" + stamp(50 * i) + ".png");
    index += stamp(50 * i) + "," + stamp(50 * i) + ".png\r\n";
  }
  for (int ms = -100; ms <= 300; ms += 5) {
    imu += stamp(ms) + ",0.1,0.2,0.3,9.3,0.5,-3.8\r\n";
    truth += stamp(ms) + ",0.8,2.1,0.9,1,0,0,0,0,0,0,0,0,0,0,0,0\r\n";
  }
  imu += stamp(305) + ",0.1,0.2";  // the disk was full
  text("mav0/cam0/data.csv", index);
  text("mav0/cam0/sensor.yaml", kCameraYaml);
  text("mav0/imu0/data.csv", imu);
  text("mav0/state_groundtruth_estimate0/data.csv", truth);
  for (const fs::path& opened : {folder, folder / "mav0", folder / "mav0" / "cam0"}) {
    const Recording r = Recording::open(opened);
    EXPECT_EQ(r.layout(), "asl");
    EXPECT_EQ(r.entries().size(), 5u) << told(r);
    EXPECT_FLOAT_EQ(r.intrinsics().fx_px, 30.5f);
    EXPECT_FLOAT_EQ(r.intrinsics().k1, -0.28f);
    EXPECT_EQ(r.motion().inertial.samples.size(), 81u);
    ASSERT_TRUE(r.motion().inertial.R_cam_imu.has_value());
    // The camera's right is the body's y, so the body's x rate is about the camera's negative down axis.
    EXPECT_NEAR((*r.motion().inertial.R_cam_imu * Eigen::Vector3d(1, 0, 0)).y(), -1, 1e-9);
    EXPECT_EQ(r.motion().poses.samples.size(), 81u);
    EXPECT_EQ(r.problem_counts().total(), 1u) << told(r);
    EXPECT_NE(told(r).find("data.csv:83"), std::string::npos) << told(r);
    EXPECT_TRUE(attitude_of(r.motion(), r.geometry().R_body_cam, r.begins_at_ns()).has_value());
    EXPECT_FALSE(attitude_of(r.motion(), r.geometry().R_body_cam, r.begins_at_ns() + kSecond).has_value());
  }
  text("mav0/cam0/sensor.yaml", "camera_model: omni\nintrinsics: [1, 2, 3, 4]\nresolution: [32, 24]\n");
  const Recording r = Recording::open(folder);
  EXPECT_NE(told(r).find("sensor.yaml:2: camera model 'omni'"), std::string::npos) << told(r);
  EXPECT_FALSE(r.motion().inertial.R_cam_imu.has_value());
}

TEST_F(Layouts, RawseedsSession) {
  const auto name = [](int i) { return "FRONTAL_123560466" + std::to_string(i) + ".906455.png"; };
  std::string list;
  for (int i = 0; i < 4; ++i) {
    if (i != 2) gray("Bicocca/FRONTAL/" + name(i));
    list += name(i) + "\n";
  }
  gray("Bicocca/FRONTAL/FRONTAL_x.png");
  text("Bicocca/Bicocca-LISTS/Bicocca-FRONTAL.lst", list);
  text("Bicocca/Bicocca-IMU_STRETCHED.csv",
       "1235604660.080244, 34262,   0.029,  -0.152,   9.786,  -0.001,   0.002,  -0.014,   0.296,  -0.462,  -0.718,"
       "   0.1325,  -0.9912,   0.0005,   0.9910,   0.1325,  -0.0169,   0.0167,   0.0027,   0.9999\n"
       "1235604660.090244, 34263, 0.029\n");
  text("Bicocca/Bicocca-GROUNDTRUTH.csv",
       "1235604660.90,-0.35,-6.36,1.396,0,0,0,0,0,0,0,0,0\n1235604661.00,-0.34,-6.35,1.400,0,0,0,0,0,0,0,0,0\n");
  for (const char* opened : {"Bicocca", "Bicocca/FRONTAL"}) {
    const Recording r = Recording::open(folder / opened);
    EXPECT_EQ(r.layout(), "rawseeds");
    EXPECT_EQ(r.entries().size(), 3u) << told(r);
    EXPECT_EQ(r.begins_at_ns(), 1235604660'906455000);
    ASSERT_EQ(r.motion().inertial.samples.size(), 1u);
    EXPECT_DOUBLE_EQ(r.motion().inertial.samples[0].accel_mps2.z(), 9.786);
    EXPECT_DOUBLE_EQ(r.motion().inertial.samples[0].gyro_radps.z(), -0.014);
    EXPECT_EQ(r.motion().poses.samples.size(), 2u);
    EXPECT_EQ(r.problem_counts().count(ProblemKind::kMissing), 1u) << told(r);
    EXPECT_NE(told(r).find("FRONTAL.lst:3"), std::string::npos) << told(r);
    EXPECT_EQ(r.problem_counts().count(ProblemKind::kUnreadable), 2u) << told(r);  // the name, the short row
  }
  // On level ground, heading 1.4 rad left of the world's x: the vehicle is level in NED, its nose at 90 degrees - 80.
  const Recording r = Recording::open(folder / "Bicocca");
  const auto attitude = attitude_of(r.motion(), r.geometry().R_body_cam, r.begins_at_ns());
  ASSERT_TRUE(attitude.has_value());
  const auto& q = attitude->q_ned_body;
  const Euler e = euler_from_quat(Quat(q[0], q[1], q[2], q[3]));
  EXPECT_NEAR(e.roll_rad, 0, 1e-5);
  EXPECT_NEAR(e.pitch_rad, 0, 1e-5);
  EXPECT_NEAR(e.yaw_rad, 1.5708 - 1.3963, 1e-3);
}

TEST_F(Layouts, HoverTablesWithHoles) {
  for (int n = 100; n < 106; ++n) gray("test0" + std::to_string(n) + ".png");
  std::string truth = "frame,t_s,h\n", raw = "time_s,latest_image_frame,X_m,Y_m,Z_m,qx,qy,qz\n";
  for (int n = 100; n < 107; ++n)
    if (n != 103) truth += std::to_string(n) + "," + std::to_string(1.0 + 0.016 * (n - 100)) + ",1\n";
  for (int i = 0; i < 120; ++i)
    raw += std::to_string(0.98 + 0.002 * i) + "," + std::to_string(95 + (i / 8)) + ",0,0,1,0,0,0.1\n";
  text("gt_per_frame.csv", truth);
  text("mocap_500hz_raw.csv", raw + "1.9,120,0,0,1,0.9,0.9,0.9\n");
  const Recording r = Recording::open(folder);
  EXPECT_EQ(r.layout(), "hover_mocap");
  EXPECT_EQ(r.entries().size(), 5u) << told(r);  // frame 103 has no time
  EXPECT_EQ(r.problem_counts().count(ProblemKind::kAlone), 1u) << told(r);
  EXPECT_EQ(r.problem_counts().count(ProblemKind::kMissing), 1u) << told(r);  // frame 106 has no image
  EXPECT_EQ(r.problem_counts().count(ProblemKind::kUnreadable), 1u) << told(r);
  EXPECT_EQ(r.entries()[1].stamped_ns, 1'076'000'000);
  EXPECT_EQ(r.motion().poses.samples.size(), 120u);
}

TEST_F(Layouts, MiddleburyFlowIsCheckedAgainstItsFrames) {
  gray("frame10.png");
  gray("frame11.png");
  const auto flo = [&](const std::string& name, int width, int height, std::size_t values) {
    std::ofstream out(folder / name, std::ios::binary);
    const float tag = 202021.25f;
    const std::array<std::int32_t, 2> size{width, height};
    const std::vector<float> uv(values, 0.5f);
    out.write(reinterpret_cast<const char*>(&tag), 4);
    out.write(reinterpret_cast<const char*>(size.data()), 8);
    out.write(reinterpret_cast<const char*>(uv.data()), static_cast<std::streamsize>(4 * values));
  };
  flo("flow10.flo", 32, 24, 2 * 32 * 24);
  EXPECT_EQ(Recording::open(folder).layout(), "middlebury");
  EXPECT_EQ(Recording::open(folder).true_flows().size(), 1u);
  flo("flow10.flo", 32, 24, 100);
  EXPECT_EQ(Recording::open(folder).problem_counts().count(ProblemKind::kDamaged), 1u);
  flo("flow10.flo", 16, 24, 2 * 16 * 24);
  EXPECT_EQ(Recording::open(folder).problem_counts().count(ProblemKind::kOtherSize), 1u);
  fs::remove(folder / "flow10.flo");
  flo("flow11.flo", 32, 24, 2 * 32 * 24);
  EXPECT_EQ(Recording::open(folder).problem_counts().count(ProblemKind::kAlone), 1u);
}

}  // namespace
}  // namespace wasp::drivers
