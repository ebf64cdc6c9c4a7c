// The control thread itself, stalled for 130 ms in the middle of a tick: what each overrun policy makes of it, on the
// grid and on the wire, and what becomes of a command that grew too old meanwhile.
#include "scheduling/control_loop.h"

#include <unistd.h>

#include <cmath>

#include "shm/bus_guard.h"
#include "tests/scheduling/control_bench.h"

namespace wasp::scheduling {
namespace {

constexpr DurationNs kStall = 130 * kMillisecond;

/// A host that stands still by itself can spoil a stall of ours: five attempts, a defect spoils all.
template <class Attempt>
void expect_once(Attempt&& attempt) {
  for (int i = 0; i < 5; ++i)
    if (attempt()) return;
  ADD_FAILURE() << "not once in five attempts";
}

/// Flies, stalls one tick, and goes on for ten more.
void fly_with_stall(ControlBench& bench) {
  bench.start();
  ASSERT_TRUE(bench.wait_until_flying());
  bench.stall_once(kStall);
  for (int i = 0; i < 30'000 && bench.stalled_tick() == 0; ++i) rt::sleep_until(rt::now() + 2 * kMillisecond);
  ASSERT_NE(bench.stalled_tick(), 0u);
  ASSERT_TRUE(bench.wait_for_tick(bench.stalled_tick() + 10));
  bench.end();
}

void expect_an_unmoved_grid(const ControlBench& bench) {
  const Command& first = bench.commands.front();
  for (const auto& c : bench.commands)
    EXPECT_EQ(c.due_at_ns, first.due_at_ns + static_cast<DurationNs>(c.tick - first.tick) * bench.period_ns());
}

TEST(ControlLoop, SkipPassesOverExactlyTwoReleasesOfAStallOf130Milliseconds) {
  expect_once([] {
    ControlBench bench({.overrun = rt::OverrunPolicy::kSkip});
    fly_with_stall(bench);
    expect_an_unmoved_grid(bench);
    const std::uint64_t k = bench.stalled_tick();
    const Command *stalled = bench.command_of(k), *next = bench.command_of(k + 3);
    EXPECT_GE(bench.status().skipped.load(), 2u);
    if (stalled == nullptr || next == nullptr || bench.status().skipped.load() != 2) return false;
    EXPECT_EQ(bench.command_of(k + 1), nullptr);
    EXPECT_EQ(bench.command_of(k + 2), nullptr);
    EXPECT_GE(stalled->written_at_ns - stalled->due_at_ns, kStall);  // from the intended release
    EXPECT_GE(bench.status().deadline_misses.load(), 1u);
    return true;
  });
}

TEST(ControlLoop, CatchUpServesTheLateReleasesInTurnWithTheirOwnLateness) {
  expect_once([] {
    ControlBench bench({.overrun = rt::OverrunPolicy::kCatchUp});
    fly_with_stall(bench);
    expect_an_unmoved_grid(bench);
    const std::uint64_t k = bench.stalled_tick();
    const Command *one = bench.command_of(k + 1), *two = bench.command_of(k + 2);
    EXPECT_TRUE(one != nullptr && two != nullptr);
    if (one == nullptr || two == nullptr || bench.status().skipped.load() != 0) return false;
    EXPECT_GE(one->released_at_ns - one->due_at_ns, kStall - bench.period_ns());
    EXPECT_GE(two->released_at_ns - two->due_at_ns, kStall - 2 * bench.period_ns());
    EXPECT_LE(one->written_at_ns, two->released_at_ns);
    EXPECT_GE(bench.status().deadline_misses.load(), 3u);
    return true;
  });
}

TEST(ControlLoop, StopLandsInOrderAndNeverFallsSilent) {
  ControlBench bench({.overrun = rt::OverrunPolicy::kStop});
  fly_with_stall(bench);
  expect_an_unmoved_grid(bench);
  EXPECT_TRUE(bench.control.overrun_stop);
  EXPECT_TRUE(bench.said("policy stop")) << ::testing::PrintToString(bench.event_texts());
  EXPECT_TRUE(bench.said("mission ends early: stop requested"));
  int landing = 0;
  for (const auto& c : bench.commands) {
    if (c.tick <= bench.stalled_tick()) continue;
    EXPECT_EQ(c.sent, 1);
    if (static_cast<control::MissionPhase>(c.mission_phase) != control::MissionPhase::kLand) continue;
    ++landing;
    EXPECT_GT(c.thrust, 0.f);
  }
  EXPECT_GT(landing, 0);
}

/// The first setpoint on the wire made at or after `at_ns`, and the one before it.
std::pair<float, float> pitch_around(ControlBench& bench, TimeNs at_ns) {
  float before = 0;
  for (const auto& s : bench.setpoints()) {
    if (static_cast<TimeNs>(s.time_boot_ms) * kMillisecond + kMillisecond > at_ns) return {before, s.q[2]};
    before = s.q[2];
  }
  return {before, before};
}

TEST(ControlLoop, ACueThatGrewTooOldBeforeTheWriteIsRefusedAndHoldGoesOut) {
  expect_once([] {
    ControlBench bench({.cue_age_limit_ns = 100 * kMillisecond});
    fly_with_stall(bench);
    const Command* stalled = bench.command_of(bench.stalled_tick());
    if (stalled == nullptr || stalled->refused == 0) return false;  // no cue to refuse: the made-up world stood still
    EXPECT_EQ(stalled->refused, static_cast<std::uint8_t>(control::Refusal::kCueTooOld));
    EXPECT_EQ(stalled->mode, FlightMode::kHold);
    EXPECT_EQ(stalled->reason, ModeReason::kTooOld);
    EXPECT_EQ(stalled->exposed_at_ns, kNever);
    EXPECT_GE(bench.status().commands_refused.load(), 1u);
    EXPECT_TRUE(bench.said("command refused: its cue grew too old"));
    const auto [before, refused] = pitch_around(bench, stalled->computed_at_ns + kStall);
    EXPECT_GT(before, 0.01f);  // the behaviour's
    EXPECT_EQ(refused, 0.f);   // level at once
    return true;
  });
}

TEST(ControlLoop, AnAttitudeThatGrewTooOldBeforeTheWriteMeansFailsafe) {
  expect_once([] {
    ControlBench bench({.attitude_age_limit_ns = 100 * kMillisecond});
    fly_with_stall(bench);
    const Command* stalled = bench.command_of(bench.stalled_tick());
    if (stalled == nullptr || stalled->refused == 0) return false;
    EXPECT_EQ(stalled->refused, static_cast<std::uint8_t>(control::Refusal::kAttitudeTooOld));
    EXPECT_EQ(stalled->mode, FlightMode::kFailsafe);
    EXPECT_TRUE(bench.said("command refused: its attitude grew too old"));
    return true;
  });
}

TEST(ControlLoop, TwoMissesInARowMeanHoldLevelOnTheWire) {
  ControlBench bench({});
  bench.start();
  ASSERT_TRUE(bench.wait_until_flying());
  bench.stall_always(20 * kMillisecond);  // past the deadline of 10 ms, within the period
  ASSERT_TRUE(bench.wait_for_command(
      [](const Command& c) { return c.mode == FlightMode::kHold && c.reason == ModeReason::kDeadlineMissed; }));
  bench.wire();
  ASSERT_TRUE(bench.wait_for_more_ticks(5));
  int setpoints = 0;
  for (const auto& m : bench.wire()) {
    if (const auto* s = std::get_if<mavlink::SetAttitudeTarget>(&m)) {
      ++setpoints;
      EXPECT_EQ(s->q[1], 0.f);
      EXPECT_EQ(s->q[2], 0.f);
      EXPECT_EQ(s->body_yaw_rate, 0.f);
    }
  }
  EXPECT_GE(setpoints, 3);
  EXPECT_TRUE(bench.said("hold because: deadlines missed"));
  bench.stall_always(0);
  const std::uint64_t end = bench.commands.back().tick + 2;
  EXPECT_TRUE(bench.wait_for_command(
      [end](const Command& c) { return c.tick > end && c.mode == FlightMode::kBehaviour && c.q_ned_body[2] > 0.04f; }));
  bench.end();
  // Never earlier than at the second miss: a tick in hold for this reason follows two late ones.
  for (const Command& c : bench.commands) {
    if (c.mode != FlightMode::kHold || c.reason != ModeReason::kDeadlineMissed) continue;
    for (const std::uint64_t back : {1, 2})
      if (const Command* before = bench.command_of(c.tick - back)) {
        EXPECT_GT(before->written_at_ns - before->due_at_ns, 10 * kMillisecond) << c.tick;
      }
  }
}

TEST(ControlLoop, IsNotArmedWhileItMissesItsDeadlines) {
  ControlBench bench({});
  bench.stall_always(20 * kMillisecond);
  bench.autopilot_refuses = true;  // until control is punctual again
  bench.start();
  ASSERT_TRUE(bench.wait_for_said("not arming: control missed its deadlines"));
  bench.wire();  // what was asked before the second miss
  ASSERT_TRUE(bench.wait_for_more_ticks(30));
  for (const auto& m : bench.wire()) EXPECT_EQ(std::get_if<mavlink::CommandLong>(&m), nullptr);
  bench.stall_always(0);
  int asked = 0;
  for (int i = 0; i < 30'000 && asked == 0; ++i) {
    for (const auto& m : bench.wire()) asked += std::get_if<mavlink::CommandLong>(&m) != nullptr ? 1 : 0;
    rt::sleep_until(rt::now() + 2 * kMillisecond);
  }
  EXPECT_GT(asked, 0);
  bench.autopilot_refuses = false;
  EXPECT_TRUE(bench.wait_until_flying());
}

TEST(ControlLoop, AnAutopilotThatLeavesItsModeIsReportedAndGoesOnByItself) {
  ControlBench bench({});
  bench.start();
  ASSERT_TRUE(bench.wait_until_flying());
  bench.autopilot_leaves = true;
  ASSERT_TRUE(bench.wait_for_command([](const Command& c) { return c.mode == FlightMode::kManual; }));
  EXPECT_TRUE(bench.wait_for_said("manual because: autopilot left our mode"));
  bench.wire();
  ASSERT_TRUE(bench.wait_for_more_ticks(20));
  for (const auto& m : bench.wire())
    EXPECT_EQ(std::get_if<mavlink::CommandLong>(&m), nullptr);  // nobody is called back
}

TEST(ControlLoop, OneThatIsDisarmedInFlightIsNeverArmedAgain) {
  ControlBench bench({});
  bench.start();
  ASSERT_TRUE(bench.wait_until_flying());
  bench.wire();
  bench.disarmed_for_good = true;  // a reboot, or a hand on a switch
  ASSERT_TRUE(bench.wait_for_said("mission ends early: disarmed in flight"));
  for (int i = 0; i < 30'000 && bench.status().mission_result.load() == 0; ++i)
    rt::sleep_until(rt::now() + 2 * kMillisecond);
  EXPECT_EQ(bench.status().mission_result.load(), static_cast<std::uint32_t>(MissionResult::kBrokenOff));
  bench.end();
  for (const auto& m : bench.wire()) EXPECT_EQ(std::get_if<mavlink::CommandLong>(&m), nullptr);
}

TEST(ControlLoop, FliesOnInHoldWhenItsOwnRegionIsCutShort) {
  shm::install_bus_guard();
  ControlBench bench({.cue_age_limit_ns = 100 * kMillisecond});
  bench.start();
  ASSERT_TRUE(bench.wait_until_flying());
  bench.setpoints();
  ASSERT_EQ(truncate(("/dev/shm/" + bench.flight_region().name()).c_str(), 0), 0);
  std::size_t more = 0;
  for (int i = 0; i < 30'000 && more < 10; ++i) {  // the stream goes on, on the wire
    for (const auto& s : bench.setpoints()) {
      EXPECT_TRUE(std::isfinite(s.thrust) && s.thrust >= 0 && s.thrust <= 1);
      ++more;
    }
    rt::sleep_until(rt::now() + 2 * kMillisecond);
  }
  EXPECT_GE(more, 10u);
  EXPECT_GT(shm::lost_pages(), 0u);
}

TEST(ControlLoop, TheHeartbeatTellsEveryChangeOfModeInTheWriteOfItsSetpoint) {
  ControlBench bench({.cue_age_limit_ns = 100 * kMillisecond});
  bench.status().incarnation = 2;
  bench.start();
  ASSERT_TRUE(bench.wait_until_flying());
  bench.cues_stop = true;
  ASSERT_TRUE(bench.wait_for_command([](const Command& c) { return c.mode == FlightMode::kHold; }));
  ASSERT_TRUE(bench.wait_for_command([](const Command& c) { return c.mode == FlightMode::kFailsafe; }));
  bench.end();
  std::vector<drivers::CompanionState> told, meant;
  const WireMessage* before = nullptr;
  const auto wire = bench.wire();
  for (const auto& message : wire) {
    if (const auto* beat = std::get_if<mavlink::Heartbeat>(&message)) {
      const auto state = drivers::companion_state_of(beat->custom_mode);
      EXPECT_EQ(beat->system_status, drivers::system_status_of(state));
      if (told.empty() || told.back() != state) told.push_back(state);
      const auto* setpoint = before == nullptr ? nullptr : std::get_if<mavlink::SetAttitudeTarget>(before);
      ASSERT_NE(setpoint, nullptr);
      if (state.mode == FlightMode::kHold || state.mode == FlightMode::kFailsafe) {
        EXPECT_EQ(setpoint->q[2], 0.f);  // the same write: level
      }
    }
    before = &message;
  }
  for (const Command& c : bench.commands) {
    const drivers::CompanionState state{c.mode, c.reason, false, 2};
    if (meant.empty() || meant.back() != state) meant.push_back(state);
  }
  EXPECT_EQ(told, meant);
  EXPECT_GE(told.size(), 4u);
}

TEST(ControlLoop, SamplesWithoutAPressureDoNotPullTheBarometricHeight) {
  ControlBench bench({.pressure_every = 3});
  bench.start();
  ASSERT_TRUE(bench.wait_until_flying());
  ASSERT_TRUE(bench.wait_for_more_ticks(20));
  bench.end();
  for (const Command& c : bench.commands) {
    EXPECT_EQ(c.cue_source, -1);
    if (c.height_m != 0.f) {  // from the first pressure on
      EXPECT_NEAR(c.height_m, 0.2f, 0.05f) << c.tick;
    }
  }
}

TEST(ControlLoop, SaysWhyAVehicleFoundArmedIsNotAdopted) {
  ControlBench bench({.found_armed = true});
  bench.start();
  for (int i = 0; i < 30'000 && bench.status().mission_result.load() == 0; ++i)
    rt::sleep_until(rt::now() + 2 * kMillisecond);
  bench.end();
  EXPECT_EQ(bench.status().mission_result.load(), static_cast<std::uint32_t>(MissionResult::kBrokenOff));
  EXPECT_TRUE(bench.said("found armed, not adopted"));
  EXPECT_TRUE(bench.setpoints().empty());
}

TEST(SetpointLine, AStalledLineIsFlushedSoThatNoOldSetpointGoesOutLater) {
  PtyLine line;
  drivers::LinePort port(drivers::Endpoint::parse(line.endpoint()));
  SetpointLine setpoints(port);
  std::vector<std::uint8_t> setpoint(51, 0);
  int written = 0;
  for (bool flushed = false; !flushed && written < 10'000; ++written) {  // nobody reads: the line fills up
    setpoint.assign(51, static_cast<std::uint8_t>(written % 200));
    const auto sent = setpoints.send(setpoint, setpoint.size());
    EXPECT_NE(sent.setpoint_whole, sent.flushed);
    flushed = sent.flushed;
  }
  ASSERT_LT(written, 10'000);
  setpoint.assign(51, 255);
  EXPECT_TRUE(setpoints.send(setpoint, setpoint.size()).setpoint_whole);
  std::vector<std::uint8_t> arrived;
  for (int i = 0; i < 60'000 && (arrived.empty() || arrived.back() != 255); ++i) {
    const auto more = line.read();
    arrived.insert(arrived.end(), more.begin(), more.end());
    rt::sleep_until(rt::now() + kMillisecond);
  }
  ASSERT_GE(arrived.size(), setpoint.size());
  EXPECT_TRUE(std::equal(setpoint.rbegin(), setpoint.rend(), arrived.rbegin()));
  // What stood in the line is gone, but for the 4 KiB that the kernel had already handed to the reader's end.
  EXPECT_LE(arrived.size(), 4096 + setpoint.size());
  EXPECT_GT(static_cast<std::size_t>(written) * setpoint.size(), 3 * arrived.size());
}

}  // namespace
}  // namespace wasp::scheduling
