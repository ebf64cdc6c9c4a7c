#include "drivers/recording.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "drivers/image_file.h"

namespace wasp::drivers {
namespace {

namespace fs = std::filesystem;

class RecordingFolder : public testing::Test {
 protected:
  void SetUp() override {
    folder = fs::temp_directory_path() / ("wasp_recording_test_" + std::to_string(::getpid()));
    fs::create_directories(folder / "depth");
    fs::create_directories(folder / "rgb");
  }
  void TearDown() override { fs::remove_all(folder); }

  void depth(const std::string& name, std::uint16_t value, int width = 32, int height = 24) const {
    const std::vector<std::uint16_t> pixels(static_cast<std::size_t>(width * height), value);
    save_png(folder / name, DepthView{pixels.data(), width, height, width});
  }
  void gray(const std::string& name, std::uint8_t value) const {
    const std::vector<std::uint8_t> pixels(32 * 24, value);
    save_png(folder / name, GrayView{pixels.data(), 32, 24, 32});
  }
  void text(const std::string& name, const std::string& content) const { std::ofstream(folder / name) << content; }
  std::uint16_t first_depth(const Recording& recording, std::size_t index) const {
    std::vector<std::uint16_t> pixels(recording.depth_size().pixels());
    recording.load_depth(index, pixels);
    return pixels[0];
  }
  std::string error() const {
    try {
      Recording::open(folder);
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "nothing was thrown";
  }

  fs::path folder;
};

TEST_F(RecordingFolder, ReadsWaspsOwnLayoutWithCameraAndSequenceNumbers) {
  depth("depth/frame-7.png", 1234);
  depth("depth/frame-9.png", 65535);
  gray("rgb/frame-7.png", 42);
  text("depth.txt", "# wasp\n1700000000.000000000 depth/frame-7.png\n1700000000.033333333 depth/frame-9.png\n");
  text("rgb.txt", "1700000000.000000001 rgb/frame-7.png\n");
  text("camera.toml",
       "width_px = 32\nheight_px = 24\nfx_px = 26.0\nfy_px = 27\ncx_px = 15.5\ncy_px = 11.5\npitch_down_deg = 30.0\n"
       "depth_units_per_m = 1000\nposition_body_m = [0.1, 0.0, -0.05]\n"
       "k2 = 0.5\nlens = \"fisheye\"\nfisheye_k = [0.1, 0.2, 0, -0.4]\n");
  const Recording r = Recording::open(folder);
  EXPECT_EQ(r.layout(), "tum");
  ASSERT_EQ(r.entries().size(), 2u);
  EXPECT_EQ(r.entries()[0].sequence, 7u);
  EXPECT_EQ(r.entries()[1].sequence, 9u);
  EXPECT_EQ(r.entries()[1].offset_ns, 33333333);
  EXPECT_TRUE(r.entries()[0].has_gray());
  EXPECT_FALSE(r.entries()[1].has_gray());
  EXPECT_FLOAT_EQ(r.intrinsics().fy_px, 27.f);
  EXPECT_NEAR(r.pitch_down()->value, 0.5236, 1e-4);
  EXPECT_FLOAT_EQ(r.geometry().position_body_m.x(), 0.1f);
  EXPECT_FLOAT_EQ(r.intrinsics().k2, 0.5f);
  EXPECT_EQ(r.geometry().lens_kind, LensKind::kFisheye);
  EXPECT_FLOAT_EQ(r.geometry().fisheye_k[3], -0.4f);
  EXPECT_EQ(first_depth(r, 0), 1234);
  EXPECT_EQ(first_depth(r, 1), 0);  // 65535 means no reading
  std::vector<std::uint8_t> pixels(r.gray_size().pixels());
  r.load_gray(0, pixels);
  EXPECT_EQ(pixels[5], 42);
  EXPECT_THROW(r.load_gray(1, pixels), std::runtime_error);
  std::vector<std::uint16_t> small(3);
  EXPECT_THROW(r.load_depth(0, small), std::runtime_error);
  EXPECT_THROW(r.load_depth(99, small), std::out_of_range);
}

TEST_F(RecordingFolder, TumUnitsAreFiveThousandToTheMetre) {
  depth("depth/a.png", 5000);
  text("depth.txt", "1.5 depth/a.png\n");
  EXPECT_EQ(first_depth(Recording::open(folder), 0), 1000);
}

TEST_F(RecordingFolder, SkipsAndNamesWhatCannotBeUsed) {
  for (const char* name : {"depth/1.png", "depth/2.png", "depth/4.png", "depth/6.png"}) depth(name, 1000);
  depth("depth/5.png", 1000, 16, 16);
  fs::resize_file(folder / "depth/2.png", 40);
  text("depth.txt",
       "1.0 depth/1.png\n1.1 depth/2.png\n1.2 depth/3.png\n0.9 depth/4.png\n1.4 depth/5.png\nnonsense\n1.6 "
       "depth/6.png\n");
  const Recording r = Recording::open(folder);
  EXPECT_EQ(r.entries().size(), 2u);
  ASSERT_EQ(r.problems().size(), 5u);
  std::string all;
  for (const std::string& p : r.problems()) all += p + "\n";
  for (const char* part : {"depth.txt:6", "2.png", "3.png", "4.png", "5.png", "depth.txt:2", "not after", "16x16"})
    EXPECT_NE(all.find(part), std::string::npos) << part << " in\n" << all;
}

TEST_F(RecordingFolder, ErrorsSayWhatIsWrong) {
  EXPECT_NE(error().find("no recording"), std::string::npos);
  text("depth.txt", "1.0 depth/none.png\n");
  EXPECT_NE(error().find("no usable frame"), std::string::npos);
  depth("depth/a.png", 1);
  text("depth.txt", "1.0 depth/a.png\n");
  text("camera.toml", "fx_px = 500\nbogus = 1\n");
  EXPECT_NE(error().find("camera.toml:2: unknown key 'bogus'"), std::string::npos) << error();
  text("camera.toml", "lens = \"mirror\"\n");
  EXPECT_NE(error().find("camera.toml: lens is neither"), std::string::npos) << error();
  text("camera.toml", "fx_px = \"wide\"\n");
  EXPECT_NE(error().find("camera.toml:1"), std::string::npos) << error();
  text("camera.toml", "fx_px = = 3\n");
  EXPECT_NE(error().find("camera.toml"), std::string::npos);
  EXPECT_THROW(Recording::open(folder / "absent"), std::runtime_error);
  EXPECT_THROW(Recording::open(folder / "depth.txt"), std::runtime_error);
}

TEST_F(RecordingFolder, TimesThatDoNotFitAreProblemsNotOverflows) {
  depth("depth/a.png", 1);
  depth("depth/b.png", 2);
  text("depth.txt",
       "-1.0 depth/a.png\n-9223372036.854775807 depth/a.png\n9223372036.854775807 depth/a.png\n7.0 depth/b.png\n");
  const Recording recording = Recording::open(folder);
  EXPECT_EQ(recording.entries().size(), 1u);
  EXPECT_EQ(recording.problems().size(), 4u) << "three times, and an image that no readable line names";
  fs::remove(folder / "depth.txt");
  gray("9999999999999999999.png", 1);
  gray("1403636579763555584.png", 1);
  const Recording named = Recording::open(folder);
  EXPECT_EQ(named.layout(), "asl");
  EXPECT_EQ(named.entries().size(), 1u);
  EXPECT_EQ(named.problems().size(), 1u);
  gray("test1.png", 1);
  text("gt_per_frame.csv", "frame,t_s\n1,1e300\n");
  EXPECT_NE(Recording::open(folder).problems().at(0).find("gt_per_frame.csv:2"), std::string::npos);
}

TEST_F(RecordingFolder, KnowsLayoutsByTheirContents) {
  depth("frame-000010.depth.png", 1000);
  depth("frame-000012.depth.png", 1000);
  const Recording scenes = Recording::open(folder);
  EXPECT_EQ(scenes.layout(), "7scenes");
  EXPECT_EQ(scenes.entries()[1].sequence, 12u);
  EXPECT_NEAR(to_seconds(scenes.entries()[1].offset_ns), 2.0 / 30.0, 1e-6);
  EXPECT_NEAR(scenes.intrinsics().fx_px, 585.f / 20.f, 1e-3f);  // scaled to the 32 px wide test image
  fs::remove(folder / "frame-000010.depth.png");
  fs::remove(folder / "frame-000012.depth.png");
  gray("test0001.png", 1);
  gray("test0002.png", 2);
  EXPECT_EQ(Recording::open(folder).layout(), "numbered_png");
  text("gt_per_frame.csv", "frame,t_s,height\n1,2.000,1\n2,2.020,1\n");
  const Recording hover = Recording::open(folder);
  EXPECT_EQ(hover.layout(), "hover_mocap");
  EXPECT_EQ(hover.entries()[1].offset_ns, 20 * kMillisecond);
  EXPECT_NEAR(hover.pitch_down()->value, 1.5708, 1e-4);
}

struct Expected {
  const char* folder;
  const char* layout;
  std::size_t entries;
  friend void PrintTo(const Expected& e, std::ostream* out) { *out << e.folder; }
};
class RealRecording : public testing::TestWithParam<Expected> {};

TEST_P(RealRecording, OpensAndLoadsEveryEntry) {
  const fs::path folder = fs::path(WASP_SOURCE_DIR "/../shared/data") / GetParam().folder;
  if (!fs::exists(folder)) GTEST_SKIP() << "no recording at " << folder;
  const Recording r = Recording::open(folder);
  EXPECT_EQ(r.layout(), GetParam().layout);
  EXPECT_EQ(r.entries().size(), GetParam().entries);
  EXPECT_TRUE(r.problems().empty());
  std::vector<std::uint16_t> depth(r.depth_size().pixels());
  std::vector<std::uint8_t> gray(r.gray_size().pixels());
  for (std::size_t i = 0; i < r.entries().size(); ++i) {
    if (r.entries()[i].has_depth()) {
      EXPECT_NO_THROW(r.load_depth(i, depth));
    }
    if (r.entries()[i].has_gray()) {
      EXPECT_NO_THROW(r.load_gray(i, gray));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Layouts, RealRecording,
    testing::Values(Expected{"kinect_7scenes_redkitchen", "7scenes", 40},
                    Expected{"kinect_floor_pcl", "named_depth", 4}, Expected{"kinect_livingroom_pgm", "depth_pgm", 2},
                    Expected{"kinect_table_osd", "named_depth", 2}, Expected{"rgbd_tum_pair", "tum_pair", 2},
                    Expected{"hover_mocap/climb", "hover_mocap", 40},
                    Expected{"hover_mocap/lateral_yaw", "hover_mocap", 40},
                    Expected{"euroc_v101/cam0_static", "asl", 12}, Expected{"flow_yosemite", "numbered_png", 15}));

TEST(RealRecordings, AFolderOfClipsPlaysOneAfterTheOther) {
  const fs::path folder = WASP_SOURCE_DIR "/../shared/data/hover_mocap";
  if (!fs::exists(folder)) GTEST_SKIP() << "no recording at " << folder;
  const Recording r = Recording::open(folder);
  EXPECT_EQ(r.layout(), "hover_mocap_clips");
  ASSERT_EQ(r.entries().size(), 160u);
  EXPECT_TRUE(r.problems().empty());
  for (std::size_t i = 1; i < r.entries().size(); ++i) {
    EXPECT_GT(r.entries()[i].offset_ns, r.entries()[i - 1].offset_ns);
    EXPECT_GT(r.entries()[i].sequence, r.entries()[i - 1].sequence);
  }
}

TEST(Recordings, AFolderOfRecordingsAsksForOne) {
  const fs::path folder = fs::temp_directory_path() / ("wasp_clips_" + std::to_string(getpid()));
  for (const char* name : {"a", "b"}) {
    fs::create_directories(folder / name);
    std::ofstream(folder / name / "depth.txt") << "0.0 x.png\n";
  }
  try {
    Recording::open(folder);
    ADD_FAILURE() << "opened";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("name one of them: a, b"), std::string::npos) << error.what();
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace wasp::drivers
