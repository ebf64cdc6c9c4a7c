// The heading rate's scale on simulated turntable runs with a known truth, and its refusals.
#include <gtest/gtest.h>

#include <cstdio>

#include "calibration/calibrate_delay.h"
#include "calibration/calibrate_heading_rate.h"
#include "calibration/image_turns.h"
#include "tests/calibration/simulated_run.h"

namespace wasp::calibration {
namespace {

HeadingScale scale_of(const std::filesystem::path& folder, double delay_s, const HeadingScaleParams& params = {}) {
  const auto recording = drivers::Recording::open(folder);
  return fit_heading_scale(seen_yaw(recording, frame_stamps(recording)), turn_source_of(recording, "best"), delay_s,
                           params);
}

test::RunOptions options(double scale) {
  return {
      .seconds = 16, .rate_hz = 15, .delay_s = 0.02, .gyro_scale = scale, .pitch_down = Radians{std::numbers::pi / 2}};
}

sim::StandParams stand() { return {.turntable = true, .profile = sim::StandProfile::kSteps, .start_s = 1}; }

TEST(HeadingScale, IsFoundOnTheTurntable) {
  for (const double truth : {1.0, 1.07, 0.93}) {
    test::SimulatedRun run("turntable");
    run.write_wasp(test::on_turntable(stand()), options(truth));
    const HeadingScale h = scale_of(run.folder(), 0.02);
    std::printf("[ measured ] scale %.3f: found %.4f, sigma %.4f, correlation %.5f, bias %.4f\n", truth, h.scale,
                h.sigma, h.correlation, h.bias_radps);
    EXPECT_TRUE(h.ok()) << h.refusal;
    EXPECT_NEAR(h.scale, truth, 0.015);
    EXPECT_NEAR(h.bias_radps, -0.05, 0.01);
  }
}

TEST(HeadingScale, TheDelayIsFoundOnTheWay) {
  test::SimulatedRun run("delay_and_scale");
  test::RunOptions o = options(1.05);
  o.delay_s = 0.06;
  run.write_wasp(test::on_turntable(stand()), o);
  ProgressBar bar("test");
  const Solution solution = solve_heading_rate({.folder = run.folder().string()}, bar);
  ASSERT_EQ(solution.flight.size(), 1u);
  EXPECT_EQ(solution.flight[0].name(), "behaviour.heading_rate");
  EXPECT_NE(solution.flight[0].toml().find("scale = 1.0"), std::string::npos) << solution.flight[0].toml();
  EXPECT_EQ(solution.pictures.size(), 2u);
}

TEST(HeadingScale, RefusedWhenStillOrOneWayOrLookingAhead) {
  test::SimulatedRun still("still");
  sim::StandParams slow = stand();
  slow.amplitude_radps = 0.01;
  still.write_wasp(test::on_turntable(slow), options(1));
  EXPECT_NE(scale_of(still.folder(), 0.02).refusal.find("varies"), std::string::npos);
  test::SimulatedRun one_way("one_way");
  one_way.write_wasp(
      [](double t) {
        sim::BodyPose pose;
        pose.position_ned_m = Vec3(0, 0, -1);
        const auto yaw = static_cast<float>(0.5 * t + 0.3 * std::sin(t));
        pose.q_ned_body = quat_from_euler({0, 0, yaw});
        return pose;
      },
      options(1));
  EXPECT_NE(scale_of(one_way.folder(), 0.02).refusal.find("one way"), std::string::npos);
  test::SimulatedRun ahead("ahead");
  test::RunOptions o = options(1);
  o.pitch_down = Radians{0.3};
  o.seconds = 3;
  ahead.write_wasp(test::on_turntable(stand()), o);
  ProgressBar bar("test");
  EXPECT_THROW(solve_heading_rate({.folder = ahead.folder().string()}, bar), Refusal);
}

/// 0.65 s of motion capture at a tenth of the turntable's turn: the clips say what they can, and no more.
TEST(HeadingScale, HoverClipsAreTooShortAndSaySo) {
  const std::filesystem::path folder = WASP_SOURCE_DIR "/../shared/data/hover_mocap/climb_yaw";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no recording at " << folder;
  HeadingScaleParams bare{
      .least_pairs = 20, .least_rms_radps = 0, .least_each_way = 0, .least_correlation = 0, .most_sigma = 1};
  const HeadingScale h = scale_of(folder, 0.04, bare);
  std::printf("[ measured ] climb_yaw: scale %.3f, sigma %.3f, correlation %.3f\n", h.scale, h.sigma, h.correlation);
  EXPECT_FALSE(scale_of(folder, 0.04).ok());
  EXPECT_NEAR(h.scale, 1, std::max(4 * h.sigma, 0.05));
}

}  // namespace
}  // namespace wasp::calibration
