// The link thread on a pseudo-terminal, with the test as the autopilot: what must not reach the rings, who counts as
// heard, and what the log hears of an autopilot that refuses, was started again, or is another one.
#include "scheduling/link_loop.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>

#include "tests/scheduling/control_bench.h"

namespace wasp::scheduling {
namespace {

class LinkLoopTest : public ::testing::Test {
 protected:
  LinkLoopTest()
      : instance_("test-link-" + std::to_string(getpid())),
        flight_(create_flight_region(instance_, {}, false)),
        port_(drivers::Endpoint::parse(line_.endpoint())),
        loop_(flight_, port_, link_, stage_table(flight_), report_, events_, board_.add({"link", -1, 0, kMillisecond})),
        attitude_(flight_, shm::kAttitude, "Attitude"),
        imu_(flight_, shm::kImu, "Imu") {
    control_.status = &run_status(flight_);
    thread_ = std::thread([this] { loop_.run(control_); });
  }
  ~LinkLoopTest() override {
    control_.stop = true;
    thread_.join();
    shm::Region::remove(flight_.name());
  }

  template <class M>
  void say(const M& message, std::uint8_t system = 1) {
    mavlink::Encoder encoder(system, 1);
    std::array<std::uint8_t, mavlink::kMaxFrame> out{};
    line_.write(std::span(out).first(encoder.encode(message, out)));
  }
  void beat(std::uint32_t custom_mode = 1, bool armed = true, std::uint8_t system = 1) {
    mavlink::Heartbeat m;
    m.custom_mode = custom_mode;
    m.base_mode = armed ? mavlink::mav_mode_flag::kSafetyArmed : std::uint8_t{0};
    say(m, system);
  }
  void turn(float yaw_rad) {
    mavlink::AttitudeQuaternion m;
    m.q1 = std::cos(yaw_rad / 2), m.q4 = std::sin(yaw_rad / 2);
    say(m);
  }
  static void rest() { rt::sleep_until(rt::now() + 2 * kMillisecond); }
  template <class Condition>
  static bool soon(Condition&& condition) {
    for (int i = 0; i < 15'000; ++i, rest())
      if (condition()) return true;
    return false;
  }
  int said(const std::string& words) {
    Event e;
    while (events_.take(e)) texts_.emplace_back(e.text.data());
    return static_cast<int>(
        std::count_if(texts_.begin(), texts_.end(), [&](const auto& t) { return t.find(words) != std::string::npos; }));
  }
  LinkReport report() {
    LinkReport r;
    report_.load(r);  // nothing stored: never heard
    return r;
  }
  std::uint64_t refused() { return run_status(flight_).samples_refused.load(); }
  /// Answers questions for the time with a clock `offset_ns` ahead; collects commands.
  void answer(DurationNs offset_ns) {
    std::vector<mavlink::Timesync> questions;
    const auto bytes = line_.read();
    parser_.feed(bytes, [&](const mavlink::Frame& f) {
      if (f.is<mavlink::Timesync>() && f.as<mavlink::Timesync>().tc1 == 0)
        questions.push_back(f.as<mavlink::Timesync>());
      if (f.is<mavlink::CommandLong>()) commands_.push_back(f.as<mavlink::CommandLong>());
    });
    for (mavlink::Timesync& q : questions) {
      q.tc1 = rt::now() + offset_ns;
      say(q);
      ++answers_;
    }
  }

  std::string instance_;
  PtyLine line_;
  shm::Region flight_;
  drivers::LinePort port_;
  drivers::AutopilotLink link_;
  rt::Seqlock<LinkReport> report_;
  EventQueue events_;
  WatchBoard board_;
  LinkLoop loop_;
  LoopControl control_;
  shm::RingReader attitude_, imu_;
  mavlink::Parser parser_;
  std::vector<mavlink::CommandLong> commands_;
  std::vector<std::string> texts_;
  int answers_ = 0;
  std::thread thread_;
};

TEST_F(LinkLoopTest, WhatIsNotFiniteOrBeyondASensorNeverReachesTheRing) {
  mavlink::HighresImu m;
  m.zacc = -9.81f;
  say(m);
  ASSERT_TRUE(soon([&] { return imu_.newest() == 1; }));
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 500.f}) {
    m.xacc = bad;
    say(m);
  }
  ASSERT_TRUE(soon([&] { return refused() == 3; }));
  m.xacc = 0.5f;
  say(m);
  ASSERT_TRUE(soon([&] { return imu_.newest() == 2; }));
  EXPECT_EQ(said("sample refused: not finite"), 1);
  EXPECT_EQ(said("imu refused: out of a sensor's range"), 1);
}

TEST_F(LinkLoopTest, AnAttitudeThatStandsStillToTheBitStopsReachingTheRing) {
  turn(0.1f);
  ASSERT_TRUE(soon([&] { return attitude_.newest() == 1; }));
  ASSERT_TRUE(soon([&] {
    turn(0.2f);
    return refused() > 0;
  }));
  const std::uint64_t last = attitude_.newest();
  EXPECT_TRUE(soon([&] { return said("attitude refused: frozen") == 1; }));
  for (int i = 0; i < 20; ++i, rest()) turn(0.2f);
  ASSERT_TRUE(soon([&] { return refused() >= 20; }));
  EXPECT_EQ(attitude_.newest(), last);
  turn(0.21f);
  EXPECT_TRUE(soon([&] { return attitude_.newest() == last + 1; }));
  EXPECT_EQ(said("attitude refused: frozen"), 1);
}

TEST_F(LinkLoopTest, AJumpOfTheAttitudeIsRefusedUntilItStays) {
  turn(0.1f);
  ASSERT_TRUE(soon([&] { return attitude_.newest() == 1; }));
  for (int i = 0; i < 4; ++i) turn(2.f + 0.001f * static_cast<float>(i));
  ASSERT_TRUE(soon([&] { return refused() == 4; }));
  EXPECT_EQ(attitude_.newest(), 1u);
  turn(2.f);
  EXPECT_TRUE(soon([&] { return attitude_.newest() == 2; }));
  EXPECT_EQ(said("attitude refused: a jump"), 1);
}

TEST_F(LinkLoopTest, OnlyTheAutopilotItselfCountsAsHeardAndAStrangerInItsPlaceIsReported) {
  beat(1, true, 7);
  EXPECT_TRUE(soon([&] {
    beat(1, true, 7);
    return said("another system speaks") == 1;
  }));
  EXPECT_EQ(report().heard_at_ns, kNever);
  beat(5, true);
  ASSERT_TRUE(soon([&] { return report().heard_at_ns != kNever; }));
  EXPECT_EQ(report().custom_mode, 5u);
  const TimeNs heard_ns = report().heard_at_ns;
  for (int i = 0; i < 20; ++i, rest()) beat(9, false, 7);
  EXPECT_EQ(report().heard_at_ns, heard_ns);  // its words are not the autopilot's
  EXPECT_EQ(report().custom_mode, 5u);
  EXPECT_EQ(report().armed, 1u);
}

TEST_F(LinkLoopTest, ARefusalIsReportedByItsName) {
  mavlink::CommandAck ack;
  ack.command = mavlink::mav_cmd::kComponentArmDisarm;
  ack.result = mavlink::mav_result::kDenied;
  say(ack);
  EXPECT_TRUE(soon([&] { return said("autopilot refuses to arm or disarm, MAV_RESULT 2") == 1; }));
  ack.command = mavlink::mav_cmd::kDoSetMode;
  ack.result = mavlink::mav_result::kFailed;
  say(ack);
  EXPECT_TRUE(soon([&] { return said("autopilot refuses our mode, MAV_RESULT 4") == 1; }));
  ack.result = mavlink::mav_result::kTemporarilyRejected;
  say(ack);
  EXPECT_TRUE(soon([&] { return said("autopilot not yet ready for command 176") == 1; }));
  ack.result = mavlink::mav_result::kAccepted;
  say(ack);
  rest();
  EXPECT_EQ(said("refuses"), 2);
}

TEST_F(LinkLoopTest, AnAutopilotThatWasStartedAgainIsReportedAndAskedForItsHeartbeatsAgain) {
  const auto asked = [&] {
    return std::count_if(commands_.begin(), commands_.end(), [](const auto& c) {
      return c.command == mavlink::mav_cmd::kSetMessageInterval && c.param1 == 0.f && c.param2 == 200e3f;
    });
  };
  beat();
  ASSERT_TRUE(soon([&] {
    answer(500 * kSecond);
    return asked() == 1 && answers_ >= 6;  // three match the clocks
  }));
  EXPECT_EQ(said("clock began anew"), 0);
  const DurationNs up_since_ns = 5 * kSecond - rt::now();  // it has been up for five seconds
  ASSERT_TRUE(soon([&] {
    answer(up_since_ns);
    beat(0, false);
    return said("the autopilot's clock began anew") == 1 && asked() == 2;
  }));
  EXPECT_TRUE(soon([&] { return report().armed == 0; }));
}

}  // namespace
}  // namespace wasp::scheduling
