// V4L2 end to end without hardware: the real wasp-camera on a scripted device (v4l2_standin.cpp).
#include "tests/cameras/camera_program.h"

namespace wasp {
namespace {

using test::CameraProgram;

constexpr const char* kStandin = "libwasp_v4l2_standin.so";
const std::string kSmall = "format GREY 160 120 100\n";
const std::vector<std::string> kOptions{"--driver", "v4l2", "--width", "160", "--height", "120", "--rate", "100"};

std::vector<std::string> with(std::vector<std::string> more) {
  more.insert(more.begin(), kOptions.begin(), kOptions.end());
  return more;
}

/// Runs to its own end, which must be a refusal; what it said.
std::string refusal(const std::string& script, const std::vector<std::string>& options = kOptions) {
  CameraProgram camera(kStandin, script, options);
  EXPECT_EQ(camera.wait(), 1);
  return camera.log();
}

TEST(V4l2Program, GreyFramesArriveBitExactAndEveryLossIsCountedOnce) {
  CameraProgram camera(kStandin, kSmall + "frames 30\ndrop 3\nframes 10\ncorrupt 3\nframes 20\n", kOptions);
  camera.follow(80);
  const auto figures = camera.finish();
  EXPECT_EQ(camera.width_px, 160);
  EXPECT_EQ(figures.at("dropped"), 3) << camera.log();
  EXPECT_EQ(figures.at("corrupt"), 3);
  EXPECT_EQ(figures.at("reopened"), 0);
  EXPECT_EQ(figures.at("estimated"), 0);
  for (const std::uint32_t lost : {30u, 31u, 32u, 43u, 44u, 45u}) EXPECT_FALSE(camera.seen.contains(lost)) << lost;
  EXPECT_TRUE(camera.seen.contains(33) && camera.seen.contains(46));
  EXPECT_EQ(camera.headers.at(33).sequence - camera.headers.at(29).sequence, 4u) << "the gap is told on";
}

TEST(V4l2Program, YuyvAndPaddedRowsAreConvertedIntoTheSlot) {
  CameraProgram yuyv(kStandin, "format YUYV 160 120 100\n", kOptions);
  yuyv.follow(10);
  yuyv.finish();
  CameraProgram padded(kStandin, kSmall + "stride 192\n", kOptions);
  padded.follow(10);
  padded.finish();
  CameraProgram planar(kStandin, "format NV12 160 120 100\n", kOptions);
  planar.follow(10);
  planar.finish();
}

TEST(V4l2Program, SurvivesUnplugAndFindsTheSameCameraAtAnotherNode) {
  CameraProgram camera(kStandin, kSmall + "frames 20\nunplug 700 /dev/video7\nframes 20\n", kOptions);
  camera.follow(60);
  const auto figures = camera.finish();
  EXPECT_EQ(figures.at("reopened"), 1) << camera.log();
  EXPECT_EQ(figures.at("dropped"), 0) << "its count began anew, which is no loss";
  const std::string log = camera.log();
  EXPECT_NE(log.find("gone, looking for it"), std::string::npos) << log;
  EXPECT_NE(log.find("/dev/video7"), std::string::npos) << log;
  EXPECT_EQ(log.find("gone, looking for it"), log.rfind("gone, looking for it")) << "said once: " << log;
  const auto back = camera.headers.lower_bound(20), before = std::prev(back);
  EXPECT_GT(back->second.sequence, before->second.sequence) << "sequence goes on over the gap";
}

TEST(V4l2Program, ASilentCameraIsCountedAndOpenedAnew) {
  CameraProgram camera(kStandin, kSmall + "frames 10\nsilence 400\nframes 10\nsilence 4000\nframes 10\n", kOptions);
  camera.follow(25);
  const auto figures = camera.finish();
  EXPECT_GE(figures.at("timeouts").get<int>(), 4) << camera.log();
  EXPECT_GE(figures.at("reopened").get<int>(), 1);
  EXPECT_NE(camera.log().find("silent"), std::string::npos) << camera.log();
}

TEST(V4l2Program, OfABacklogTheNewestIsTaken) {
  CameraProgram camera(kStandin, kSmall + "frames 10\nburst 4\nframes 10\n", kOptions);
  camera.follow(20);
  const auto figures = camera.finish();
  EXPECT_TRUE(camera.seen.contains(13));
  EXPECT_EQ(figures.at("dropped"), 3) << camera.log();
}

TEST(V4l2Program, TheMiddleOfTheExposureIsTold) {
  // 20 ms of exposure: the stamp of its end is 10 ms after its middle, that of its start 10 ms before.
  CameraProgram end(kStandin, kSmall + "exposure 200\n", with({"--exposure-us", "20000"}));
  end.follow(10);
  EXPECT_GE(end.finish().at("latency_p50_ns").get<std::int64_t>(), 10 * kMillisecond);
  CameraProgram start(kStandin, kSmall + "exposure 200\nstamp soe\n", with({"--exposure-us", "20000"}));
  start.follow(10);
  const auto figures = start.finish();
  EXPECT_EQ(figures.at("estimated"), 0);
  CameraProgram wild(kStandin, kSmall + "stamp wild\n", kOptions);
  wild.follow(10);
  const auto wild_figures = wild.finish();
  EXPECT_EQ(wild_figures.at("estimated"), wild_figures.at("frames")) << "an hour ahead is not believed";
  CameraProgram wall(kStandin, kSmall + "stamp wall\n", kOptions);
  wall.follow(10);
  const auto wall_figures = wall.finish();
  EXPECT_EQ(wall_figures.at("estimated"), wall_figures.at("frames"));
}

TEST(V4l2Program, RefusesWhatCannotBeUsedWithTheRemedy) {
  EXPECT_NE(refusal(kSmall + "open EACCES\n").find("usermod -aG video"), std::string::npos);
  EXPECT_NE(refusal(kSmall + "busy 1\n").find("another program uses it"), std::string::npos);
  const std::string size = refusal("format GREY 640 480 30\nformat YUYV 320 240 60\n");
  EXPECT_NE(size.find("offers no pictures of 160x120"), std::string::npos) << size;
  EXPECT_NE(size.find("GREY 640x480 30 Hz, YUYV 320x240 60 Hz"), std::string::npos) << size;
  const std::string wrong = refusal(kSmall + "deliver 320 240\n");
  EXPECT_NE(wrong.find("delivers 320 x 240, but [camera] says 160 x 120"), std::string::npos) << wrong;
  const std::string pixels = refusal("format RGB3 160 120 30\n");
  EXPECT_NE(pixels.find("offers no pixel format that can be used"), std::string::npos) << pixels;
  const std::string fast = refusal("format GREY 160 120 200\n");
  EXPECT_NE(fast.find("set [camera] rate_hz = 200"), std::string::npos) << fast;
  const std::string absent = refusal("node /dev/video3\n" + kSmall, with({"--device", "/dev/video5"}));
  EXPECT_NE(absent.find("/dev/video5"), std::string::npos) << absent;
  EXPECT_NE(absent.find("wasp camera --list"), std::string::npos) << absent;
}

TEST(V4l2Program, AKilledProcessGoesOnInTheSameRegion) {
  CameraProgram camera(kStandin, kSmall, kOptions);
  camera.follow(10);
  const auto frames = camera.gray->newest();
  camera.signal(SIGKILL);
  camera.wait();
  ASSERT_TRUE(std::filesystem::exists("/dev/shm/" + shm::camera_region(camera.instance)));
  const std::string again = "WASP_CAMERA_SCRIPT=" + camera.file("script") + " LD_PRELOAD=" WASP_BINARY_DIR "/lib/" +
                            kStandin + " " + test::program_path("wasp-camera") + " --instance " + camera.instance +
                            " --no-rt --driver v4l2 --width 160 --height 120 --rate 100 --seconds 1 2>&1";
  const auto [text, code] = test::run_shell(again);
  EXPECT_EQ(code, 0) << text;
  EXPECT_GT(camera.gray->newest(), frames) << "the reader's mapping is still the camera's";
}

TEST(V4l2Program, ListsAndSavesPictures) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path / "script") << kSmall << "card Bench Camera\nnode /dev/video2\n";
  const std::string with_camera = "WASP_CAMERA_SCRIPT=" + (folder.path / "script").string() +
                                  " LD_PRELOAD=" WASP_BINARY_DIR "/lib/" + kStandin + " " +
                                  test::program_path("wasp-camera") + " ";
  const auto [listed, code] = test::run_shell(with_camera + "--list --json");
  EXPECT_EQ(code, 0);
  const auto document = nlohmann::json::parse(listed);
  ASSERT_EQ(document.size(), 1u) << listed;
  EXPECT_EQ(document[0].at("device"), "/dev/video2");
  EXPECT_EQ(document[0].at("formats").at(0), "GREY 160x120 100 Hz");
  const auto [said, saved] =
      test::run_shell(with_camera + "--driver v4l2 --width 160 --height 120 --rate 100 --frames 3 --save " +
                      (folder.path / "pictures").string() + " 2>&1");
  EXPECT_EQ(saved, 0) << said;
  EXPECT_TRUE(std::filesystem::exists(folder.path / "pictures/gray_00002.png")) << said;
}

}  // namespace
}  // namespace wasp
