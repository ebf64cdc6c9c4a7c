// The camera's delay: on simulated recordings whose delay is drawn at random, on the real clips with a known lag, and
// refused where the motion says nothing.
#include <gtest/gtest.h>

#include <cstdio>

#include "calibration/calibrate_delay.h"
#include "tests/calibration/hover_run.h"
#include "tests/calibration/simulated_run.h"

namespace wasp::calibration {
namespace {

DelayFit delay_of(const std::filesystem::path& folder, const ChannelChoice& choice = kAllChannels) {
  const auto recording = drivers::Recording::open(folder);
  return fit_delay(image_turns(recording), turn_source_of(recording, "best"), {}, choice);
}

TEST(Delay, FoundOnSimulatedRecordings) {
  std::mt19937 random(20261127);
  for (unsigned seed = 1; seed <= 6; ++seed) {
    test::RunOptions options{.seed = seed};
    options.delay_s = std::uniform_real_distribution<double>(-0.02, 0.12)(random);
    options.rate_hz = seed % 2 == 0 ? 30 : 20;
    test::SimulatedRun run("delay");
    run.write_euroc(test::by_hand(seed, 1), options);
    const DelayFit fit = delay_of(run.folder());
    std::printf("[ measured ] delay %.2f ms: found %.2f, sigma %.2f\n", 1e3 * options.delay_s, 1e3 * fit.delay_s,
                1e3 * fit.sigma_s);
    EXPECT_TRUE(fit.ok()) << fit.refusal;
    EXPECT_NEAR(fit.delay_s, options.delay_s, 0.003);
    EXPECT_LT(std::abs(fit.delay_s - options.delay_s), std::max(4 * fit.sigma_s, 0.0005));
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(fit.axes[static_cast<std::size_t>(a)].scale, 1, 0.15);
  }
}

/// A logger that is faster than the motion capture repeats its poses; the delay is that behind the poses themselves.
TEST(Delay, IsNotShortenedByPosesThatALoggerRepeats) {
  double error_s = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const test::HoverOptions options{.delay_s = 0.01 * seed, .seed = seed};
    const test::HoverRun run(options);
    const DelayFit fit = delay_of(run.folder());
    std::printf("[ measured ] delay %.1f ms: found %.2f, sigma %.2f\n", 1e3 * options.delay_s, 1e3 * fit.delay_s,
                1e3 * fit.sigma_s);
    EXPECT_TRUE(fit.ok()) << fit.refusal;
    EXPECT_NEAR(fit.delay_s, options.delay_s, 0.002);
    error_s += (fit.delay_s - options.delay_s) / 4;
  }
  EXPECT_NEAR(error_s, 0, 0.001);
}

TEST(Delay, RefusedWithoutRotation) {
  test::RunOptions options;
  test::SimulatedRun run("still");
  run.write_euroc(test::by_hand(3, 0), options);  // it moves about and does not turn
  const DelayFit fit = delay_of(run.folder());
  EXPECT_FALSE(fit.ok());
  EXPECT_NE(fit.refusal.find("do not follow"), std::string::npos) << fit.refusal;
}

TEST(Delay, RefusedWhereTheMotionRepeatsItself) {
  test::RunOptions options{.seconds = 8, .rate_hz = 30};
  test::SimulatedRun run("sine");
  run.write_euroc(
      [](double t) {
        sim::BodyPose pose;
        pose.at_ns = from_seconds(t);
        pose.position_ned_m = Vec3(0, 0, -1.2f);
        pose.q_ned_body = quat_from_euler({0, 0, 0.05f * std::sin(2 * 3.14159265f * 5 * static_cast<float>(t))});
        return pose;
      },
      options);  // 5 Hz: every 200 ms fits
  const DelayFit fit = delay_of(run.folder());
  EXPECT_FALSE(fit.ok());
}

TEST(Delay, RefusedWithAnotherRecordingsGyro) {
  test::SimulatedRun run("mixed"), other("other");
  run.write_euroc(test::by_hand(1, 1), {.seed = 1});
  other.write_euroc(test::by_hand(2, 1), {.seed = 2});
  const auto images = drivers::Recording::open(run.folder()), gyro = drivers::Recording::open(other.folder());
  EXPECT_FALSE(fit_delay(image_turns(images), turn_source_of(gyro, "gyro")).ok());
}

/// The lag was found by the data's maker over 1593 frames of which these clips are excerpts of 40.
class HoverDelay : public testing::TestWithParam<const char*> {};
TEST_P(HoverDelay, FortyMillisecondsOrARefusal) {
  const std::filesystem::path folder =
      std::filesystem::path(WASP_SOURCE_DIR "/../shared/data/hover_mocap") / GetParam();
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no recording at " << folder;
  const DelayFit fit = delay_of(folder);
  std::printf("[ measured ] %s: %.1f ms, sigma %.1f, likelihood %.0f %s\n", GetParam(), 1e3 * fit.delay_s,
              1e3 * fit.sigma_s, fit.likelihood, fit.refusal.c_str());
  if (fit.ok()) {
    EXPECT_NEAR(fit.delay_s, 0.040, 0.005);
  }
  EXPECT_NEAR(fit.delay_s, 0.040, 3 * fit.sigma_s + 0.005);  // and what is refused is not wrong by more than it says
}
INSTANTIATE_TEST_SUITE_P(Clips, HoverDelay, testing::Values("climb", "climb_yaw", "lateral_yaw", "descend"));

TEST(Delay, RefusedOnTheStand) {
  const std::filesystem::path folder = WASP_SOURCE_DIR "/../shared/data/euroc_v101/cam0_static";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no recording at " << folder;
  EXPECT_FALSE(delay_of(folder).ok());
}

}  // namespace
}  // namespace wasp::calibration
