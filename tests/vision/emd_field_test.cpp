#include "vision/emd_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "vision/kernels/flow_grid.h"
#include "vision/kernels/frame_rotation.h"

namespace wasp::vision {
namespace {

constexpr int kWidth = 320, kHeight = 240;

EmdFlow::Params params_of_test() {
  EmdFlow::Params p;
  p.camera.intrinsics = {
      .width_px = kWidth, .height_px = kHeight, .fx_px = 208.f, .fy_px = 208.f, .cx_px = 159.5f, .cy_px = 119.5f};
  return p;
}

/// Smooth texture of period 512 px: a sum of waves of 20 to 80 px in many directions, sampled bilinearly.
float texture(float u, float v) {
  constexpr int kSize = 512;
  static const std::vector<float> table = [] {
    std::vector<float> t(kSize * kSize, 128.f);
    for (int i = 0; i < 9; ++i) {
      const double angle = 2.4 * i, cycles = 512.0 / (20.0 + 7.0 * i);
      const double a = std::round(cycles * std::cos(angle)), b = std::round(cycles * std::sin(angle));
      for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
          t[static_cast<std::size_t>(y * kSize + x)] +=
              static_cast<float>(12.0 * std::sin(2 * M_PI * (a * x + b * y) / kSize + 1.7 * i));
    }
    return t;
  }();
  const float fu = std::floor(u), fv = std::floor(v), au = u - fu, av = v - fv;
  const auto at = [](int x, int y) {
    return table[static_cast<std::size_t>((y & (kSize - 1)) * kSize + (x & (kSize - 1)))];
  };
  const int x = static_cast<int>(fu), y = static_cast<int>(fv);
  return (1 - av) * ((1 - au) * at(x, y) + au * at(x + 1, y)) + av * ((1 - au) * at(x, y + 1) + au * at(x + 1, y + 1));
}

/// Motion by column: `left` and `right` of the middle [px/frame], down.
std::vector<std::uint8_t> picture(float left_px, float right_px, float down_px, int frame) {
  std::vector<std::uint8_t> pixels(kWidth * kHeight);
  const auto f = static_cast<float>(frame);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const float shift = u < kWidth / 2 ? left_px : right_px;
      pixels[static_cast<std::size_t>(v * kWidth + u)] = static_cast<std::uint8_t>(
          std::lround(texture(static_cast<float>(u) - shift * f, static_cast<float>(v) - down_px * f)));
    }
  return pixels;
}

BehaviourInput input_of(const std::vector<std::uint8_t>& pixels, int frame, const Quat& q = Quat::Identity()) {
  BehaviourInput in;
  in.exposed_at_ns = frame * 40 * kMillisecond;
  in.frame_sequence = static_cast<std::uint32_t>(frame);
  in.gray = {pixels.data(), kWidth, kHeight, kWidth};
  in.attitude_valid = true;
  in.attitude.q_ned_body = {q.w(), q.x(), q.y(), q.z()};
  return in;
}

struct Mean {
  double left = 0, right = 0, down = 0;
  int cells = 0;
};

/// Mean flow of the outer thirds over frames 20 ... 39.
Mean mean_flow(float left_px, float right_px, float down_px) {
  const EmdFlow::Params p = params_of_test();
  EmdFlow::State state(p);
  Mean mean;
  int left = 0, right = 0;
  for (int i = 0; i < 40; ++i) {
    const auto pixels = picture(left_px, right_px, down_px, i);
    EmdFlow::step(p, input_of(pixels, i), state);
    const FlowMessage* m = EmdFlow::flow(state);
    EXPECT_EQ(m != nullptr, i > 0);
    if (i < 20) continue;
    for (int k = 0; k < m->seen.count(); ++k) {
      const FlowCell& c = m->seen.cells[static_cast<std::size_t>(k)];
      if (c.valid == 0) continue;
      ++mean.cells;
      mean.down += static_cast<double>(c.v_px);
      if (k % 12 < 4) mean.left += static_cast<double>(c.u_px), ++left;
      if (k % 12 >= 8) mean.right += static_cast<double>(c.u_px), ++right;
    }
  }
  mean.left /= left, mean.right /= right, mean.down /= mean.cells;
  return mean;
}

TEST(EmdFlow, GrowsWithSpeedOverTheRangeThatMatters) {
  double last = 0;
  for (const float speed : {0.5f, 1.f, 2.f, 4.f}) {
    const Mean m = mean_flow(speed, speed, 0.f);
    EXPECT_GT(m.left, last * 1.2);
    EXPECT_NEAR(m.left, m.right, 0.35 * m.left);
    EXPECT_GT(m.left, 0.4 * static_cast<double>(speed));
    EXPECT_LT(m.left, 2.5 * static_cast<double>(speed));
    last = m.left;
  }
}

TEST(EmdFlow, BalanceOfLeftAndRightHasItsSign) {
  const Mean expansion = mean_flow(-1.f, 3.f, 0.f);  // forward flight nearer to the right wall
  EXPECT_LT(expansion.left, 0.0);
  EXPECT_GT(expansion.right, -1.3 * expansion.left);
  const Mean mirrored = mean_flow(-3.f, 1.f, 0.f);
  EXPECT_GT(-mirrored.left, 1.3 * mirrored.right);
  EXPECT_GT(mean_flow(0.f, 0.f, 2.f).down, 0.5);
  EXPECT_LT(mean_flow(0.f, 0.f, -2.f).down, -0.5);
}

TEST(EmdFlow, DirectionsAgreeWithTheFlowGrid) {
  const EmdFlow::Params p = params_of_test();
  for (const auto& [u, v] : {std::pair{2.f, 0.f}, {-1.5f, 1.5f}, {0.f, -2.f}}) {
    EmdFlow::State state(p);
    FlowGrid grid(kWidth, kHeight, {});
    std::vector<std::uint8_t> last;
    double cosine = 0;
    int cells = 0;
    for (int i = 0; i < 40; ++i) {
      const auto pixels = picture(u, u, v, i);
      EmdFlow::step(p, input_of(pixels, i), state);
      if (i >= 30) {
        FlowField truth;
        grid.track({last.data(), kWidth, kHeight, kWidth}, {pixels.data(), kWidth, kHeight, kWidth}, truth);
        for (std::size_t k = 0; k < 108; ++k) {
          const FlowCell &a = EmdFlow::flow(state)->seen.cells[k], &b = truth.cells[k];
          if (a.valid == 0 || b.valid == 0) continue;
          EXPECT_NEAR(a.x_px, b.x_px, 1e-3f);
          EXPECT_NEAR(a.y_px, b.y_px, 1e-3f);
          ++cells;
          cosine += static_cast<double>((a.u_px * b.u_px + a.v_px * b.v_px) /
                                        (std::hypot(a.u_px, a.v_px) * std::hypot(b.u_px, b.v_px)));
        }
      }
      last = pixels;
    }
    ASSERT_GT(cells, 500);
    EXPECT_GT(cosine / cells, 0.8) << u << " " << v;
  }
}

TEST(EmdFlow, StepResponseFollowsAChangeOfDirectionWithinAFewFrames) {
  const EmdFlow::Params p = params_of_test();
  EmdFlow::State state(p);
  float way = 0, before = 0, after = 0;
  for (int i = 0; i < 40; ++i) {
    way += i < 30 ? 2.f : -2.f;
    const auto pixels = picture(way, way, 0.f, 1);
    EmdFlow::step(p, input_of(pixels, i), state);
    if (i < 29) continue;
    float sum = 0;
    for (int k = 0; k < 108; ++k) sum += EmdFlow::flow(state)->seen.cells[static_cast<std::size_t>(k)].u_px / 108.f;
    (i == 29 ? before : after) = sum;
    if (i >= 33) {
      EXPECT_LT(sum, 0.f) << i;
    }
  }
  EXPECT_GT(before, 0.5f);
  EXPECT_LT(after, -0.5f);
}

TEST(EmdFlow, TakesTheCamerasOwnTurnOutOfStill) {
  const EmdFlow::Params p = params_of_test();
  EmdFlow::State state(p);
  const float turn_rad = 0.01f;  // to the right: at infinity the image moves 2.08 px to the left
  for (int i = 0; i < 2; ++i) {
    const auto pixels = picture(-2.f, -2.f, 0.f, i);
    EmdFlow::step(p, input_of(pixels, i, quat_from_euler({0.f, 0.f, turn_rad * static_cast<float>(i)})), state);
  }
  const FlowMessage* m = EmdFlow::flow(state);
  ASSERT_NE(m, nullptr);
  EXPECT_EQ(m->derotated, 1u);
  EXPECT_EQ(m->first_exposed_at_ns, 0);
  EXPECT_EQ(m->exposed_at_ns, 40 * kMillisecond);
  const FlowCell &seen = m->seen.at(5, 4), &still = m->still.at(5, 4);
  ASSERT_EQ(seen.valid, 1);
  EXPECT_NEAR(still.u_px - seen.u_px, 208.f * turn_rad, 0.05f);
  BehaviourInput lost = input_of(picture(-2.f, -2.f, 0.f, 2), 2);
  const auto pixels = picture(-2.f, -2.f, 0.f, 2);
  lost.gray.data = pixels.data();
  lost.attitude_valid = false;
  EmdFlow::step(p, lost, state);
  EXPECT_EQ(m->derotated, 0u);
  EXPECT_EQ(m->still.at(5, 4).u_px, m->seen.at(5, 4).u_px);
}

TEST(FrameRotation, TakesAFixedDirectionFromTheFirstCameraToTheSecond) {
  const Mat3 R_body_cam = R_body_cam_from_pitch_down(Radians{0.4});
  const Quat q1 = quat_from_euler({0.1f, -0.05f, 0.3f}), q2 = quat_from_euler({0.05f, 0.02f, 0.5f});
  const Vec3 world = Vec3(1.f, 0.4f, 0.3f).normalized();
  const Vec3 first = R_body_cam.transpose() * (q1.conjugate() * world);
  const Vec3 second = R_body_cam.transpose() * (q2.conjugate() * world);
  const Mat3 R = frame_rotation(R_body_cam, {q1.w(), q1.x(), q1.y(), q1.z()}, {q2.w(), q2.x(), q2.y(), q2.z()});
  EXPECT_LT((R * first - second).norm(), 1e-6f);
}

TEST(EmdFlow, BlindInputIsBlindAndNotAnError) {
  EmdFlow::Params p = params_of_test();
  EmdFlow::State state(p);
  EXPECT_EQ(EmdFlow::step(p, {}, state).validity, Validity::kBlind);
  EXPECT_EQ(EmdFlow::flow(state), nullptr);
  const std::vector<std::uint8_t> blank(kWidth * kHeight, 100);
  const auto texture_image = picture(0.f, 0.f, 0.f, 0);
  for (const int frame : {0, 1, 2}) {
    const CueBody cue = EmdFlow::step(p, input_of(blank, frame), state);
    EXPECT_EQ(cue.validity, Validity::kBlind);
    EXPECT_EQ(cue.detail[EmdFlow::kValidCells], 0.f);
  }
  for (const TimeNs t : {TimeNs{0}, kNever, std::numeric_limits<TimeNs>::max(), TimeNs{-5}, TimeNs{kSecond}}) {
    BehaviourInput in = input_of(texture_image, 0);
    in.exposed_at_ns = t;
    in.attitude.q_ned_body[1] = std::nanf("");
    EmdFlow::step(p, in, state);
    EXPECT_EQ(EmdFlow::flow(state), nullptr);  // a gap, or no time between the frames
  }
  p.grid.columns = 60;
  EXPECT_THROW(EmdFlow::State{p}, std::invalid_argument);
}

TEST(EmdFlow, AllocatesNothingAndReplaysToTheBit) {
  const EmdFlow::Params p = params_of_test();
  EmdFlow::State state(p);
  for (int i = 0; i < 5; ++i) {
    const auto pixels = picture(1.f, -1.f, 0.5f, i);
    EmdFlow::State copy = state;
    CueBody a, b;
    const wasp::test::MallocCount count;
    {
      const rt::RealtimeSection section;
      a = EmdFlow::step(p, input_of(pixels, i), state);
      b = EmdFlow::step(p, input_of(pixels, i), copy);
    }
    EXPECT_EQ(count.violations(), 0u);
    EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0);
    EXPECT_EQ(std::memcmp(&state.message, &copy.message, sizeof state.message), 0);
  }
}

}  // namespace
}  // namespace wasp::vision
