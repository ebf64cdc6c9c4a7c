#include "vision/edge_peak.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"

namespace wasp::vision {
namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr float kFocal = 208.f;

EdgePeak::Params params_of(EdgePeakMode mode) {
  EdgePeak::Params p;
  p.camera.intrinsics = {
      .width_px = kWidth, .height_px = kHeight, .fx_px = kFocal, .fy_px = kFocal, .cx_px = 159.5f, .cy_px = 119.5f};
  p.mode = static_cast<int>(mode);
  p.release_s = p.hold_s = 0.f;
  p.share = 0.5f;
  p.centre_share = 1.f;
  return p;
}

/// Bars from column `left` to `right`, brightest in the middle row; depth per pixel.
struct Picture {
  std::vector<std::uint8_t> gray = std::vector<std::uint8_t>(kWidth * kHeight, 100);
  std::vector<std::uint16_t> depth_mm = std::vector<std::uint16_t>(kWidth * kHeight, 5000);

  Picture& bar(int row, std::uint16_t mm, int contrast = 100, int left = 0, int right = kWidth) {
    for (int v = std::max(row - 3, 0); v < std::min(row + 4, kHeight); ++v)
      for (int u = left; u < right; ++u) {
        const auto i = static_cast<std::size_t>(v * kWidth + u);
        if (v >= row - 1 && v <= row + 1) gray[i] = static_cast<std::uint8_t>(100 + contrast);
        depth_mm[i] = mm;
      }
    return *this;
  }
  [[nodiscard]] BehaviourInput input(TimeNs at_ns = 0, float pitch_rad = 0.f) const {
    BehaviourInput in;
    in.exposed_at_ns = at_ns;
    in.gray = {gray.data(), kWidth, kHeight, kWidth};
    in.depth = {depth_mm.data(), kWidth, kHeight, kWidth};
    in.attitude_valid = true;
    const Quat q = quat_from_euler({0.f, pitch_rad, 0.f});
    in.attitude.q_ned_body = {q.w(), q.x(), q.y(), q.z()};
    return in;
  }
};

CueBody once(const EdgePeak::Params& p, const BehaviourInput& input) {
  EdgePeak::State state(p);
  return EdgePeak::step(p, input, state);
}

TEST(EdgePeak, ClimbsForEdgesAboveTheSetpointAndSinksForEdgesBelow) {
  const EdgePeak::Params p = params_of(EdgePeakMode::kAll);
  const CueBody up = once(p, Picture().bar(150, 2000).input());
  ASSERT_EQ(up.validity, Validity::kValid);
  EXPECT_EQ(up.has_climb, 1);
  EXPECT_EQ(up.has_height, 0);
  EXPECT_NEAR(up.detail[EdgePeak::kSetpointRow_px], 119.5f + 60.f, 0.01f);  // half-way down the lower half
  EXPECT_NEAR(up.detail[EdgePeak::kPeakRow_px], 150.f, 5.f);
  EXPECT_GT(up.climb_mps, 0.2f);
  EXPECT_NEAR(up.climb_mps, p.gain_mps_rad * up.detail[EdgePeak::kDelta_rad], 1e-6f);
  EXPECT_NEAR(once(p, Picture().bar(183, 2000).input()).climb_mps, 0.f, 0.1f);
  EXPECT_LT(once(p, Picture().bar(200, 2000).input()).climb_mps, -0.1f);
  EXPECT_EQ(once(p, Picture().bar(5, 2000).input()).climb_mps, p.max_climb_mps);
  EXPECT_EQ(once(p, Picture().bar(236, 2000).input()).climb_mps, -p.max_sink_mps);
}

TEST(EdgePeak, NearPeakLeavesOutEdgesThatAreFarOrWithoutDepth) {
  for (const std::uint16_t far_mm : {std::uint16_t{3000}, std::uint16_t{0}, std::uint16_t{65535}}) {
    const Picture p = Picture().bar(100, far_mm).bar(200, 2900, 60);
    EXPECT_GT(once(params_of(EdgePeakMode::kAll), p.input()).climb_mps, 0.5f);
    const CueBody near = once(params_of(EdgePeakMode::kNear), p.input());
    EXPECT_LT(near.climb_mps, -0.1f);
    EXPECT_NEAR(near.detail[EdgePeak::kPeakRow_px], 200.f, 8.f);
  }
}

TEST(EdgePeak, SharpPeakLeavesOutWeakGradients) {
  const Picture p = Picture().bar(100, 0, 30).bar(200, 0, 100);
  EXPECT_LT(once(params_of(EdgePeakMode::kSharp), p.input()).climb_mps, -0.1f);
}

TEST(EdgePeak, SinksGentlyWhereNothingIsNear) {
  const EdgePeak::Params p = params_of(EdgePeakMode::kNear);
  const CueBody cue = once(p, Picture().bar(100, 4000).input());
  ASSERT_EQ(cue.validity, Validity::kValid);
  EXPECT_EQ(cue.climb_mps, -p.idle_sink_mps);
  EXPECT_EQ(cue.quality, 0.5f);
  EXPECT_EQ(cue.detail[EdgePeak::kEdges], 0.f);
}

TEST(EdgePeak, PitchOfTheVehicleDoesNotMatter) {
  const EdgePeak::Params p = params_of(EdgePeakMode::kAll);
  const float level = once(p, Picture().bar(160, 2000).input()).detail[EdgePeak::kDelta_rad];
  const float below = std::atan((160.f - 119.5f) / kFocal);
  for (const float pitch_rad : {-0.2f, 0.15f}) {  // nose up: the same edge lower in the image
    const int row = static_cast<int>(std::lround(119.5f + kFocal * std::tan(below + pitch_rad)));
    EXPECT_NEAR(once(p, Picture().bar(row, 2000).input(0, pitch_rad)).detail[EdgePeak::kDelta_rad], level, 0.012f);
  }
}

TEST(EdgePeak, MountAndWidthOfTheImageTakenIntoAccount) {
  EdgePeak::Params p = params_of(EdgePeakMode::kAll);
  p.camera.R_body_cam = R_body_cam_from_pitch_down(Radians{0.3});
  EXPECT_NEAR(once(p, Picture().bar(100, 2000).input()).detail[EdgePeak::kSetpointRow_px],
              119.5f + kFocal * std::tan(std::atan(60.f / kFocal) - 0.3f), 0.1f);
  p = params_of(EdgePeakMode::kAll);
  p.centre_share = 0.5f;
  const Picture beside = Picture().bar(60, 2000, 100, 0, 70).bar(200, 2000, 100, 130, 190);
  EXPECT_LT(once(p, beside.input()).climb_mps, 0.f);
  p.centre_share = 1.f;
  EXPECT_GT(once(p, beside.input()).climb_mps, 0.f);
}

TEST(EdgePeak, StepResponseRisesAtOnceFadesSlowlyAndHoldsOverTheRoof) {
  EdgePeak::Params p = params_of(EdgePeakMode::kNear);
  p.release_s = 1.f;
  p.hold_s = 2.f;
  const Picture empty, wall = Picture().bar(100, 2500);
  EdgePeak::State state(p);
  const auto at = [&](const Picture& picture, int frame) {
    return EdgePeak::step(p, picture.input(frame * 40 * kMillisecond), state).climb_mps;
  };
  EXPECT_EQ(at(empty, 0), -p.idle_sink_mps);
  const float wish = at(wall, 1);
  EXPECT_GT(wish, 0.5f);
  EXPECT_NEAR(at(wall, 2), wish, 1e-6f);
  float faded = 0;
  for (int i = 3; i <= 27; ++i) faded = at(empty, i);
  EXPECT_NEAR(faded, wish * std::exp(-1.f), 0.02f);                  // a second later
  for (int i = 28; i <= 51; ++i) EXPECT_GE(at(empty, i), 0.f) << i;  // two seconds after the last near edge
  for (int i = 52; i <= 120; ++i) faded = at(empty, i);
  EXPECT_EQ(faded, -p.idle_sink_mps);
}

/// Noise that moves down `shift` pixels, a band of rows only; the rest stands still.
Picture moving_band(int first_row, int shift, unsigned seed) {
  Picture p;
  std::mt19937 random(seed);
  std::vector<std::uint8_t> texture(kWidth * kHeight);
  for (int v = 0; v < kHeight; v += 6)
    for (int u = 0; u < kWidth; u += 6) {
      const auto x = static_cast<std::uint8_t>(60 + random() % 120);
      for (int j = 0; j < 6 && v + j < kHeight; ++j)
        for (int i = 0; i < 6 && u + i < kWidth; ++i) texture[static_cast<std::size_t>((v + j) * kWidth + u + i)] = x;
    }
  for (int v = 0; v < kHeight; ++v) {
    const int from = v >= first_row && v < first_row + 40 ? (v - shift + 4 * kHeight) % kHeight : v;
    std::memcpy(&p.gray[static_cast<std::size_t>(v * kWidth)], &texture[static_cast<std::size_t>(from * kWidth)],
                kWidth);
  }
  return p;
}

TEST(EdgePeak, MotionDetectorsSeeMovingEdgesOnly) {
  const EdgePeak::Params p = params_of(EdgePeakMode::kMoving);
  for (const int first : {80, 180}) {
    EdgePeak::State state(p);
    CueBody cue;
    for (int i = 0; i < 60; ++i) {
      cue = EdgePeak::step(p, moving_band(first, i, 3).input(i * 40 * kMillisecond), state);
      EXPECT_EQ(cue.validity, i == 0 ? Validity::kBlind : Validity::kValid);
    }
    EXPECT_GE(cue.detail[EdgePeak::kPeakRow_px], static_cast<float>(first) - 12.f);
    EXPECT_LE(cue.detail[EdgePeak::kPeakRow_px], static_cast<float>(first) + 50.f);
    EXPECT_EQ(cue.climb_mps > 0.3f, first == 80) << cue.climb_mps;
    EXPECT_EQ(cue.climb_mps < 0.f, first == 180) << cue.climb_mps;
  }
}

TEST(EdgePeak, BlindInputIsBlindAndNotAnError) {
  const EdgePeak::Params p = params_of(EdgePeakMode::kNear);
  const Picture picture = Picture().bar(100, 2000);
  EXPECT_EQ(once(p, {}).validity, Validity::kBlind);
  BehaviourInput in = picture.input();
  in.depth = {};
  EXPECT_EQ(once(p, in).validity, Validity::kBlind);  // no depth, no near edges
  EXPECT_EQ(once(params_of(EdgePeakMode::kAll), in).validity, Validity::kValid);
  in = picture.input();
  in.gray.width_px = 160;
  EXPECT_EQ(once(p, in).validity, Validity::kBlind);
  in = picture.input();
  in.attitude.q_ned_body = {std::nanf(""), 0.f, 0.f, 0.f};  // taken as level
  EXPECT_GT(once(p, in).climb_mps, 0.f);
  EdgePeak::Params odd = p;
  odd.gain_mps_rad = std::nanf("");
  EXPECT_EQ(once(odd, picture.input()).validity, Validity::kBlind);
  odd = params_of(EdgePeakMode::kMoving);
  odd.camera.intrinsics.width_px = odd.camera.intrinsics.height_px = 4;
  EXPECT_EQ(once(odd, picture.input()).validity, Validity::kBlind);
}

TEST(EdgePeak, TimesThatJumpDoNotHurt) {
  EdgePeak::Params p = params_of(EdgePeakMode::kNear);
  p.hold_s = p.release_s = 1.f;
  EdgePeak::State state(p);
  const Picture wall = Picture().bar(100, 2000), empty;
  for (const TimeNs t : {TimeNs{0}, kNever, std::numeric_limits<TimeNs>::max(), TimeNs{-5}, TimeNs{kSecond}}) {
    EXPECT_GT(EdgePeak::step(p, wall.input(t), state).climb_mps, 0.f);
    EXPECT_TRUE(std::isfinite(EdgePeak::step(p, empty.input(t), state).climb_mps));
  }
}

TEST(EdgePeak, AllocatesNothingAndReplaysToTheBit) {
  for (int mode = 0; mode <= 3; ++mode) {
    const EdgePeak::Params p = params_of(static_cast<EdgePeakMode>(mode));
    EdgePeak::State state(p);
    for (int i = 0; i < 4; ++i) {
      const Picture picture = moving_band(100, i, 5);
      EdgePeak::State copy = state;
      CueBody a, b;
      const wasp::test::MallocCount count;
      {
        const rt::RealtimeSection section;
        a = EdgePeak::step(p, picture.input(i * 40 * kMillisecond), state);
        b = EdgePeak::step(p, picture.input(i * 40 * kMillisecond), copy);
      }
      EXPECT_EQ(count.violations(), 0u);
      EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0);
    }
  }
}

}  // namespace
}  // namespace wasp::vision
