// The simulated autopilot as PX4 and as ArduCopter, met by wasp's own link on virtual time: who is let into the mode,
// what a setpoint does there, what follows when setpoints end, what a reboot forgets.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "drivers/autopilot_link.h"
#include "drivers/autopilot_setup.h"
#include "sim/simulator.h"

namespace wasp::sim {
namespace {

using drivers::facts_of;

constexpr float kDegree = 0.01745329f;

/// A companion computer that sends setpoints at 20 Hz, as told.
class Companion {
 public:
  explicit Companion(Flavour flavour, std::vector<std::string> parameters = {})
      : flavour_(flavour), simulator_(config(flavour, std::move(parameters))) {
    drivers::SetupWish wish;
    wish.flavour = flavour;
    wish.mode = facts_of(flavour).own_mode;
    setup_ = std::make_unique<drivers::AutopilotSetup>(wish, drivers::LinkIdentity{});
  }

  bool streaming = false, setting_up = false, masked = false;
  float roll_rad = 0, pitch_rad = 0, yaw_rad = 0, field = 0;
  bool yaw_rate_alone = false;

  void run(double seconds) {
    for (int i = 0; i < seconds * 200; ++i) {
      const TimeNs now_ns = simulator_.now_ns() + kControlPeriod_ns;
      simulator_.advance_to(now_ns);
      if (streaming && i % 10 == 0) send_setpoint(now_ns);
      if (setting_up && i % 4 == 0) ask(now_ns);
      bytes_.clear();
      simulator_.drain(bytes_);
      link_.receive(bytes_, now_ns, *this);
    }
  }
  std::uint8_t command_mode(std::uint32_t mode) {
    give(link_.encode_set_mode(mode, 0, 0, out_));
    run(0.02);
    return result_;
  }
  std::uint8_t enter() { return command_mode(facts_of(flavour_).own_mode); }
  std::uint8_t arm(bool arm = true) {
    give(link_.encode_arm(arm, 0, out_));
    run(0.02);
    return result_;
  }
  void reboot() {
    give(link_.encode_command(246, {1, 0, 0, 0, 0, 20190226.f}, 0, out_));
    run(0.01);
  }
  /// Enters, arms, and is at about two metres.
  void take_off() {
    streaming = true;
    run(5.0);
    ASSERT_EQ(enter(), 0);
    ASSERT_EQ(arm(), 0);
    const bool climb = flavour_ == Flavour::kArduPilot;
    field = climb ? 0.6f : hover() * 1.08f;
    for (int i = 0; i < 600 && height_m() < 2.0; ++i) run(0.05);
    field = climb ? 0.5f : hover();
    ASSERT_GE(height_m(), 2.f);
    run(1.0);
  }
  [[nodiscard]] float hover() const { return static_cast<float>(simulator_.vehicle().params().hover_thrust()); }
  [[nodiscard]] double height_m() const { return -simulator_.vehicle().state().position_ned_m.z(); }
  [[nodiscard]] Euler attitude() const {
    return euler_from_quat(simulator_.vehicle().state().q_ned_body.cast<float>());
  }
  [[nodiscard]] std::uint32_t main_mode() const { return drivers::main_mode_of(flavour_, status_.custom_mode); }
  [[nodiscard]] bool armed() const { return status_.armed; }
  [[nodiscard]] bool said(const std::string& words) const {
    return std::any_of(texts_.begin(), texts_.end(), [&](const auto& t) { return t.find(words) != std::string::npos; });
  }
  [[nodiscard]] std::uint64_t dropped() const { return simulator_.link().setpoints_dropped(); }
  [[nodiscard]] const drivers::AutopilotSetup& setup() const { return *setup_; }
  [[nodiscard]] const drivers::LinkCounts& counts() const { return link_.counts(); }
  [[nodiscard]] bool synced() const { return link_.clock().synced(); }
  drivers::AutopilotSetup& asking() { return *setup_; }

  // What the link hands on.
  void on_imu(const ImuSample&) noexcept { ++imus; }
  void on_attitude(const AttitudeSample&) noexcept {
    ++attitudes;
    setup_->on_attitude(simulator_.now_ns());
  }
  void on_heartbeat(const drivers::AutopilotStatus& s) noexcept {
    status_ = s;
    setup_->on_heartbeat(s);
  }
  void on_ack(std::uint16_t, std::uint8_t result) noexcept { result_ = result; }
  void on_statustext(std::uint8_t, std::string_view text) { texts_.emplace_back(text); }
  void on_frame(const mavlink::Frame& frame) noexcept { setup_->on_frame(frame); }
  void reply(std::span<const std::uint8_t> bytes) { simulator_.from_companion(bytes); }
  int imus = 0, attitudes = 0;

 private:
  static SimConfig config(Flavour flavour, std::vector<std::string> parameters) {
    SimConfig c;
    c.flavour = flavour;
    c.autopilot_parameters = std::move(parameters);
    c.safety_pilot = false;
    return c;
  }
  void give(std::size_t n) { simulator_.from_companion(std::span(out_).first(n)); }
  void ask(TimeNs now_ns) {
    if (const std::size_t n = setup_->next_question(now_ns, link_, out_); n != 0) give(n);
    if (simulator_.now_ns() >= timesync_due_ns_) {
      timesync_due_ns_ = simulator_.now_ns() + 200 * kMillisecond;
      give(link_.encode_timesync_request(now_ns, out_));
    }
  }
  void send_setpoint(TimeNs now_ns) {
    const Quat q = quat_from_euler({roll_rad, pitch_rad, yaw_rad});
    drivers::AttitudeTargetCommand c{{q.w(), q.x(), q.y(), q.z()}, yaw_rate_alone, 0.f, field};
    give(link_.encode_attitude_target(c, now_ns, out_));
  }

  Flavour flavour_;
  Simulator simulator_;
  drivers::AutopilotLink link_;
  std::unique_ptr<drivers::AutopilotSetup> setup_;
  drivers::AutopilotStatus status_;
  std::array<std::uint8_t, 512> out_{};
  std::vector<std::uint8_t> bytes_;
  std::vector<std::string> texts_;
  std::uint8_t result_ = 255;
  TimeNs timesync_due_ns_ = 0;
};

constexpr std::uint8_t kAccepted = 0, kTemporarilyRejected = 1;

class BothFlavours : public ::testing::TestWithParam<Flavour> {};

TEST_P(BothFlavours, CommandedPitchAndRollAreReachedWithinHalfADegree) {
  Companion c(GetParam());
  ASSERT_NO_FATAL_FAILURE(c.take_off());
  c.yaw_rad = c.attitude().yaw_rad;
  c.pitch_rad = -8 * kDegree;
  c.run(2.0);
  EXPECT_NEAR(c.attitude().pitch_rad / kDegree, -8.f, 0.5f);
  EXPECT_NEAR(c.attitude().roll_rad / kDegree, 0.f, 0.5f);
  c.pitch_rad = 0, c.roll_rad = 6 * kDegree;
  c.run(2.0);
  EXPECT_NEAR(c.attitude().roll_rad / kDegree, 6.f, 0.5f);
  EXPECT_NEAR(c.attitude().pitch_rad / kDegree, 0.f, 0.5f);
}

TEST_P(BothFlavours, TurnsToTheHeadingOfTheQuaternion) {
  Companion c(GetParam());
  ASSERT_NO_FATAL_FAILURE(c.take_off());
  c.yaw_rad = 0.6f;
  c.run(6.0);
  EXPECT_NEAR(c.attitude().yaw_rad, 0.6f, 0.05f);
}

TEST_P(BothFlavours, IsSetUpByItsParametersAndStreams) {
  Companion c(GetParam());
  c.setting_up = true;
  c.run(1.0);
  const int slow = c.attitudes;
  c.run(7.0);
  EXPECT_EQ(c.setup().bar(), drivers::SetupBar::kNone) << c.setup().verdict().refusal.view();
  EXPECT_GT(c.setup().attitude_hz(), 60.0);
  EXPECT_GT(c.attitudes, slow + 500);
  EXPECT_GT(c.imus, 400);
  EXPECT_TRUE(c.synced()) << "answers to nobody in particular, and requests at 10 Hz";
  const bool px4 = GetParam() == Flavour::kPx4;
  EXPECT_EQ(c.setup().semantics().vertical, px4 ? VerticalChannel::kThrust : VerticalChannel::kClimbRate);
}

TEST_P(BothFlavours, ForgetsWhatWasAskedWhenItIsStartedAgainAndIsAskedAgain) {
  Companion c(GetParam());
  c.setting_up = true;
  c.run(8.0);
  ASSERT_EQ(c.setup().bar(), drivers::SetupBar::kNone);
  const auto restarts = c.counts().clock_restarts;
  c.reboot();
  c.run(4.0);
  EXPECT_GT(c.counts().clock_restarts, restarts) << "its clock began anew";
  c.asking().restart();  // what the link thread does then
  c.run(8.0);
  EXPECT_EQ(c.setup().bar(), drivers::SetupBar::kNone);
  EXPECT_GT(c.setup().attitude_hz(), 60.0) << "asked for again";
  EXPECT_FALSE(c.armed());
}

INSTANTIATE_TEST_SUITE_P(Autopilots, BothFlavours, ::testing::Values(Flavour::kPx4, Flavour::kArduPilot),
                         [](const auto& of) { return std::string(facts_of(of.param).name); });

TEST(SimulatedPx4, RefusesOffboardWithoutAStream) {
  Companion c(Flavour::kPx4);
  c.run(5.0);
  EXPECT_EQ(c.enter(), kTemporarilyRejected);
  c.streaming = true;
  c.run(0.5);
  EXPECT_EQ(c.enter(), kTemporarilyRejected) << "not for long enough";
  c.run(0.8);
  EXPECT_EQ(c.enter(), kAccepted);
  EXPECT_EQ(c.main_mode(), 6u);
}

TEST(SimulatedPx4, LandsByItselfWhenTheStreamEndsAndIsNotTakenBack) {
  Companion c(Flavour::kPx4);
  ASSERT_NO_FATAL_FAILURE(c.take_off());
  const double height_m = c.height_m();
  c.streaming = false;
  c.run(0.9);
  EXPECT_EQ(c.main_mode(), 6u);
  c.run(1.3);
  EXPECT_EQ(c.main_mode(), 4u) << "AUTO, sub mode land";
  EXPECT_TRUE(c.said("Failsafe mode on"));
  c.streaming = true;
  c.run(20.0);
  EXPECT_LT(c.height_m(), height_m - 1);
  EXPECT_FALSE(c.armed()) << "landed";
}

TEST(SimulatedArduCopter, LevelsAndStaysWhenTheStreamEnds) {
  Companion c(Flavour::kArduPilot);
  ASSERT_NO_FATAL_FAILURE(c.take_off());
  c.yaw_rad = c.attitude().yaw_rad;
  c.pitch_rad = -8 * kDegree;
  c.run(2.0);
  c.streaming = false;
  c.run(0.5);
  EXPECT_LT(c.attitude().pitch_rad, -7 * kDegree) << "the last setpoint is flown on for GUID_TIMEOUT";
  c.run(4.5);
  EXPECT_NEAR(c.attitude().pitch_rad / kDegree, 0.f, 0.5f);
  EXPECT_EQ(c.main_mode(), 20u);
  EXPECT_TRUE(c.armed());
  const double height_m = c.height_m();
  c.run(5.0);
  EXPECT_NEAR(c.height_m(), height_m, 0.6);
}

TEST(SimulatedArduCopter, TheThrustFieldIsAClimbRate) {
  Companion c(Flavour::kArduPilot, {"WPNAV_SPEED_UP=200", "WPNAV_SPEED_DN=100"});
  ASSERT_NO_FATAL_FAILURE(c.take_off());
  c.field = 0.65f;  // 0.6 m/s
  c.run(3.0);
  const double from_m = c.height_m();
  c.run(5.0);
  EXPECT_NEAR((c.height_m() - from_m) / 5, 0.6, 0.2);
}

TEST(SimulatedArduCopter, DropsAYawRateAloneAndWhatComesOutsideItsMode) {
  Companion c(Flavour::kArduPilot);
  c.streaming = true;
  c.yaw_rate_alone = true;
  c.run(1.0);
  EXPECT_GE(c.dropped(), 19u);
  c.yaw_rate_alone = false;
  c.run(4.0);
  ASSERT_EQ(c.enter(), kAccepted) << "no stream is needed";
  ASSERT_EQ(c.arm(), kAccepted);
  EXPECT_EQ(c.command_mode(0), kAccepted) << "the pilot takes it back";
  EXPECT_EQ(c.main_mode(), 0u);
}

TEST(SimulatedAutopilots, DisarmWhenNobodyTakesOff) {
  for (const Flavour flavour : {Flavour::kPx4, Flavour::kArduPilot}) {
    Companion c(flavour);
    c.streaming = true;
    c.run(5.0);
    ASSERT_EQ(c.enter(), kAccepted);
    ASSERT_EQ(c.arm(), kAccepted);
    c.run(9.0);
    EXPECT_TRUE(c.armed());
    c.run(2.5);
    EXPECT_FALSE(c.armed());
  }
}

}  // namespace
}  // namespace wasp::sim
