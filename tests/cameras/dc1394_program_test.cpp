// IIDC end to end without hardware: the real wasp-camera on a scripted libdc1394 (dc1394_standin.cpp).
#include "tests/cameras/camera_program.h"

namespace wasp {
namespace {

using test::CameraProgram;

constexpr const char* kStandin = "libwasp_dc1394_standin.so";
const std::string kRegion = "format F7 640 480\n";  // a sensor, of which a part is taken: any rate
const std::vector<std::string> kOptions{"--driver", "dc1394", "--width", "160", "--height", "120", "--rate", "100"};

std::vector<std::string> with(std::vector<std::string> more) {
  more.insert(more.begin(), kOptions.begin(), kOptions.end());
  return more;
}

std::string refusal(const std::string& script, const std::vector<std::string>& options = kOptions) {
  CameraProgram camera(kStandin, script, options);
  EXPECT_EQ(camera.wait(), 1);
  return camera.log();
}

TEST(Dc1394Program, FramesArriveBitExactAndEveryLossIsCountedOnce) {
  CameraProgram camera(kStandin, kRegion + "frames 30\ndrop 3\nframes 10\ncorrupt 2\nframes 20\n", kOptions);
  camera.follow(80);
  const auto figures = camera.finish();
  EXPECT_EQ(figures.at("dropped"), 3) << camera.log();
  EXPECT_EQ(figures.at("corrupt"), 2) << camera.log();
  EXPECT_EQ(figures.at("reopened"), 0);
  EXPECT_EQ(figures.at("estimated"), 0);
  for (const std::uint32_t lost : {30u, 31u, 32u, 43u, 44u}) EXPECT_FALSE(camera.seen.contains(lost)) << lost;
  EXPECT_EQ(camera.headers.at(33).sequence - camera.headers.at(29).sequence, 4u);
}

TEST(Dc1394Program, OfABacklogTheNewestIsTakenAndTheRestCounted) {
  CameraProgram camera(kStandin, kRegion + "frames 10\nburst 3\nframes 10\n", kOptions);
  camera.follow(20);
  EXPECT_EQ(camera.finish().at("dropped"), 2) << camera.log();
  EXPECT_TRUE(camera.seen.contains(12));
  EXPECT_FALSE(camera.seen.contains(11));
}

TEST(Dc1394Program, ABusResetIsRecoveredFrom) {
  CameraProgram camera(kStandin, kRegion + "frames 20\nreset\nframes 20\nunplug 700\nframes 20\n", kOptions);
  camera.follow(70);
  const auto figures = camera.finish();
  EXPECT_EQ(figures.at("reopened"), 2) << camera.log();
  EXPECT_EQ(figures.at("dropped"), 0) << camera.log();
}

TEST(Dc1394Program, SilenceIsCountedAndTheDeadlineKept) {
  CameraProgram camera(kStandin, kRegion + "frames 10\nsilence 600\nframes 10\n", kOptions);
  camera.follow(15);
  const auto figures = camera.finish();
  EXPECT_GE(figures.at("timeouts").get<int>(), 5) << "waits of 50 ms each: " << camera.log();
  EXPECT_EQ(figures.at("reopened"), 0);
}

TEST(Dc1394Program, TimesSurviveASteppingWallClock) {
  CameraProgram camera(kStandin,
                       kRegion +
                           "shutter_us 4000\npackets 40\nframes 20\nclock_step 3600\nframes 20\nclock_step "
                           "-90000\nframes 20\n",
                       kOptions);
  camera.follow(60);
  const auto figures = camera.finish();
  EXPECT_EQ(figures.at("estimated"), 2) << "one frame after each step: " << camera.log();
  EXPECT_EQ(figures.at("dropped"), 0);
  TimeNs last_ns = 0;
  for (const auto& [n, header] : camera.headers) {
    EXPECT_GT(header.exposed_at_ns, last_ns) << n;
    last_ns = header.exposed_at_ns;
  }
  // 40 packets of 125 us on the bus and half the shutter: 7 ms before the stamp.
  EXPECT_GE(figures.at("latency_p50_ns").get<std::int64_t>(), 7 * kMillisecond);
}

TEST(Dc1394Program, WithoutStampsTheArrivalCounts) {
  CameraProgram camera(kStandin, kRegion + "stamp none\n", kOptions);
  camera.follow(10);
  const auto figures = camera.finish();
  EXPECT_EQ(figures.at("estimated"), figures.at("frames"));
}

TEST(Dc1394Program, FixedModeShutterGainAndTriggerAreSetAndReadBack) {
  CameraProgram camera(kStandin, "rate 30\nformat MONO8 640 480 30 15\n",
                       {"--driver", "dc1394", "--rate", "30", "--exposure-us", "5000", "--gain", "6"});
  camera.follow(5);
  camera.finish();
  EXPECT_EQ(camera.width_px, 640);
  EXPECT_NE(camera.log().find("MONO8, shutter 5000 us, gain 6.00 dB, 30"), std::string::npos) << camera.log();
  const test::TemporaryFolder folder;
  std::ofstream(folder.path / "trigger.toml") << "[camera]\ntrigger = \"external\"\n";
  CameraProgram triggered(kStandin, kRegion + "frames 5\nsilence 3000\nframes 5\n",
                          with({"--config", (folder.path / "trigger.toml").string()}));
  triggered.follow(8);
  EXPECT_EQ(triggered.finish().at("reopened"), 0) << "silence is the trigger's: " << triggered.log();
  EXPECT_NE(triggered.log().find("trigger external"), std::string::npos) << triggered.log();
}

TEST(Dc1394Program, RefusesWhatCannotBeUsedWithTheRemedy) {
  EXPECT_NE(refusal("").find("wasp camera --list"), std::string::npos);
  EXPECT_NE(refusal(kRegion + "bandwidth none\n").find("a lower rate_hz, or a bus of its own"), std::string::npos);
  const std::string size = refusal("format MONO8 640 480 30 15\n");
  EXPECT_NE(size.find("offers no mono8 pictures of 160x120"), std::string::npos) << size;
  EXPECT_NE(size.find("MONO8 640x480 30 15 Hz"), std::string::npos) << size;
  const std::string raw = refusal(kRegion + "absolute 0\n", with({"--exposure-us", "5000"}));
  EXPECT_NE(raw.find("knows no shutter in seconds"), std::string::npos) << raw;
  const std::string other = refusal(kRegion, with({"--device", "0011223344556677"}));
  EXPECT_NE(other.find("0011223344556677: not there"), std::string::npos) << other;
}

}  // namespace
}  // namespace wasp
