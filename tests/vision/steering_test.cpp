// The six behaviours that steer by the shared flow field, in a corridor of ray-cast flow (corridor_flight.h): step
// responses, blind input, no allocation, replay to the bit, and the closed loop.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "tests/vision/corridor_flight.h"
#include "vision/centring.h"
#include "vision/flow_balance.h"
#include "vision/landing.h"
#include "vision/obstacle_depth.h"
#include "vision/optomotor.h"
#include "vision/speed.h"

namespace wasp::vision {
namespace {

using namespace wasp::vision::test;

FlightParams quiet(float y_m = 0, float heading_rad = 0, float speed_mps = 0.8f) {
  FlightParams p;
  p.start_y_m = y_m, p.start_heading_rad = heading_rad, p.speed_mps = speed_mps;
  p.flow_noise_px = p.dropout = p.wild = p.gyro_noise_radps = p.gyro_bias_radps = p.gust_mps2 = 0;
  p.depth_noise = p.depth_dropout = 0;
  return p;
}

BehaviourInput input_of(const FlowMessage& m) {
  BehaviourInput in;
  in.exposed_at_ns = m.exposed_at_ns;
  in.frame_sequence = m.frame_sequence;
  in.flow = &m;
  in.attitude_valid = true;
  in.attitude.q_ned_body = m.q_ned_body;
  return in;
}

template <class B>
typename B::Params params_of(const FlightParams& p) {
  typename B::Params params;
  params.camera = CorridorFlight::geometry_of(p);
  return params;
}

/// What B says after `fields` fields of a flight straight on.
template <class B>
CueBody after(const FlightParams& p, const Corridor& world = {}, int fields = 12, typename B::Params params = {}) {
  CorridorFlight flight(p, world, 1);
  params.camera = flight.geometry();
  auto state = make_state<B>(params);
  CueBody cue;
  flight.next_field();
  for (int i = 0; i < fields; ++i) cue = B::step(params, input_of(flight.next_field()), state);
  return cue;
}

TEST(FlowBalance, TurnsAwayFromTheNearerWallAndBackToTheAxis) {
  const CueBody right = after<FlowBalance>(quiet(0.5f)), left = after<FlowBalance>(quiet(-0.5f));
  ASSERT_EQ(right.validity, Validity::kValid);
  EXPECT_LT(right.heading_rate_radps, -0.03f);
  EXPECT_GT(left.heading_rate_radps, 0.03f);
  EXPECT_NEAR(right.heading_rate_radps, -left.heading_rate_radps, 0.02f);
  EXPECT_NEAR(after<FlowBalance>(quiet()).heading_rate_radps, 0.f, 0.02f);
  EXPECT_LT(after<FlowBalance>(quiet(0, 0.15f)).heading_rate_radps, -0.02f) << "heading to the right: back to the left";
}

TEST(FlowBalance, SaysNothingWhileNothingPasses) {
  EXPECT_EQ(after<FlowBalance>(quiet(0.3f, 0, 0.f)).has_heading_rate, 0);
}

TEST(Centring, TurnsToTheSlowerSide) {
  EXPECT_LT(after<Centring>(quiet(0.5f)).heading_rate_radps, -0.02f);
  EXPECT_GT(after<Centring>(quiet(-0.5f)).heading_rate_radps, 0.02f);
}

TEST(Speed, NoseUpWhenTheWallsPassTooFastAndDownWhenTooSlow) {
  const CueBody fast = after<Speed>(quiet(0, 0, 2.5f)), slow = after<Speed>(quiet(0, 0, 0.25f));
  ASSERT_EQ(fast.has_pitch, 1);
  ASSERT_EQ(slow.has_pitch, 1);
  EXPECT_GT(fast.pitch_rad, 0.01f);
  EXPECT_LT(slow.pitch_rad, -0.01f);
}

TEST(Optomotor, TurnsAgainstATurnNobodyCommanded) {
  const FlightParams p = quiet();
  CorridorFlight flight(p, {}, 1);
  const auto params = params_of<Optomotor>(p);
  Optomotor::State state;
  CueBody cue;
  flight.next_field();
  for (int i = 0; i < 8; ++i) {
    flight.set_vehicle().yaw_rate_radps = 0.3f;
    cue = Optomotor::step(params, input_of(flight.next_field()), state);
  }
  ASSERT_EQ(cue.has_heading_rate, 1);
  EXPECT_LT(cue.heading_rate_radps, -0.05f);
  EXPECT_NEAR(cue.detail[Optomotor::kYawRate_radps], 0.3f, 0.1f);
}

TEST(ObstacleDepth, TurnsRoundAPillarToTheFreerSide) {
  Corridor world;
  world.width_m = 4.f;
  world.boxes = {{3.f, 0.25f, 0.2f, 0.3f, 2.f}};
  const CueBody right = after<ObstacleDepth>(quiet(), world, 20);
  world.boxes[0].y_m = -0.25f;
  const CueBody left = after<ObstacleDepth>(quiet(), world, 20);
  ASSERT_EQ(right.has_heading_rate, 1);
  EXPECT_LT(right.heading_rate_radps, -0.02f);
  EXPECT_GT(left.heading_rate_radps, 0.02f);
}

TEST(ObstacleDepth, KeepsStillInAnEmptyCorridor) {
  EXPECT_NEAR(after<ObstacleDepth>(quiet(), {}, 20).heading_rate_radps, 0.f, 0.03f);
}

/// A level floor `height_m` below a camera that looks straight down and moves ahead.
FlowMessage ventral(float height_m, float speed_mps, int frame) {
  FlowMessage m;
  m.first_exposed_at_ns = (frame + 1) * kSecond / 30;
  m.exposed_at_ns = (frame + 2) * kSecond / 30;
  m.frame_sequence = static_cast<std::uint32_t>(frame);
  m.derotated = 1;
  const Intrinsics k{.width_px = 320, .height_px = 240, .fx_px = 160, .fy_px = 160, .cx_px = 159.5f, .cy_px = 119.5f};
  for (int row = 0; row < 9; ++row)
    for (int column = 0; column < 12; ++column) {
      FlowCell& c = m.seen.at(column, row);
      c.x_px = 20.f + 25.f * static_cast<float>(column), c.y_px = 20.f + 25.f * static_cast<float>(row);
      c.v_px = k.fy_px * speed_mps / height_m / 30.f;  // the image's top is ahead: what is passed goes down
      c.valid = 1, c.quality = 1;
    }
  m.still = m.seen;
  return m;
}

CueBody over_ground(float height_m, float speed_mps) {
  Landing::Params params;
  params.camera.intrinsics = {
      .width_px = 320, .height_px = 240, .fx_px = 160, .fy_px = 160, .cx_px = 159.5f, .cy_px = 119.5f};
  params.camera.R_body_cam = R_body_cam_from_pitch_down(Radians{1.5707963});
  Landing::State state;
  CueBody cue;
  for (int i = 0; i < 20; ++i) {
    const FlowMessage m = ventral(height_m, speed_mps, i);
    cue = Landing::step(params, input_of(m), state);
  }
  return cue;
}

TEST(Landing, PitchesToHoldTheVentralFlowAndSinks) {
  const CueBody fast = over_ground(1.f, 1.f), slow = over_ground(1.f, 0.25f), right = over_ground(2.f, 1.f);
  ASSERT_EQ(fast.has_pitch, 1);
  EXPECT_GT(fast.pitch_rad, 0.01f);
  EXPECT_LT(slow.pitch_rad, -0.01f);
  EXPECT_NEAR(right.pitch_rad, 0.f, 0.01f) << "0.5 rad/s is the setpoint";
  EXPECT_NEAR(right.detail[Landing::kForward_radps], 0.5f, 0.02f);
  EXPECT_EQ(right.has_climb, 1);
  EXPECT_LT(right.climb_1ps, 0.f);
}

template <class B>
class Steering : public ::testing::Test {};
using All = ::testing::Types<FlowBalance, ObstacleDepth, Centring, Speed, Landing, Optomotor>;
TYPED_TEST_SUITE(Steering, All);

TYPED_TEST(Steering, BlindInputGivesNoWishAndNoCrash) {
  const FlightParams p = quiet();
  const auto params = params_of<TypeParam>(p);
  auto state = make_state<TypeParam>(params);
  CorridorFlight flight(p, {}, 1);
  flight.next_field();
  const FlowMessage good = flight.next_field();
  const auto silent = [&](const FlowMessage* m) {
    BehaviourInput in = input_of(good);
    in.flow = m;
    if (m != nullptr) in.exposed_at_ns = m->exposed_at_ns;
    const CueBody cue = TypeParam::step(params, in, state);
    return cue.validity == Validity::kBlind ||
           (cue.has_heading_rate == 0 && cue.has_pitch == 0 && cue.has_climb == 0) ||
           (cue.heading_rate_radps == 0.f && cue.pitch_rad == 0.f);
  };
  EXPECT_TRUE(silent(nullptr));
  FlowMessage empty = good;
  for (FlowField* f : {&empty.seen, &empty.still})
    for (FlowCell& c : f->cells) c.valid = 0;
  empty.depth_m = {};
  EXPECT_TRUE(silent(&empty));
  FlowMessage no_time = good;
  no_time.exposed_at_ns = no_time.first_exposed_at_ns;
  EXPECT_TRUE(silent(&no_time));
  FlowMessage backwards = good;
  std::swap(backwards.exposed_at_ns, backwards.first_exposed_at_ns);
  EXPECT_TRUE(silent(&backwards));
}

TYPED_TEST(Steering, BrokenNumbersNeverReachTheCue) {
  const FlightParams p = quiet(0.4f);
  const auto params = params_of<TypeParam>(p);
  auto state = make_state<TypeParam>(params);
  CorridorFlight flight(p, {}, 1);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  for (int i = 0; i < 40; ++i) {
    FlowMessage m = flight.next_field();
    const auto k = static_cast<std::size_t>(i % 108);
    const float bad = i % 3 == 0 ? kNan : i % 3 == 1 ? kInf : -1e30f;
    if (i % 2 == 0) m.still.cells[k].u_px = m.seen.cells[k].v_px = bad;
    if (i % 5 == 0) m.depth_m[k] = bad;
    if (i % 7 == 0) m.q_ned_body[1] = bad;
    if (i % 11 == 0) m.R_second_first[4] = bad;
    if (i % 13 == 0) m.seen.columns = m.still.columns = 1000;
    BehaviourInput in = input_of(m);
    if (i % 4 == 0) in.attitude.rate_body_radps[2] = bad;
    const CueBody cue = TypeParam::step(params, in, state);
    EXPECT_TRUE(std::isfinite(cue.heading_rate_radps + cue.pitch_rad + cue.climb_mps + cue.climb_1ps)) << i;
    EXPECT_LE(std::fabs(cue.heading_rate_radps), 2.f) << i;
    EXPECT_LE(std::fabs(cue.pitch_rad), 0.36f) << i;
  }
}

TYPED_TEST(Steering, AllocatesNothingAndReplaysToTheBit) {
  FlightParams p;  // with all its noise
  p.start_y_m = 0.3f;
  const auto params = params_of<TypeParam>(p);
  auto state = make_state<TypeParam>(params), again = make_state<TypeParam>(params);
  CorridorFlight flight(p, busy_corridor(3), 3);
  flight.next_field();
  for (int i = 0; i < 60; ++i) {
    const FlowMessage m = flight.next_field();
    const BehaviourInput in = input_of(m);
    const wasp::test::MallocCount count;
    CueBody cue, same;
    {
      const rt::RealtimeSection section;
      cue = TypeParam::step(params, in, state);
      same = TypeParam::step(params, in, again);
    }
    EXPECT_EQ(count.violations(), 0u);
    ASSERT_EQ(std::memcmp(&cue, &same, sizeof cue), 0) << i;
  }
}

/// Both balance processes together, as the corridor missions fly them.
FlightLog fly(const FlightParams& p, const Corridor& world, unsigned seed, bool obstacles) {
  CorridorFlight flight(p, world, seed);
  const auto balance = params_of<FlowBalance>(p);
  const auto depth = params_of<ObstacleDepth>(p);
  FlowBalance::State balance_state{};
  auto depth_state = make_state<ObstacleDepth>(depth);
  return flight.fly(40.f, [&](const FlowMessage& m) {
    const BehaviourInput in = input_of(m);
    SteeringWish wish;
    wish.heading_rate_radps = FlowBalance::step(balance, in, balance_state).heading_rate_radps;
    if (obstacles) wish.heading_rate_radps += ObstacleDepth::step(depth, in, depth_state).heading_rate_radps;
    return wish;
  });
}

TEST(FlowBalance, SettlesInTheMiddleWithoutALimitCycle) {
  for (const float speed_mps : {0.5f, 0.8f, 1.2f}) {
    FlightParams p;
    p.speed_mps = speed_mps, p.start_y_m = 0.4f, p.start_heading_rad = -0.1f, p.gust_mps2 = 0;
    Corridor world;
    world.length_m = 40.f;
    const FlightLog log = fly(p, world, 7, false);
    EXPECT_FALSE(log.collided) << speed_mps;
    EXPECT_LE(log.lateral_rms_m(10.f), 0.1f * world.width_m) << speed_mps;
    EXPECT_LE(log.largest_m(25.f, 36.f), log.largest_m(0.f, 11.f) + 0.05f) << "no growing swing at " << speed_mps;
  }
}

}  // namespace
}  // namespace wasp::vision
