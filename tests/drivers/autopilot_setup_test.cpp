// The check before arming against a made-up autopilot: what is asked, in which order and how often, in both encodings;
// what follows from the answers; and what is asked anew.
#include "drivers/autopilot_setup.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "messages/mavlink_frame.h"

namespace wasp::drivers {
namespace {

/// An autopilot of parameters and a heartbeat, on virtual time.
class Autopilot {
 public:
  explicit Autopilot(Flavour flavour, SetupWish wish = {}) : flavour_(flavour), setup_(with(wish, flavour), {}) {
    if (flavour == Flavour::kPx4)
      parameters = {{"MPC_THR_HOVER", {0.42, 9}},
                    {"COM_OF_LOSS_T", {1, 9}},
                    {"COM_OBL_RC_ACT", {4, 6}},
                    {"MAV_FWDEXTSP", {1, 6}}};
    else
      parameters = {{"GUID_OPTIONS", {0, 6}},  {"WPNAV_SPEED_UP", {300, 9}}, {"WPNAV_SPEED_DN", {150, 9}},
                    {"FRAME_CLASS", {1, 2}},   {"ARMING_CHECK", {1, 6}},     {"SYSID_ENFORCE", {0, 2}},
                    {"SYSID_MYGCS", {255, 4}}, {"ANGLE_MAX", {3000, 4}}};
    mav_autopilot = flavour == Flavour::kPx4 ? 12 : 3;
  }

  struct Value {
    double value;
    std::uint8_t type;
  };
  std::map<std::string, Value> parameters;
  std::uint8_t mav_autopilot = 3;
  bool armed = false, deaf = false, streams = true;
  std::uint32_t version = 0x040500ff;
  int lose_every = 0;  ///< of questions

  void run(double seconds) {
    for (int i = 0; i < seconds * 50; ++i, now_ns_ += 20 * kMillisecond) {
      if (!deaf && i % 10 == 0) setup_.on_heartbeat({now_ns_, 0, 0, armed, 3, 2, mav_autopilot});
      if (streams && i % 2 == 0) setup_.on_attitude(now_ns_);
      std::array<std::uint8_t, mavlink::kMaxFrame> out{};
      const std::size_t n = setup_.next_question(now_ns_, link_, out);
      parser_.feed(std::span(out).first(n), [&](const mavlink::Frame& f) { hear(f); });
      TextLine line;
      bool verdict = false;
      if (setup_.take_news(line, verdict)) log.emplace_back(line.view());
    }
  }
  bool said(const std::string& words) const {
    return std::any_of(log.begin(), log.end(), [&](const auto& l) { return l.find(words) != std::string::npos; });
  }
  AutopilotSetup& setup() { return setup_; }
  std::vector<std::string> log;
  std::map<std::string, int> asked;
  std::vector<std::uint32_t> intervals;
  int old_streams = 0;
  float position_interval_us = 0;
  bool takes_writes = false;

 private:
  static SetupWish with(SetupWish wish, Flavour flavour) {
    wish.flavour = flavour;
    wish.mode = facts_of(flavour).own_mode;
    wish.stream_hz = 25;
    return wish;
  }
  template <class M>
  void answer(const M& m) {
    std::array<std::uint8_t, mavlink::kMaxFrame> out{};
    mavlink::Encoder encoder(1, 1);
    mavlink::Parser parser;
    parser.feed(std::span(out).first(encoder.encode(m, out)), [&](const mavlink::Frame& f) { setup_.on_frame(f); });
  }
  void hear(const mavlink::Frame& f) {
    if (f.is<mavlink::RequestDataStream>()) ++old_streams;
    if (f.is<mavlink::CommandLong>()) {
      const auto c = f.as<mavlink::CommandLong>();
      if (c.command == 511) intervals.push_back(static_cast<std::uint32_t>(c.param1));
      if (c.command == 511 && intervals.back() == mavlink::LocalPositionNed::kId) position_interval_us = c.param2;
      if (c.command == 512 && version != 0) {
        mavlink::AutopilotVersion v;
        v.flight_sw_version = version;
        v.capabilities = capability_of(facts_of(flavour_).encoding);
        answer(v);
      }
    }
    if (f.is<mavlink::ParamSet>() && takes_writes) {
      const auto m = f.as<mavlink::ParamSet>();
      auto& row = parameters.at(std::string(name_of(m.param_id)));
      row.value = decode_parameter(facts_of(flavour_).encoding, m.param_type, m.param_value).value();
      mavlink::ParamValue v;
      v.param_id = m.param_id, v.param_type = row.type, v.param_value = m.param_value;
      answer(v);
    }
    if (!f.is<mavlink::ParamRequestRead>()) return;
    const std::string name(name_of(f.as<mavlink::ParamRequestRead>().param_id));
    ++asked[name];
    if (lose_every > 0 && (++questions_ * 2654435761u >> 16) % static_cast<unsigned>(lose_every) != 0) return;
    const auto row = parameters.find(name);
    if (row == parameters.end()) return;
    mavlink::ParamValue v;
    v.param_id = parameter_name(name);
    v.param_type = row->second.type;
    v.param_value = *encode_parameter(facts_of(flavour_).encoding, v.param_type, row->second.value);
    answer(v);
  }

  Flavour flavour_;
  AutopilotSetup setup_;
  AutopilotLink link_;
  mavlink::Parser parser_;
  TimeNs now_ns_ = 100 * kSecond;
  unsigned questions_ = 0;
};

TEST(AutopilotSetup, WaspAsksNothing) {
  Autopilot a(Flavour::kWasp);
  a.run(2);
  EXPECT_EQ(a.setup().bar(), SetupBar::kNone);
  EXPECT_TRUE(a.asked.empty() && a.intervals.empty() && a.log.empty());
}

TEST(AutopilotSetup, ReadsAPx4AndTakesItsHoverThrust) {
  Autopilot a(Flavour::kPx4);
  a.run(0.1);
  EXPECT_EQ(a.setup().bar(), SetupBar::kAsking);
  a.run(6);
  EXPECT_EQ(a.setup().bar(), SetupBar::kNone);
  const AutopilotSemantics& s = a.setup().semantics();
  EXPECT_EQ(s.vertical, VerticalChannel::kThrust);
  EXPECT_NEAR(s.hover_share, 0.42f, 1e-6f);
  EXPECT_TRUE(s.learn_hover && s.heading_by_angle && s.heading_rate_used && s.silent_when_left);
  EXPECT_TRUE(a.said("COM_OBL_RC_ACT = 4: it lands")) << "an integer, byte-wise";
  EXPECT_TRUE(a.said("COM_OBL_ACT is absent"));
  EXPECT_TRUE(a.said("ready; its failsafe: after 1 s it lands (COM_OBL_RC_ACT 4)"));
  EXPECT_NE(std::find(a.intervals.begin(), a.intervals.end(), mavlink::AttitudeQuaternion::kId), a.intervals.end());
}

TEST(AutopilotSetup, ReadsAnArduCopterAndItsClimbRates) {
  Autopilot a(Flavour::kArduPilot);
  a.run(6);
  EXPECT_EQ(a.setup().bar(), SetupBar::kNone);
  const AutopilotSemantics& s = a.setup().semantics();
  EXPECT_EQ(s.vertical, VerticalChannel::kClimbRate);
  EXPECT_FLOAT_EQ(s.climb_at_full_mps, 3.f);
  EXPECT_FLOAT_EQ(s.sink_at_zero_mps, 1.5f);
  EXPECT_FALSE(s.heading_rate_used) << "a yaw rate alone is dropped by its newer versions";
  EXPECT_FLOAT_EQ(climb_field(s, 0.f), 0.5f);
  EXPECT_FLOAT_EQ(climb_field(s, 3.f), 1.f);
  EXPECT_FLOAT_EQ(climb_field(s, -0.75f), 0.25f);
  EXPECT_TRUE(a.said("stays in the mode"));
}

TEST(AutopilotSetup, LostQuestionsAreAskedAgain) {
  Autopilot a(Flavour::kArduPilot);
  a.lose_every = 4;
  a.run(12);
  EXPECT_EQ(a.setup().bar(), SetupBar::kNone);
  EXPECT_GT(a.asked["WPNAV_SPEED_UP"], 1);
}

struct Refusal {
  Flavour flavour;
  const char* name;
  double value;
  const char* words;
};
class Refuses : public ::testing::TestWithParam<Refusal> {};

TEST_P(Refuses, NamingParameterValueAndWhatToSet) {
  Autopilot a(GetParam().flavour);
  a.parameters[GetParam().name].value = GetParam().value;
  if (a.parameters[GetParam().name].type == 0) a.parameters[GetParam().name].type = 6;
  a.run(6);
  EXPECT_EQ(a.setup().bar(), SetupBar::kRefused);
  EXPECT_TRUE(a.said(std::string("not arming: ") + GetParam().name)) << a.log.back();
  EXPECT_TRUE(a.said(GetParam().words)) << a.log.back();
}

INSTANTIATE_TEST_SUITE_P(Table, Refuses,
                         ::testing::Values(Refusal{Flavour::kPx4, "COM_OBL_RC_ACT", 7, "set it to 4"},
                                           Refusal{Flavour::kPx4, "COM_OF_LOSS_T", 30, "set it to 1"},
                                           Refusal{Flavour::kPx4, "MAV_FWDEXTSP", 0, "set it to 1"},
                                           Refusal{Flavour::kPx4, "COM_OBL_ACT", 3, "set it to 0"},
                                           Refusal{Flavour::kArduPilot, "FRAME_CLASS", 0, "set it to 1"},
                                           Refusal{Flavour::kArduPilot, "GUID_TIMEOUT", 20, "set it to 1"},
                                           Refusal{Flavour::kArduPilot, "ANGLE_MAX", 1000, "max_tilt_deg"}),
                         [](const auto& of) { return std::string(of.param.name); });

TEST(AutopilotSetup, AnotherGroundStationAloneIsHeard) {
  Autopilot a(Flavour::kArduPilot);
  a.parameters["SYSID_ENFORCE"].value = 1;
  a.run(6);
  EXPECT_TRUE(a.said("not arming: SYSID_MYGCS = 255"));
}

TEST(AutopilotSetup, ARefusalIsOnlySaidWhereTheUserWantsItSo) {
  SetupWish wish;
  wish.enforce = false;
  Autopilot a(Flavour::kPx4, wish);
  a.parameters["COM_OBL_RC_ACT"].value = 7;
  a.run(6);
  EXPECT_EQ(a.setup().bar(), SetupBar::kNone);
  EXPECT_TRUE(a.said("check only warns: COM_OBL_RC_ACT = 7"));
}

TEST(AutopilotSetup, WhoAnswersNothingIsNotFlown) {
  Autopilot px4(Flavour::kPx4), copter(Flavour::kArduPilot);
  px4.parameters.clear();
  copter.parameters.clear();
  px4.run(8);
  copter.run(8);
  EXPECT_EQ(px4.setup().bar(), SetupBar::kRefused);
  EXPECT_EQ(copter.setup().bar(), SetupBar::kRefused);
  EXPECT_LE(px4.asked["COM_OF_LOSS_T"], AutopilotSetup::kTries + 4) << "from then on only now and then";
}

TEST(AutopilotSetup, AnAnswerThatComesLateCountsAllTheSame) {
  Autopilot a(Flavour::kArduPilot);
  const auto parameters = std::exchange(a.parameters, {});
  a.run(8);
  ASSERT_EQ(a.setup().bar(), SetupBar::kRefused);
  a.parameters = parameters;
  a.run(10);
  EXPECT_EQ(a.setup().bar(), SetupBar::kNone);
}

TEST(AutopilotSetup, StreamsThatSomebodyElseSlowedDownAreAskedForAtOnce) {
  Autopilot a(Flavour::kArduPilot);
  a.run(6);
  a.intervals.clear();
  a.streams = false;
  a.run(0.3);
  EXPECT_EQ(std::count(a.intervals.begin(), a.intervals.end(), mavlink::Attitude::kId), 1);
  a.run(2);
  EXPECT_LE(std::count(a.intervals.begin(), a.intervals.end(), mavlink::Attitude::kId), 5) << "twice a second";
}

TEST(AutopilotSetup, ThePositionComesAsOftenAsItIsWanted) {
  SetupWish wish;
  wish.position_hz = 22;
  Autopilot a(Flavour::kPx4, wish);
  a.run(4);
  EXPECT_GE(a.position_interval_us, 45'000);
  EXPECT_LE(a.position_interval_us, 46'000);
  EXPECT_EQ(std::count(a.intervals.begin(), a.intervals.end(), mavlink::Heartbeat::kId), 0) << "PX4 keeps its own";
}

TEST(AutopilotSetup, WhatKeepsPx4FromTheModeOrFromArmingIsSaid) {
  Autopilot a(Flavour::kPx4);
  a.parameters["COM_RCL_EXCEPT"] = {0, 6};
  a.parameters["NAV_DLL_ACT"] = {2, 6};
  a.parameters["COM_OBL_RC_ACT"].value = 0;
  a.run(6);
  EXPECT_TRUE(a.said("COM_RCL_EXCEPT = 0: without a radio, releases before 1.14 never enter OFFBOARD; 4 lets them"));
  EXPECT_TRUE(a.said("NAV_DLL_ACT = 2: it arms only while a ground station is connected"));
  EXPECT_TRUE(a.said("COM_OBL_RC_ACT = 0: position mode, without a radio return"));
}

TEST(AutopilotSetup, ThrustIsThrustOnlyWhereThatVersionSaysSo) {
  const auto vertical = [](std::uint32_t version, double guid, double dev) {
    Autopilot a(Flavour::kArduPilot);
    a.version = version;
    a.parameters["GUID_OPTIONS"] = {guid, 6};
    a.parameters["DEV_OPTIONS"] = {dev, 6};
    a.run(6);
    return a.setup().bar() == SetupBar::kNone ? static_cast<int>(a.setup().semantics().vertical) : -1;
  };
  constexpr int kThrust = 0, kClimb = 1;
  EXPECT_EQ(vertical(0x040500ff, 8, 0), kThrust);
  EXPECT_EQ(vertical(0x040500ff, 0, 4), kClimb) << "DEV_OPTIONS has no such bit any more";
  EXPECT_EQ(vertical(0x04010000, 0, 4), kThrust) << "4.1-dev";
  EXPECT_EQ(vertical(0x04010000, 1077936128, 0), kClimb) << "a default that was never set";
  EXPECT_EQ(vertical(0x04010000, 8, 0), -1) << "cannot be told: refused";
}

TEST(AutopilotSetup, AValueThatMeansNothingIsWrittenExplicitly) {
  Autopilot a(Flavour::kArduPilot);
  a.version = 0x04010000;
  a.takes_writes = true;
  a.parameters["GUID_OPTIONS"] = {520, 6};
  a.parameters["DEV_OPTIONS"] = {0, 6};
  a.run(8);
  EXPECT_EQ(a.parameters["GUID_OPTIONS"].value, 512);
  EXPECT_EQ(a.setup().bar(), SetupBar::kNone);
  EXPECT_EQ(a.setup().semantics().vertical, VerticalChannel::kClimbRate);
  EXPECT_TRUE(a.said("GUID_OPTIONS = 512"));
}

TEST(AutopilotSetup, TheWrongAutopilotIsNamed) {
  Autopilot a(Flavour::kPx4);
  a.mav_autopilot = 3;
  a.run(3);
  EXPECT_EQ(a.setup().bar(), SetupBar::kOtherAutopilot);
  EXPECT_TRUE(a.said("set it to ardupilot"));
  EXPECT_TRUE(a.asked.empty());
}

TEST(AutopilotSetup, AStreamThatDoesNotComeBarsArmingAndIsAskedForAgainBothWays) {
  Autopilot a(Flavour::kArduPilot);
  a.streams = false;
  a.run(10);
  EXPECT_EQ(a.setup().bar(), SetupBar::kNoAttitude);
  EXPECT_GE(std::count(a.intervals.begin(), a.intervals.end(), mavlink::Attitude::kId), 2);
  EXPECT_GE(a.old_streams, 3);
  a.streams = true;
  a.run(3);
  EXPECT_EQ(a.setup().bar(), SetupBar::kNone);
}

TEST(AutopilotSetup, WhatAGroundStationChangesOnTheGroundCounts) {
  Autopilot a(Flavour::kPx4);
  a.run(6);
  a.parameters["COM_OBL_RC_ACT"].value = 7;
  a.run(5);
  EXPECT_EQ(a.setup().bar(), SetupBar::kRefused);
  a.parameters["COM_OBL_RC_ACT"].value = 3;
  a.run(5);
  EXPECT_EQ(a.setup().bar(), SetupBar::kNone);
  EXPECT_TRUE(a.said("COM_OBL_RC_ACT = 3: return"));
  const int before = a.asked["COM_OBL_RC_ACT"];
  a.armed = true;
  a.run(5);
  EXPECT_EQ(a.asked["COM_OBL_RC_ACT"], before) << "in flight nothing is read";
}

TEST(AutopilotSetup, AfterARebootEverythingIsAskedAgain) {
  Autopilot a(Flavour::kPx4);
  a.run(6);
  ASSERT_EQ(a.setup().bar(), SetupBar::kNone);
  const auto asked_before = a.intervals.size();
  a.setup().restart();
  EXPECT_EQ(a.setup().bar(), SetupBar::kAsking);
  EXPECT_NEAR(a.setup().semantics().hover_share, 0.42f, 1e-6f) << "what was in force stays until the answers are new";
  a.run(6);
  EXPECT_EQ(a.setup().bar(), SetupBar::kNone);
  EXPECT_GT(a.intervals.size(), asked_before);
  a.deaf = true;
  a.run(4);
  a.deaf = false;
  a.run(0.1);
  EXPECT_EQ(a.setup().bar(), SetupBar::kAsking) << "heartbeats came back after a silence";
}

}  // namespace
}  // namespace wasp::drivers
