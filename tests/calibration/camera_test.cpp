// Chessboards rendered through lenses that are known: found within three standard deviations as the calibration states
// them and within an absolute tolerance; and views that do not determine the lens are refused.
#include "calibration/calibrate_camera.h"

#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "calibration/solution_file.h"
#include "scheduling/config.h"
#include "tests/calibration/board_renderer.h"
#include "tests/tools/program.h"

namespace wasp::calibration {
namespace {

namespace fs = std::filesystem;
constexpr double kSquare = 30;
const cv::Size kBoard(9, 6);

Lens pinhole_lens() {
  Lens lens;
  lens.intrinsics = {640, 480, 420.f, 424.f, 331.f, 236.f, -0.28f, 0.09f, 0.0015f, -0.001f, 0.f};
  return lens;
}

Lens fisheye_lens() {
  Lens lens;
  lens.kind = LensKind::kFisheye;
  lens.intrinsics = {640, 480, 265.f, 263.f, 316.f, 247.f};
  lens.fisheye_k = {-0.02f, 0.006f, -0.003f, 0.0004f};
  return lens;
}

/// Boards all over the image, tilted every way by up to `tilt` rad; at `reach` 1 a level board just touches the border.
void render_views(const fs::path& folder, const Lens& lens, int count, double tilt, double reach, std::uint32_t seed) {
  const test::BoardRenderer renderer(lens, kBoard, kSquare);
  sim::Random random(seed);
  for (int i = 0; i < count; ++i) {
    const double z = random.uniform(0.65, 1.0) * static_cast<double>(lens.intrinsics.fx_px);
    const double half_w = reach * (z * 320 / static_cast<double>(lens.intrinsics.fx_px) - 4 * kSquare);
    const double half_h = reach * (z * 240 / static_cast<double>(lens.intrinsics.fy_px) - 2.5 * kSquare);
    const Eigen::Vector3d centre(random.uniform(-half_w, half_w), random.uniform(-half_h, half_h), z);
    const auto pose = test::board_pose(kBoard, kSquare, centre, random.uniform(-tilt, tilt),
                                       random.uniform(-tilt, tilt), random.uniform(-0.3, 0.3));
    std::ostringstream name;
    name << "view" << 100 + i << (i % 3 == 0 ? ".png" : i % 3 == 1 ? ".pgm" : ".jpg");
    cv::imwrite((folder / name.str()).string(),
                renderer.render(pose.R, pose.t, 2.0, seed + static_cast<std::uint32_t>(i)),
                {cv::IMWRITE_JPEG_QUALITY, 97});
  }
}

CameraOptions options(const fs::path& folder, const std::string& lens = "pinhole") {
  CameraOptions o;
  o.folder = folder.string();
  o.lens = lens;
  o.square_mm = kSquare;
  return o;
}

double number(const TomlSection& section, const std::string& key) {
  for (const auto& line : section.lines())
    if (line.starts_with(key + " = ")) return std::stod(line.substr(key.size() + 3));
  ADD_FAILURE() << "no " << key;
  return 0;
}

void expect_found(const Solution& s, const std::string& key, double truth, double absolute) {
  const double value = number(s.flight.at(0), key), sigma = number(s.evidence, key + "_sigma");
  EXPECT_NEAR(value, truth, absolute) << key;
  EXPECT_LT(std::fabs(value - truth), 3.5 * sigma + 0.02)
      << key << " sigma " << sigma;  // the detector's own bias: 0.02
}

std::string refusal_of(const CameraOptions& o) {
  ProgressBar bar("test");
  try {
    solve_camera(o, bar);
  } catch (const Refusal& refusal) {
    return refusal.what();
  }
  return "";
}

TEST(CalibrateCamera, PinholeThroughOurOwnLensModelAndIntoTheFlight) {
  const test::TemporaryFolder folder;
  fs::create_directories(folder.path / "views");
  render_views(folder.path / "views", pinhole_lens(), 24, 0.5, 1.0, 7);
  ProgressBar bar("test");
  const Solution s = solve_camera(options(folder.path / "views"), bar);  // board and its size unknown
  const Intrinsics k = pinhole_lens().intrinsics;
  expect_found(s, "fx_px", static_cast<double>(k.fx_px), 1.0);
  expect_found(s, "fy_px", static_cast<double>(k.fy_px), 1.0);
  expect_found(s, "cx_px", static_cast<double>(k.cx_px), 1.0);
  expect_found(s, "cy_px", static_cast<double>(k.cy_px), 1.0);
  EXPECT_NEAR(number(s.flight[0], "k1"), static_cast<double>(k.k1), 0.01);
  EXPECT_NEAR(number(s.flight[0], "p1"), static_cast<double>(k.p1), 0.0007);
  EXPECT_LT(s.residual_rms, 0.15);
  EXPECT_LT(number(s.evidence, "held_out_rms_px"), 0.2);

  const auto files = write_solution(s, "camera", folder.path / "camera.toml");
  ASSERT_EQ(files.size(), 3u);
  const scheduling::Config config = scheduling::load_config({files[0].string()}, {"ground_altitude"});
  EXPECT_NEAR(config.camera.intrinsics.fx_px, k.fx_px, 1.f);
  EXPECT_NEAR(config.camera.intrinsics.k1, k.k1, 0.01f);
}

TEST(CalibrateCamera, FisheyeThroughOurOwnLensModel) {
  const test::TemporaryFolder folder;
  render_views(folder.path, fisheye_lens(), 24, 0.5, 1.0, 11);
  ProgressBar bar("test");
  auto o = options(folder.path, "fisheye");
  o.board = "9x6";
  const Solution s = solve_camera(o, bar);
  const Lens lens = fisheye_lens();
  expect_found(s, "fx_px", static_cast<double>(lens.intrinsics.fx_px), 1.0);
  expect_found(s, "fy_px", static_cast<double>(lens.intrinsics.fy_px), 1.0);
  expect_found(s, "cx_px", static_cast<double>(lens.intrinsics.cx_px), 1.0);
  expect_found(s, "cy_px", static_cast<double>(lens.intrinsics.cy_px), 1.0);
  EXPECT_LT(s.residual_rms, 0.2);
  const auto file = folder.path / "fisheye.toml";
  write_solution(s, "camera", file);
  EXPECT_EQ(scheduling::load_config({file.string()}, {}).camera.lens_kind, LensKind::kFisheye);
}

TEST(CalibrateCamera, RefusesParallelViewsAndViewsThatLeaveTheImageEmpty) {
  const test::TemporaryFolder folder;
  for (const char* name : {"parallel", "middle", "few"}) fs::create_directories(folder.path / name);
  render_views(folder.path / "parallel", pinhole_lens(), 10, 0.0, 0.7, 3);
  EXPECT_NE(refusal_of(options(folder.path / "parallel")).find("parallel"), std::string::npos);
  {
    const test::BoardRenderer renderer(pinhole_lens(), kBoard, kSquare);
    sim::Random random(5);
    for (int i = 0; i < 10; ++i) {
      const auto pose =
          test::board_pose(kBoard, kSquare, {0, 0, 900}, random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), 0);
      cv::imwrite((folder.path / "middle" / ("m" + std::to_string(i) + ".png")).string(),
                  renderer.render(pose.R, pose.t, 2, 9));
    }
  }
  EXPECT_NE(refusal_of(options(folder.path / "middle")).find("parts of the image"), std::string::npos);
  render_views(folder.path / "few", pinhole_lens(), 4, 0.5, 0.7, 3);
  EXPECT_NE(refusal_of(options(folder.path / "few")).find("4 of 4 images"), std::string::npos);
}

TEST(CalibrateCamera, AViewOfAnotherCameraIsLeftOutAndSaid) {
  const test::TemporaryFolder folder;
  render_views(folder.path, pinhole_lens(), 18, 0.5, 1.0, 21);
  Lens other = pinhole_lens();
  other.intrinsics.fx_px = 520.f, other.intrinsics.k1 = 0.2f;
  const test::BoardRenderer renderer(other, kBoard, kSquare);
  const auto pose = test::board_pose(kBoard, kSquare, {40, -20, 380}, 0.4, -0.3, 0.1);
  cv::imwrite((folder.path / "zz_other.png").string(), renderer.render(pose.R, pose.t, 2, 1));
  std::ofstream(folder.path / "broken.png") << "not an image";
  ProgressBar bar("test");
  const Solution s = solve_camera(options(folder.path), bar);
  expect_found(s, "fx_px", static_cast<double>(pinhole_lens().intrinsics.fx_px), 1.5);
  std::string notes;
  for (const auto& note : s.notes) notes += note + "\n";
  EXPECT_NE(notes.find("zz_other.png"), std::string::npos) << notes;
  EXPECT_NE(notes.find("broken.png"), std::string::npos) << notes;
}

/// A camera of others, hand-held over a board for 0.8 s, beside the intrinsics they give: all views look alike (11
/// degrees of tilt), so that the bound of bias is wide.
TEST(CalibrateCamera, RealBoardAgreesWithWhatItsOwnersFound) {
  const fs::path folder = fs::path(WASP_SOURCE_DIR) / "../shared/data/plane_checkerboard";
  if (!fs::exists(folder / "img_0181.png")) GTEST_SKIP() << "no ../shared/data/plane_checkerboard";
  ProgressBar bar("test");
  const Solution s = solve_camera(options(folder), bar);
  for (const auto& [key, truth] :
       {std::pair{"fx_px", 420.507}, {"fy_px", 420.611}, {"cx_px", 355.208}, {"cy_px", 250.337}}) {
    const std::string name = key;
    EXPECT_NEAR(number(s.flight.at(0), name), truth,
                3 * number(s.evidence, name + "_sigma") + number(s.evidence, name + "_bias"))
        << key;
    EXPECT_NEAR(number(s.flight.at(0), name), truth, 9) << key;  // two per cent
  }
  EXPECT_LT(number(s.evidence, "held_out_rms_px"), 0.25);
}

}  // namespace
}  // namespace wasp::calibration
