// The camera's delay: on simulated recordings whose delay is drawn at random, on the real clips with a known lag, and
// refused where the motion says nothing.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "calibration/calibrate_delay.h"
#include "tests/calibration/hover_run.h"
#include "tests/calibration/simulated_run.h"

namespace wasp::calibration {
namespace {

DelayFit delay_of(const std::vector<std::filesystem::path>& folders) {
  std::vector<DelayRun> runs;
  for (const auto& folder : folders) {
    const auto recording = drivers::Recording::open(folder);
    runs.push_back({image_turns(recording), turn_source_of(recording, "best")});
  }
  return fit_delay(runs);
}
DelayFit delay_of(const std::filesystem::path& folder) { return delay_of(std::vector{folder}); }

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
  const DelayRun mixed{image_turns(images), turn_source_of(gyro, "gyro")};
  EXPECT_FALSE(fit_delay({&mixed, 1}).ok());
}

TEST(Delay, ShortRecordingsTellMoreTogether) {
  constexpr double kDelay_s = 0.035;
  const test::HoverRun first({.delay_s = kDelay_s, .seed = 11, .frames = 30}),
      second({.delay_s = kDelay_s, .seed = 12, .frames = 30});
  const DelayFit one = delay_of(first.folder()), both = delay_of({first.folder(), second.folder()});
  EXPECT_TRUE(both.ok()) << both.refusal;
  EXPECT_NEAR(both.delay_s, kDelay_s, 0.002);
  EXPECT_LT(both.sigma_s, one.sigma_s);
  EXPECT_EQ(both.frames, 58u);
  ASSERT_EQ(both.runs.size(), 2u);
  EXPECT_NEAR(both.runs[0].delay_s, one.delay_s, 0.002);
}

TEST(Delay, RefusedWhereRecordingsDisagree) {
  const test::HoverRun first({.delay_s = 0.02, .seed = 11, .frames = 30}),
      second({.delay_s = 0.045, .seed = 12, .frames = 30});
  const DelayFit fit = delay_of({first.folder(), second.folder()});
  EXPECT_NE(fit.refusal.find("do not agree"), std::string::npos) << fit.refusal;
}

/// The data's maker says 40 ms, best over 1593 frames of which these clips are excerpts of 40. But he held the flow
/// from the frame before against the rate at the frame: half a frame too much; and poses that the log repeats, 3 ms
/// late, as they stood (docs/calibration.md).
constexpr double kHover_s = 0.040 - 0.5 / 60 + 0.003;

std::filesystem::path hover_clip(const std::string& name) {
  return std::filesystem::path(WASP_SOURCE_DIR "/../shared/data/hover_mocap") / name;
}

class HoverDelay : public testing::TestWithParam<const char*> {};
TEST_P(HoverDelay, FoundOrRefused) {
  const std::filesystem::path folder = hover_clip(GetParam());
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no recording at " << folder;
  const DelayFit fit = delay_of(folder);
  std::printf("[ measured ] %s: %.1f ms, sigma %.1f, likelihood %.0f %s\n", GetParam(), 1e3 * fit.delay_s,
              1e3 * fit.sigma_s, fit.likelihood, fit.refusal.c_str());
  if (fit.ok()) {
    EXPECT_NEAR(fit.delay_s, kHover_s, 0.005);
  }
  EXPECT_NEAR(fit.delay_s, kHover_s, 3 * fit.sigma_s + 0.005);  // what is refused is not wrong by more than it says
}
INSTANTIATE_TEST_SUITE_P(Clips, HoverDelay, testing::Values("climb", "climb_yaw", "lateral_yaw", "descend"));

TEST(Delay, FourHoverClipsTogether) {
  if (!std::filesystem::exists(hover_clip("climb"))) GTEST_SKIP() << "no recording at " << hover_clip("climb");
  const DelayFit fit =
      delay_of({hover_clip("climb"), hover_clip("climb_yaw"), hover_clip("lateral_yaw"), hover_clip("descend")});
  std::printf("[ measured ] together: %.1f ms, sigma %.1f, discord %.1f\n", 1e3 * fit.delay_s, 1e3 * fit.sigma_s,
              fit.discord);
  EXPECT_TRUE(fit.ok()) << fit.refusal;
  EXPECT_NEAR(fit.delay_s, kHover_s, 0.005);
}

/// Rates of the centre's shift and growth in a clip's table, one row a frame (the data's README has the relations).
std::vector<Eigen::Vector3d> table_rates(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line, field;
  std::getline(in, line);
  std::vector<Eigen::Vector3d> rates;
  while (std::getline(in, line)) {
    std::array<double, 9> column{};
    std::istringstream fields(line);
    for (double& value : column)
      if (std::getline(fields, field, ',')) value = std::stod(field);
    const auto [frame, t, h, vx, vy, vz, wx, wy, wz] = column;
    rates.emplace_back(-vy - wx, -vx + wy, -vz);
  }
  return rates;
}

using Pairs = std::vector<std::array<double, 2>>;

double correlation(const Pairs& pairs) {
  double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  const auto n = static_cast<double>(pairs.size());
  for (const auto& [a, b] : pairs) x += a / n, y += b / n;
  for (const auto& [a, b] : pairs) xx += (a - x) * (a - x), xy += (a - x) * (b - y), yy += (b - y) * (b - y);
  return xy / std::sqrt(xx * yy);
}

/// Why kHover_s is half a frame less than 40 ms: the table's rates go with the flow that ends at the frame.
TEST(Delay, TheHoverTableHoldsAFrameAgainstTheFlowBeforeIt) {
  if (!std::filesystem::exists(hover_clip("climb"))) GTEST_SKIP() << "no recording at " << hover_clip("climb");
  std::array<Pairs, 3> before, after;
  for (const char* clip : {"climb", "climb_yaw", "lateral_yaw", "descend"}) {
    const auto rates = table_rates(hover_clip(clip) / "gt_per_frame.csv");
    const auto turns = image_turns(drivers::Recording::open(hover_clip(clip)));
    ASSERT_EQ(turns.size() + 1, rates.size());
    for (std::size_t i = 0; i < turns.size(); ++i)
      for (int a = 0; a < 3 && turns[i].centre.allFinite(); ++a) {
        before[static_cast<std::size_t>(a)].push_back({turns[i].centre[a], rates[i + 1][a]});
        after[static_cast<std::size_t>(a)].push_back({turns[i].centre[a], rates[i][a]});
      }
  }
  for (std::size_t a = 0; a < 3; ++a) {
    std::printf("[ measured ] %s: correlation %.4f with the flow before the frame, %.4f with that after\n",
                kChannelNames[a + 3], correlation(before[a]), correlation(after[a]));
    EXPECT_GT(correlation(before[a]), correlation(after[a]));
  }
}

TEST(Delay, RefusedOnTheStand) {
  const std::filesystem::path folder = WASP_SOURCE_DIR "/../shared/data/euroc_v101/cam0_static";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no recording at " << folder;
  EXPECT_FALSE(delay_of(folder).ok());
}

}  // namespace
}  // namespace wasp::calibration
