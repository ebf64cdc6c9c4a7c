#include "sim/simulator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numbers>

#include "messages/mavlink_frame.h"

namespace wasp::sim {
namespace {

constexpr float kDegree = std::numbers::pi_v<float> / 180;

/// A companion on virtual time: talks MAVLink to a simulator, 20 Hz setpoints while `streaming`.
class Companion {
 public:
  explicit Companion(const SimConfig& config = {}, TimeNs start_ns = 100 * kSecond) : sim(config, start_ns) {}

  template <class Message>
  void send(const Message& message) {
    std::array<std::uint8_t, 280> bytes{};
    const std::size_t size = encoder_.encode(message, bytes);
    sim.from_companion(std::span(bytes).first(size));
  }
  void command(std::uint16_t id, float p1, float p2 = 0) {
    mavlink::CommandLong m{};
    m.command = id, m.param1 = p1, m.param2 = p2;
    m.target_system = 1, m.target_component = 1;
    send(m);
  }
  void send_setpoint() {
    mavlink::SetAttitudeTarget m{};
    const Quat q = quat_from_euler(attitude);
    m.q = {q.w(), q.x(), q.y(), q.z()};
    m.type_mask = 7, m.thrust = thrust;
    m.target_system = 1, m.target_component = 1;
    send(m);
  }
  void run(double seconds) {
    const TimeNs end = sim.now_ns() + from_seconds(seconds);
    for (; sim.now_ns() < end; sim.advance_to(sim.now_ns() + 5 * kMillisecond), listen())
      if (streaming && sim.now_ns() % (50 * kMillisecond) == 0) fly();
  }
  void take_off(float height_m) {
    run(3);
    command(176, 1, 1);
    command(400, 1);
    streaming = true;
    wanted_height_m = height_m;
    run(8);
  }

  Simulator sim;
  Euler attitude;
  float thrust = 0, wanted_height_m = 1, hover_thrust = 0.843f;
  bool streaming = false;
  std::map<std::uint32_t, int> count;
  std::vector<mavlink::CommandAck> acks;
  std::vector<std::string> texts;
  mavlink::Heartbeat heartbeat{};
  mavlink::HighresImu imu{};
  mavlink::Timesync timesync_reply{};

 private:
  void fly() {
    const Truth truth = sim.truth();
    thrust = hover_thrust + 0.1f * (wanted_height_m - truth.height_m) + 0.12f * truth.velocity_ned_mps[2];
    send_setpoint();
  }
  void listen() {
    bytes_.clear();
    sim.drain(bytes_);
    parser_.feed(bytes_, [&](const mavlink::Frame& frame) { hear(frame); });
  }
  void hear(const mavlink::Frame& frame) {
    ++count[frame.message_id];
    if (frame.is<mavlink::CommandAck>()) acks.push_back(frame.as<mavlink::CommandAck>());
    if (frame.is<mavlink::Heartbeat>()) heartbeat = frame.as<mavlink::Heartbeat>();
    if (frame.is<mavlink::HighresImu>()) imu = frame.as<mavlink::HighresImu>();
    if (frame.is<mavlink::Statustext>()) {
      const auto m = frame.as<mavlink::Statustext>();
      texts.emplace_back(m.text.begin(), std::find(m.text.begin(), m.text.end(), '\0'));
    }
    if (frame.is<mavlink::Timesync>()) {
      const auto m = frame.as<mavlink::Timesync>();
      if (m.tc1 != 0) timesync_reply = m;
    }
  }
  mavlink::Encoder encoder_{1, 191};
  mavlink::Parser parser_;
  std::vector<std::uint8_t> bytes_;
};

TEST(Simulator, SendsTheStreamsAtTheirRates) {
  Companion companion;
  companion.run(10);
  EXPECT_NEAR(companion.count[mavlink::HighresImu::kId], 2000, 1);
  EXPECT_NEAR(companion.count[mavlink::AttitudeQuaternion::kId], 1000, 1);
  EXPECT_NEAR(companion.count[mavlink::Heartbeat::kId], 10, 1);
  EXPECT_NEAR(companion.count[mavlink::Timesync::kId], 10, 1) << "its own requests";
  EXPECT_EQ(companion.heartbeat.type, 2);
  EXPECT_EQ(companion.heartbeat.autopilot, 0);
  EXPECT_EQ(companion.heartbeat.base_mode & 128, 0);
  EXPECT_NEAR(companion.imu.zacc, -9.81f, 0.5f);
}

TEST(Simulator, AcknowledgesCommandsAndReportsTheMode) {
  Companion companion;
  companion.run(3);
  companion.command(176, 1, 1);
  companion.command(400, 1);
  companion.command(22, 0);
  companion.run(0.05);
  ASSERT_EQ(companion.acks.size(), 3u);
  EXPECT_EQ(companion.acks[0].command, 176);
  EXPECT_EQ(companion.acks[0].result, 0);
  EXPECT_EQ(companion.acks[1].command, 400);
  EXPECT_EQ(companion.acks[1].result, 0);
  EXPECT_EQ(companion.acks[1].target_component, 191);
  EXPECT_EQ(companion.acks[2].result, 3) << "take-off is not supported";
  EXPECT_EQ(companion.heartbeat.custom_mode, 1u);
  EXPECT_EQ(companion.heartbeat.base_mode & 128, 128);
  EXPECT_EQ(companion.sim.truth().armed, 1.f);
}

TEST(Simulator, RebootsOnCommandDisarmedSilentAndWithANewClock) {
  Companion companion;
  companion.take_off(1);
  companion.command(246, 1);
  companion.run(0.05);
  EXPECT_EQ(companion.acks.back().result, 2) << "denied: it flies";
  EXPECT_EQ(companion.sim.truth().armed, 1.f);
  mavlink::CommandLong forced{};
  forced.command = 246, forced.param1 = 1, forced.param6 = 20190226.f;
  forced.target_system = forced.target_component = 1;
  companion.send(forced);
  companion.run(0.01);
  EXPECT_EQ(companion.acks.back().result, 0);
  EXPECT_EQ(companion.sim.truth().armed, 0.f);
  companion.count.clear();
  companion.run(1.4);
  EXPECT_TRUE(companion.count.empty()) << "not a word while it starts";
  companion.run(0.6);
  EXPECT_GT(companion.count[mavlink::HighresImu::kId], 80);
  EXPECT_EQ(companion.heartbeat.custom_mode, 0u);
  EXPECT_EQ(companion.heartbeat.base_mode & 128, 0);
  EXPECT_LT(companion.imu.time_usec, 2'100'000u) << "its clock began again";
}

TEST(Simulator, FailsSensorsOnCommandAndMendsThem) {
  Companion companion;
  const float pressure_hpa = 1013.25f;
  companion.run(1);
  companion.command(420, 3, 4);  // barometer, wrong
  companion.run(0.1);
  EXPECT_EQ(companion.acks.back().result, 0);
  EXPECT_GT(companion.imu.abs_pressure, pressure_hpa + 0.8f);
  companion.command(420, 3, 1);  // off
  companion.run(0.1);
  EXPECT_EQ(companion.imu.abs_pressure, 0.f);
  EXPECT_EQ(companion.imu.fields_updated & 0x200, 0);
  companion.command(420, 3, 0);
  companion.command(420, 1, 3);  // accelerometer, garbage
  companion.run(0.1);
  EXPECT_NEAR(companion.imu.abs_pressure, pressure_hpa, 0.5f);
  const float first = companion.imu.zacc;
  companion.run(0.1);
  EXPECT_GT(std::abs(companion.imu.zacc - first), 0.5f);
  companion.command(420, 1, 2);  // stuck: at the last reading before the failures
  companion.run(0.1);
  EXPECT_NEAR(companion.imu.zacc, -9.81f, 0.5f);
  const float stuck = companion.imu.xacc;
  companion.run(0.1);
  EXPECT_EQ(companion.imu.xacc, stuck);
  companion.command(420, 100, 1);
  companion.run(0.1);
  EXPECT_EQ(companion.acks.back().result, 3) << "an engine: not simulated";
}

TEST(Simulator, ItsClockStepsOnCommand) {
  Companion companion;
  companion.run(1);
  const std::uint64_t before_us = companion.imu.time_usec;
  companion.command(31010, 3600);
  companion.run(0.1);
  EXPECT_NEAR(static_cast<double>(companion.imu.time_usec - before_us), 3600.1e6, 2e4);
}

TEST(Simulator, ItsClockHasAnOffsetThatTimesyncReveals) {
  SimConfig config;
  config.clock_offset_s = 500;
  Companion companion(config);
  companion.run(1);
  mavlink::Timesync request{};
  request.ts1 = companion.sim.now_ns();
  companion.send(request);
  companion.run(0.01);
  EXPECT_EQ(companion.timesync_reply.ts1, request.ts1);
  EXPECT_EQ(companion.timesync_reply.tc1 - request.ts1, 500 * kSecond);
  EXPECT_EQ(companion.timesync_reply.target_component, 191);
  const auto imu_ns = static_cast<TimeNs>(companion.imu.time_usec) * 1000;
  EXPECT_EQ(imu_ns, companion.sim.now_ns() + 500 * kSecond) << "a sample is sent in the tick it is taken";
}

TEST(Simulator, TakesOffHoversAndTheSafetyPilotHoldsThePlace) {
  Companion companion;
  companion.take_off(1);
  double furthest = 0;
  for (int i = 0; i < 400; ++i) {
    companion.run(0.1);
    const Truth truth = companion.sim.truth();
    furthest = std::max(furthest, std::hypot(static_cast<double>(truth.position_ned_m[0]),
                                             static_cast<double>(truth.position_ned_m[1])));
    ASSERT_NEAR(truth.height_m, 1, 0.1) << "at " << i;
  }
  EXPECT_LT(furthest, 0.15);
}

TEST(Simulator, WithoutTheSafetyPilotItDrifts) {
  SimConfig config;
  config.safety_pilot = false;
  Companion with, without(config);
  for (Companion* c : {&with, &without}) c->take_off(1), c->run(20);
  const auto distance = [](const Truth& t) { return std::hypot(t.position_ned_m[0], t.position_ned_m[1]); };
  EXPECT_GT(distance(without.sim.truth()), distance(with.sim.truth()));
}

TEST(Simulator, ReachesCommandedTiltOverTheWire) {
  Companion companion;
  companion.take_off(1.5f);
  companion.attitude.pitch_rad = -8 * kDegree;
  companion.run(1.5);
  const auto& q = companion.sim.truth().q_ned_body;
  EXPECT_NEAR(euler_from_quat({q[0], q[1], q[2], q[3]}).pitch_rad / kDegree, -8, 0.5);
}

TEST(Simulator, SilenceBringsItDownAndSaysSo) {
  Companion companion;
  companion.take_off(1);
  companion.texts.clear();
  companion.streaming = false;
  companion.run(0.7);
  ASSERT_FALSE(companion.texts.empty());
  EXPECT_NE(companion.texts[0].find("no setpoint"), std::string::npos);
  EXPECT_EQ(companion.heartbeat.system_status, 5);
  companion.run(15);
  EXPECT_EQ(companion.heartbeat.base_mode & 128, 0) << "landed and disarmed";
  EXPECT_NEAR(companion.sim.truth().height_m, 0.2, 0.02);
}

TEST(Simulator, HostileSetpointsAreIgnored) {
  mavlink::SetAttitudeTarget m{};
  AttitudeSetpoint setpoint;
  m.q = {1, 0, 0, 0}, m.thrust = 0.5f, m.type_mask = 7;
  EXPECT_TRUE(setpoint_of(m, Flavour::kWasp, setpoint));
  m.thrust = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(setpoint_of(m, Flavour::kWasp, setpoint));
  m.thrust = 0.5f, m.q = {0, 0, 0, 0};
  EXPECT_FALSE(setpoint_of(m, Flavour::kWasp, setpoint));
  m.q = {1, 0, 0, 0}, m.type_mask = 3, m.body_yaw_rate = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(setpoint_of(m, Flavour::kWasp, setpoint));
  m.body_yaw_rate = 0.3f;
  EXPECT_TRUE(setpoint_of(m, Flavour::kWasp, setpoint));
  EXPECT_TRUE(setpoint.yaw_by_rate);
  m.type_mask = 64;
  EXPECT_FALSE(setpoint_of(m, Flavour::kWasp, setpoint));
}

TEST(Simulator, SameSeedSameFlight) {
  Companion a, b;
  for (Companion* c : {&a, &b}) c->take_off(1);
  EXPECT_EQ(a.sim.truth().position_ned_m, b.sim.truth().position_ned_m);
  EXPECT_EQ(a.imu.xgyro, b.imu.xgyro);
}

TEST(Simulator, FlightTimeBeginsWhenItLeavesTheGround) {
  Companion companion;
  companion.run(4);
  EXPECT_EQ(companion.sim.flight_time_s(), 0);
  companion.take_off(1);
  const double after_8s = companion.sim.flight_time_s();
  EXPECT_GT(after_8s, 6.5);
  EXPECT_LT(after_8s, 8);
  companion.streaming = false;
  companion.run(20);
  EXPECT_NEAR(companion.sim.flight_time_s(), after_8s + 20, 1e-9) << "runs on after the landing";
  EXPECT_EQ(companion.sim.pose().flight_time_s, companion.sim.flight_time_s());
}

class Presets : public testing::TestWithParam<VehiclePreset> {};

TEST_P(Presets, HoverAndReachACommandedTilt) {
  SimConfig config;
  config.vehicle = GetParam().params();
  Companion companion(config);
  companion.hover_thrust = static_cast<float>(config.vehicle.hover_thrust());
  companion.take_off(1.2f);
  companion.run(10);
  EXPECT_NEAR(companion.sim.truth().height_m, 1.2, 0.1);
  companion.attitude.roll_rad = 6 * kDegree;
  companion.run(1.5);
  const auto& q = companion.sim.truth().q_ned_body;
  EXPECT_NEAR(euler_from_quat({q[0], q[1], q[2], q[3]}).roll_rad / kDegree, 6, 0.6);
}

INSTANTIATE_TEST_SUITE_P(TableA4, Presets, testing::ValuesIn(kVehiclePresets),
                         [](const auto& preset) { return std::string(preset.param.name); });

TEST(Simulator, CruisesNorthAtItsSpeedOnItsLineWithItsHeading) {
  SimConfig config;
  config.pilot = {.cruise_mps = 1.2, .hold_heading = true};
  config.wind = {.mean_mps = 1, .from_rad = 1.5707963, .gust_mps = 0.5};
  Companion companion(config);
  companion.take_off(1);
  companion.run(6);
  const Truth begin = companion.sim.truth();
  double off_line = 0, off_heading = 0;
  for (int i = 0; i < 300; ++i) {
    companion.run(0.1);
    const Truth truth = companion.sim.truth();
    off_line = std::max(off_line, std::abs(static_cast<double>(truth.position_ned_m[1])));
    const auto& q = truth.q_ned_body;
    off_heading =
        std::max(off_heading, std::abs(static_cast<double>(euler_from_quat({q[0], q[1], q[2], q[3]}).yaw_rad)));
    ASSERT_NEAR(truth.height_m, 1, 0.2);
  }
  EXPECT_NEAR(companion.sim.truth().position_ned_m[0] - begin.position_ned_m[0], 1.2 * 30, 0.6);
  EXPECT_LT(off_line, 0.4);
  EXPECT_LT(off_heading / static_cast<double>(kDegree), 6) << "the compass and gyro are not perfect";
}

TEST(Simulator, CruiseEndsAfterItsDistanceAndNearTheGround) {
  SimConfig config;
  config.pilot = {.cruise_mps = 1.5, .cruise_distance_m = 12};
  Companion far(config);
  far.take_off(1);
  far.run(25);
  EXPECT_NEAR(far.sim.truth().position_ned_m[0], 12, 0.3);
  EXPECT_NEAR(far.sim.truth().velocity_ned_mps[0], 0, 0.1);
  config.pilot.cruise_distance_m = 0;
  Companion landing(config);
  landing.take_off(1);
  landing.run(5);
  EXPECT_GT(landing.sim.truth().velocity_ned_mps[0], 1.2f);
  landing.wanted_height_m = 0.22f;
  landing.run(8);
  EXPECT_LT(std::abs(landing.sim.truth().velocity_ned_mps[0]), 0.2f);
}

TEST(Simulator, OnTheTurntableItArmsAndTheGyroFeelsThePlatform) {
  SimConfig config;
  config.stand = {.turntable = true, .height_m = 1.5, .amplitude_radps = 0.7, .period_s = 6};
  Companion companion(config);
  companion.run(3);
  companion.command(176, 1, 1);
  companion.command(400, 1);
  companion.streaming = true;
  companion.run(2);
  EXPECT_EQ(companion.sim.truth().armed, 1.f);
  EXPECT_NEAR(companion.sim.flight_time_s(), 2, 0.01);
  double worst = 0, most = 0;
  for (int i = 0; i < 240; ++i) {
    companion.run(0.1);
    const Truth truth = companion.sim.truth();
    most = std::max(most, static_cast<double>(truth.rate_body_radps[2]));
    worst = std::max(worst, std::abs(static_cast<double>(companion.imu.zgyro - truth.rate_body_radps[2])));
    EXPECT_EQ(truth.position_ned_m[2], -1.5f);
    EXPECT_EQ(truth.armed, 1.f);
  }
  EXPECT_NEAR(most, 0.7, 0.01);
  EXPECT_LT(worst, 0.06) << "bias and noise";
  const auto& q = companion.sim.truth().q_ned_body;
  const float true_yaw = euler_from_quat({q[0], q[1], q[2], q[3]}).yaw_rad;
  EXPECT_LT(std::abs(wrap_angle(companion.sim.flight().euler().yaw_rad - true_yaw)) / kDegree, 8);
}

TEST(Simulator, NobodyListeningCostsNothing) {
  Simulator sim{SimConfig{}};
  sim.advance_to(60 * kSecond);
  std::vector<std::uint8_t> bytes;
  sim.drain(bytes);
  EXPECT_LE(bytes.size(), 64u * 1024);
}

}  // namespace
}  // namespace wasp::sim
