// The autopilot link as a conversation: what comes in as samples, what goes out as bytes, whom it ignores.
#include "drivers/autopilot_link.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "types/frames.h"

namespace wasp::drivers {
namespace {

using namespace mavlink;  // NOLINT: message names
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr TimeNs kT0 = 10'000 * kSecond;

struct Recorder {
  std::vector<ImuSample> imus;
  std::vector<AttitudeSample> attitudes;
  std::vector<AutopilotStatus> beats;
  std::vector<std::pair<std::uint16_t, std::uint8_t>> acks;
  std::vector<std::pair<std::uint8_t, std::string>> texts;
  std::vector<std::vector<std::uint8_t>> replies;

  void on_imu(const ImuSample& s) noexcept { imus.push_back(s); }
  void on_attitude(const AttitudeSample& s) noexcept { attitudes.push_back(s); }
  void on_heartbeat(const AutopilotStatus& s) noexcept { beats.push_back(s); }
  void on_ack(std::uint16_t command, std::uint8_t result) noexcept { acks.emplace_back(command, result); }
  void on_statustext(std::uint8_t severity, std::string_view text) noexcept { texts.emplace_back(severity, text); }
  void reply(std::span<const std::uint8_t> bytes) noexcept { replies.emplace_back(bytes.begin(), bytes.end()); }
};

class AutopilotLinkTest : public testing::Test {
 protected:
  template <class M>
  void hear(const M& message, TimeNs received_at_ns = kT0, Encoder* from = nullptr) {
    std::array<std::uint8_t, kMaxFrame> out{};
    const std::size_t n = (from != nullptr ? *from : autopilot_).encode(message, out);
    link_.receive(std::span(out).first(n), received_at_ns, heard_);
  }
  /// Ten exchanges with an autopilot whose clock is `offset_ns` ahead of ours, 1 ms each way, the last at `until_ns`.
  void synchronise(DurationNs offset_ns, TimeNs until_ns) {
    for (int i = 9; i >= 0; --i) {
      const TimeNs sent = until_ns - i * 100 * kMillisecond - 2 * kMillisecond;
      std::array<std::uint8_t, kMaxFrame> out{};
      ASSERT_GT(link_.encode_timesync_request(sent, out), 0u);
      Timesync answer;
      answer.ts1 = sent;
      answer.tc1 = sent + kMillisecond + offset_ns;
      hear(answer, sent + 2 * kMillisecond);
    }
  }
  template <class M>
  static M only(std::span<const std::uint8_t> bytes) {
    M message;
    int frames = 0;
    Parser parser;
    parser.feed(bytes, [&](const Frame& frame) noexcept {
      ++frames;
      EXPECT_TRUE(frame.is<M>());
      EXPECT_EQ(frame.system_id, 1);
      EXPECT_EQ(frame.component_id, 191);
      message = frame.as<M>();
    });
    EXPECT_EQ(frames, 1);
    return message;
  }

  AutopilotLink link_;
  Encoder autopilot_{1, 1};
  Recorder heard_;
};

HighresImu level_imu(std::uint64_t time_usec) {
  HighresImu m;
  m.time_usec = time_usec;
  m.zacc = -9.81f;
  m.xgyro = 0.1f;
  m.ymag = 0.4f;
  m.abs_pressure = 1013.25f;
  m.temperature = 25;
  m.fields_updated = 0x1fff;
  return m;
}

AttitudeQuaternion level_quaternion(float w = 1) {
  AttitudeQuaternion m;
  m.q1 = w;
  m.rollspeed = 0.25f;
  return m;
}

TEST_F(AutopilotLinkTest, HighresImuBecomesASample) {
  hear(level_imu(1));
  hear(level_imu(2));
  ASSERT_EQ(heard_.imus.size(), 2u);
  const ImuSample& s = heard_.imus[0];
  EXPECT_EQ(s.accel_body_mps2, (std::array<float, 3>{0, 0, -9.81f}));
  EXPECT_EQ(s.gyro_body_radps, (std::array<float, 3>{0.1f, 0, 0}));
  EXPECT_EQ(s.mag_body_gauss, (std::array<float, 3>{0, 0.4f, 0}));
  EXPECT_EQ(s.pressure_hpa, 1013.25f);
  EXPECT_EQ(s.temperature_degc, 25);
  EXPECT_EQ(s.fields, 0x1fffu);
  EXPECT_EQ(s.sequence, 0u);
  EXPECT_EQ(heard_.imus[1].sequence, 1u);
  EXPECT_EQ(s.exposed_at_ns, kT0) << "not synced: the arrival time";
  EXPECT_EQ(link_.counts().unmapped_times, 2u);
}

TEST_F(AutopilotLinkTest, RawImuOfArduPilotIsScaled) {
  RawImu m;
  m.zacc = -1000;
  m.xgyro = 500;
  m.zmag = -462;
  m.temperature = 4512;
  hear(m);
  ASSERT_EQ(heard_.imus.size(), 1u);
  EXPECT_FLOAT_EQ(heard_.imus[0].accel_body_mps2[2], -9.80665f);
  EXPECT_FLOAT_EQ(heard_.imus[0].gyro_body_radps[0], 0.5f);
  EXPECT_FLOAT_EQ(heard_.imus[0].mag_body_gauss[2], -0.462f);
  EXPECT_FLOAT_EQ(heard_.imus[0].temperature_degc, 45.12f);
  EXPECT_EQ(heard_.imus[0].fields, 0x11ffu | kFieldCoarse);
}

TEST_F(AutopilotLinkTest, WorseMessagesStepInOnlyWhenTheBestFallsSilent) {
  hear(RawImu{}, kT0);
  hear(ScaledImu{}, kT0);
  hear(level_imu(1), kT0 + 1);
  hear(ScaledImu{}, kT0 + 2);
  hear(RawImu{}, kT0 + kSecond);
  EXPECT_EQ(heard_.imus.size(), 3u);
  EXPECT_EQ(link_.counts().outranked_samples, 2u);
  hear(RawImu{}, kT0 + 2 + kSecond);
  EXPECT_EQ(heard_.imus.size(), 4u);

  hear(Attitude{}, kT0);
  hear(level_quaternion(), kT0 + 1);
  hear(Attitude{}, kT0 + 2);
  EXPECT_EQ(heard_.attitudes.size(), 2u);
}

TEST_F(AutopilotLinkTest, AttitudeFromAnglesEqualsAttitudeFromTheQuaternion) {
  const Quat q = quat_from_euler({0.3f, -0.2f, 2.0f});
  AttitudeQuaternion quaternion;
  quaternion.q1 = 1.1f * q.w();  // not quite normal
  quaternion.q2 = 1.1f * q.x();
  quaternion.q3 = 1.1f * q.y();
  quaternion.q4 = 1.1f * q.z();
  hear(quaternion, kT0);
  Attitude angles;
  angles.roll = 0.3f;
  angles.pitch = -0.2f;
  angles.yaw = 2.0f;
  hear(angles, kT0 + 2 * kSecond);
  ASSERT_EQ(heard_.attitudes.size(), 2u);
  float norm = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(heard_.attitudes[0].q_ned_body[i], heard_.attitudes[1].q_ned_body[i], 1e-6f);
    norm += heard_.attitudes[0].q_ned_body[i] * heard_.attitudes[0].q_ned_body[i];
  }
  EXPECT_NEAR(norm, 1.f, 1e-6f);
}

TEST_F(AutopilotLinkTest, NothingThatIsNotFiniteComesThrough) {
  for (const float bad : {kNaN, kInf, -kInf}) {
    HighresImu imu = level_imu(1);
    imu.yacc = bad;
    hear(imu);
    imu = level_imu(1);
    imu.zgyro = bad;
    hear(imu);
    hear(level_quaternion(bad));
    AttitudeQuaternion spinning = level_quaternion();
    spinning.yawspeed = bad;
    hear(spinning);
    Attitude attitude;
    attitude.pitch = bad;
    hear(attitude);
  }
  hear(level_quaternion(0));  // finite, but no direction
  EXPECT_TRUE(heard_.imus.empty());
  EXPECT_TRUE(heard_.attitudes.empty());
  EXPECT_EQ(link_.counts().refused_samples, 16u);
}

TEST_F(AutopilotLinkTest, ASideChannelThatIsNotFiniteIsCleared) {
  HighresImu imu = level_imu(1);
  imu.xmag = kNaN;
  imu.temperature = kInf;
  hear(imu);
  ASSERT_EQ(heard_.imus.size(), 1u);
  EXPECT_EQ(heard_.imus[0].mag_body_gauss, (std::array<float, 3>{}));
  EXPECT_EQ(heard_.imus[0].temperature_degc, 0);
  EXPECT_EQ(heard_.imus[0].fields, 0x1fffu & ~(kFieldMag | kFieldTemperature));
  EXPECT_EQ(link_.counts().partial_samples, 1u);
}

TEST_F(AutopilotLinkTest, HeartbeatAckAndText) {
  Heartbeat beat;
  beat.custom_mode = 6u << 16;
  beat.base_mode = mav_mode_flag::kSafetyArmed | mav_mode_flag::kCustomModeEnabled;
  beat.type = mav_type::kQuadrotor;
  beat.autopilot = mav_autopilot::kPx4;
  beat.system_status = mav_state::kActive;
  hear(beat, kT0 + 5);
  ASSERT_EQ(heard_.beats.size(), 1u);
  EXPECT_EQ(heard_.beats[0].custom_mode, 6u << 16);
  EXPECT_TRUE(heard_.beats[0].armed);
  EXPECT_EQ(heard_.beats[0].autopilot, mav_autopilot::kPx4);
  EXPECT_EQ(heard_.beats[0].received_at_ns, kT0 + 5);

  CommandAck ack;
  ack.command = mav_cmd::kComponentArmDisarm;
  ack.result = mav_result::kDenied;
  hear(ack);
  ack.target_system = 255;  // for the ground station
  hear(ack);
  ASSERT_EQ(heard_.acks.size(), 1u);
  EXPECT_EQ(heard_.acks[0], (std::pair<std::uint16_t, std::uint8_t>{400, 2}));
  EXPECT_EQ(link_.counts().not_for_us, 1u);

  Statustext text;
  text.severity = mav_severity::kWarning;
  text.text.fill('x');
  hear(text);
  text.text[3] = 0;
  hear(text);
  ASSERT_EQ(heard_.texts.size(), 2u);
  EXPECT_EQ(heard_.texts[0].second, std::string(50, 'x'));
  EXPECT_EQ(heard_.texts[1].second, "xxx");
}

TEST_F(AutopilotLinkTest, HearsNobodyElse) {
  Encoder other_vehicle(2, 1), gimbal(1, 154), ourselves(1, 191);
  for (Encoder* sender : {&other_vehicle, &gimbal, &ourselves}) {
    hear(level_imu(1), kT0, sender);
    hear(Heartbeat{}, kT0, sender);
    hear(Timesync{0, 99}, kT0, sender);
  }
  EXPECT_TRUE(heard_.imus.empty());
  EXPECT_TRUE(heard_.beats.empty());
  EXPECT_TRUE(heard_.replies.empty());
  EXPECT_EQ(link_.counts().foreign_systems, 3u);
  EXPECT_EQ(link_.counts().other_components, 3u);
  EXPECT_EQ(link_.counts().own_echoes, 3u);
}

TEST_F(AutopilotLinkTest, AnswersTimesyncPingAndCommands) {
  hear(Timesync{0, 777}, kT0);
  Ping ping;
  ping.seq = 4;
  hear(ping);
  CommandLong command;
  command.command = mav_cmd::kRequestMessage;
  command.target_system = 1;
  command.target_component = 191;
  Encoder station(255, 190);
  hear(command, kT0, &station);
  command.target_component = 1;  // for the autopilot, overheard
  hear(command, kT0, &station);
  ASSERT_EQ(heard_.replies.size(), 3u);
  const auto sync = only<Timesync>(heard_.replies[0]);
  EXPECT_EQ(sync.ts1, 777);
  EXPECT_EQ(sync.tc1, kT0);
  EXPECT_EQ(sync.target_system, 1);
  EXPECT_EQ(sync.target_component, 1);
  EXPECT_EQ(only<Ping>(heard_.replies[1]).target_system, 1);
  const auto ack = only<CommandAck>(heard_.replies[2]);
  EXPECT_EQ(ack.command, mav_cmd::kRequestMessage);
  EXPECT_EQ(ack.result, mav_result::kUnsupported);
  EXPECT_EQ(ack.target_system, 255);
}

TEST_F(AutopilotLinkTest, MapsAutopilotTimeToOurs) {
  constexpr DurationNs kOffset = -9'000 * kSecond;
  synchronise(kOffset, kT0);
  EXPECT_TRUE(link_.clock().synced());
  const auto usec = [&](TimeNs ours) { return static_cast<std::uint64_t>((ours + kOffset) / kMicrosecond); };
  hear(level_imu(usec(kT0 + 3 * kMillisecond)), kT0 + 5 * kMillisecond);
  hear(level_imu(usec(kT0 + 20 * kMillisecond)), kT0 + 19 * kMillisecond);  // from the future, by the map's error
  hear(level_imu(usec(kT0 - 5 * kSecond)), kT0 + 21 * kMillisecond);        // a stale stamp is not believed
  ASSERT_EQ(heard_.imus.size(), 3u);
  EXPECT_NEAR(static_cast<double>(heard_.imus[0].exposed_at_ns - kT0), 3e6, 2e3);
  EXPECT_EQ(heard_.imus[1].exposed_at_ns, kT0 + 19 * kMillisecond);
  EXPECT_EQ(heard_.imus[2].exposed_at_ns, kT0 + 21 * kMillisecond);
}

TEST_F(AutopilotLinkTest, AnswersItDidNotAskForDoNotMoveTheClock) {
  for (int i = 0; i < 10; ++i) hear(Timesync{5 * kSecond, kT0 + i}, kT0 + kMillisecond + i);
  EXPECT_FALSE(link_.clock().synced());
  EXPECT_EQ(link_.counts().timesync_refused, 10u);
  EXPECT_EQ(link_.counts().timesync_accepted, 0u);
}

TEST_F(AutopilotLinkTest, ARebootIsSeenInTheStreamAtOnce) {
  synchronise(-1000 * kSecond, kT0);
  hear(level_imu(9'000'000'000), kT0);
  EXPECT_TRUE(link_.clock().synced());
  hear(level_imu(2'000'000), kT0 + 3 * kSecond);  // their clock began anew
  EXPECT_FALSE(link_.clock().synced());
  EXPECT_EQ(link_.counts().clock_restarts, 1u);
  EXPECT_EQ(heard_.imus.back().exposed_at_ns, kT0 + 3 * kSecond);
  synchronise(-(kT0 + kSecond), kT0 + 10 * kSecond);
  EXPECT_TRUE(link_.clock().synced());
}

TEST_F(AutopilotLinkTest, AttitudeTarget) {
  std::array<std::uint8_t, kMaxFrame> out{};
  AttitudeTargetCommand target;
  target.q_ned_body = {0.5f, 0.5f, -0.5f, 0.5f};
  target.thrust = 0.6f;
  auto m =
      only<SetAttitudeTarget>(std::span(out).first(link_.encode_attitude_target(target, 1234 * kMillisecond, out)));
  EXPECT_EQ(m.type_mask, 7);
  EXPECT_EQ(m.q, target.q_ned_body);
  EXPECT_EQ(m.thrust, 0.6f);
  EXPECT_EQ(m.time_boot_ms, 1234u);
  EXPECT_EQ(m.target_system, 1);
  EXPECT_EQ(m.target_component, 1);

  synchronise(-9'000 * kSecond, kT0);
  target.use_yaw_rate = true;
  target.yaw_rate_radps = 0.2f;
  m = only<SetAttitudeTarget>(std::span(out).first(link_.encode_attitude_target(target, kT0, out)));
  EXPECT_EQ(m.type_mask, 3);
  EXPECT_EQ(m.body_yaw_rate, 0.2f);
  EXPECT_NEAR(m.time_boot_ms, 1'000'000u, 1);
}

TEST_F(AutopilotLinkTest, ASetpointThatIsNotFiniteIsNotEncoded) {
  std::array<std::uint8_t, kMaxFrame> out{};
  for (const float bad : {kNaN, kInf, -kInf}) {
    for (std::size_t i = 0; i < 4; ++i) {
      AttitudeTargetCommand target;
      target.q_ned_body[i] = bad;
      EXPECT_EQ(link_.encode_attitude_target(target, 0, out), 0u);
    }
    AttitudeTargetCommand target;
    target.thrust = bad;
    EXPECT_EQ(link_.encode_attitude_target(target, 0, out), 0u);
    target.thrust = 0;
    target.yaw_rate_radps = bad;
    EXPECT_EQ(link_.encode_attitude_target(target, 0, out), 0u);
  }
  EXPECT_EQ(link_.encode_attitude_target({}, 0, std::span(out).first(20)), 0u) << "no room";
}

TEST_F(AutopilotLinkTest, HeartbeatAndCommandsOut) {
  std::array<std::uint8_t, kMaxFrame> out{};
  const auto beat = only<Heartbeat>(
      std::span(out).first(link_.encode_heartbeat({FlightMode::kHold, ModeReason::kCueLost, false, 3}, out)));
  EXPECT_EQ(beat.type, 18);
  EXPECT_EQ(beat.autopilot, 8);
  EXPECT_EQ(beat.mavlink_version, 3);
  EXPECT_EQ(beat.system_status, mav_state::kCritical);
  EXPECT_EQ(companion_state_of(beat.custom_mode), (CompanionState{FlightMode::kHold, ModeReason::kCueLost, false, 3}));
  const auto arm = only<CommandLong>(std::span(out).first(link_.encode_arm(true, 2, out)));
  EXPECT_EQ(arm.command, 400);
  EXPECT_EQ(arm.param1, 1);
  EXPECT_EQ(arm.confirmation, 2);
  EXPECT_EQ(arm.target_system, 1);
  const auto mode = only<CommandLong>(std::span(out).first(link_.encode_set_mode(6, 0, 0, out)));
  EXPECT_EQ(mode.command, 176);
  EXPECT_EQ(mode.param1, 1);
  EXPECT_EQ(mode.param2, 6);
  const auto rate =
      only<CommandLong>(std::span(out).first(link_.encode_message_interval(105, 4 * kMillisecond, 0, out)));
  EXPECT_EQ(rate.command, 511);
  EXPECT_EQ(rate.param1, 105);
  EXPECT_EQ(rate.param2, 4000);
}

}  // namespace
}  // namespace wasp::drivers
