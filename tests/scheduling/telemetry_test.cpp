// What is told besides setpoints, with the test as ground station and as the behaviours: answers, rates, ages, and the
// messages of sight made from cues and flow fields whose content is known.
#include "scheduling/telemetry.h"

#include <gtest/gtest.h>

#include <fstream>

#include "rt/clock.h"
#include "scheduling/computer_status.h"
#include "scheduling/event_severity.h"
#include "scheduling/flight_regions.h"
#include "scheduling/flow_ring.h"
#include "shm/topics.h"

namespace wasp::scheduling {
namespace {

using namespace mavlink;  // NOLINT: message names
constexpr TimeNs kT0 = 1000 * kSecond;

class TelemetryTest : public testing::Test {
 protected:
  TelemetryTest() {
    config_ = load_config({}, names_);
    for (auto& row : config_.behaviours) row.enabled = true;
    config_.camera_down.geometry.position_body_m = Vec3(0, 0, 0.05f);
    flight_ = std::make_unique<shm::Region>(
        create_flight_region(instance_, {.names = names_, .silent = {}, .flows = {shm::kFlow, shm::kFlowDown}}, false));
    start();
  }
  ~TelemetryTest() override { shm::Region::remove(flight_->name()); }
  void start() { telemetry_ = std::make_unique<Telemetry>(config_, *flight_, link_); }

  template <class M>
  void ask(M m, std::uint8_t component = 191) {
    m.target_system = 1, m.target_component = component;
    say(m);
  }
  template <class M>
  void say(const M& m) {
    Encoder station(255, 190);
    std::array<std::uint8_t, kMaxFrame> out{};
    Parser parser;
    parser.feed(std::span(out).first(station.encode(m, out)),
                [&](const Frame& frame) { telemetry_->receive(frame, now_ns_); });
  }
  void command(std::uint16_t id, float p1, float p2 = 0, std::uint8_t component = 191) {
    CommandLong m;
    m.command = id, m.param1 = p1, m.param2 = p2;
    ask(m, component);
  }
  /// Turns of 5 ms until `until_ns`; what was said is in `frames_`, with its time.
  void run_to(TimeNs until_ns) {
    for (; now_ns_ <= until_ns; now_ns_ += 5 * kMillisecond) {
      gate_.look(0, now_ns_);
      telemetry_->serve(now_ns_, gate_, [&](std::span<const std::uint8_t> bytes) noexcept {
        said_.emplace_back(now_ns_, std::vector<std::uint8_t>(bytes.begin(), bytes.end()));
      });
    }
  }
  void run_for(DurationNs duration_ns) { run_to(now_ns_ + duration_ns); }
  template <class M>
  std::vector<M> heard() {
    std::vector<M> list;
    Parser parser;
    for (const auto& [at_ns, bytes] : said_)
      parser.feed(bytes, [&](const Frame& f) {
        EXPECT_EQ(f.system_id, 1);
        EXPECT_EQ(f.component_id, 191);
        if (f.is<M>()) list.push_back(f.as<M>());
      });
    return list;
  }
  Cue cue(std::size_t behaviour, DurationNs age_ns) const {
    Cue c;
    c.behaviour = static_cast<std::uint32_t>(behaviour);
    c.exposed_at_ns = now_ns_ - age_ns;
    c.body.validity = Validity::kValid;
    c.body.quality = 0.8f;
    return c;
  }
  void write(const char* behaviour, const Cue& c) {
    shm::RingWriter(*flight_, shm::cue_topic(behaviour), "Cue").write(c, now_ns_);
  }

  std::string instance_ = "test-telemetry-" + std::to_string(getpid());
  std::vector<std::string> names_{"ground_altitude", "time_to_contact", "ground_flow", "flow_field"};
  Config config_;
  std::unique_ptr<shm::Region> flight_;
  drivers::AutopilotLink link_;
  std::unique_ptr<Telemetry> telemetry_;
  LineGate gate_{LineGateParams{0, 20'000}};
  TimeNs now_ns_ = kT0;
  std::vector<std::pair<TimeNs, std::vector<std::uint8_t>>> said_;
};

TEST_F(TelemetryTest, EveryCommandIsAcknowledgedAndUnknownOnesWithThree) {
  command(mav_cmd::kComponentArmDisarm, 1);
  command(31010, 5);
  CommandInt as_int;
  as_int.command = mav_cmd::kNavLand;
  ask(as_int);
  command(mav_cmd::kComponentArmDisarm, 1, 0, 0);  // to everybody: not ours to refuse
  command(mav_cmd::kComponentArmDisarm, 1, 0, 1);  // to the autopilot
  run_for(100 * kMillisecond);
  const auto acks = heard<CommandAck>();
  ASSERT_EQ(acks.size(), 3u);
  EXPECT_EQ(acks[0].command, 400);
  EXPECT_EQ(acks[2].command, 21);
  for (const auto& ack : acks) {
    EXPECT_EQ(ack.result, mav_result::kUnsupported);
    EXPECT_EQ(ack.target_system, 255);
    EXPECT_EQ(ack.target_component, 190);
  }
}

TEST_F(TelemetryTest, TheVersionAnnouncesTheEncodingOfParameters) {
  for (const char* encoding : {"auto", "bytewise"}) {
    config_.telemetry.parameters = encoding;
    start();
    said_.clear();
    command(mav_cmd::kRequestMessage, 148, 0, 0);
    run_for(50 * kMillisecond);
    ASSERT_EQ(heard<AutopilotVersion>().size(), 1u);
    const std::uint64_t bits = heard<AutopilotVersion>()[0].capabilities;
    EXPECT_EQ(bits, 8192u | (encoding == std::string("auto") ? 131072u : 16u));
    EXPECT_EQ(heard<CommandAck>().at(0).result, mav_result::kAccepted);
  }
  config_.telemetry.parameters = "auto";
  EXPECT_EQ(encoding_for(config_.telemetry, drivers::Flavour::kPx4), drivers::ParameterEncoding::kBytewise);
  EXPECT_EQ(encoding_for(config_.telemetry, drivers::Flavour::kArduPilot), drivers::ParameterEncoding::kCCast);
}

TEST_F(TelemetryTest, AllParametersAreToldAndARateThatIsSetHolds) {
  ParamRequestList list;
  ask(list, 0);
  run_for(3 * kSecond);
  const auto values = heard<ParamValue>();
  ASSERT_GT(values.size(), 25u);
  ASSERT_EQ(values.size(), values[0].param_count);
  const auto of = [&](std::string_view name) {
    for (const auto& v : heard<ParamValue>())
      if (drivers::name_of(v.param_id) == name) return v.param_value;
    return -1.f;
  };
  EXPECT_FLOAT_EQ(of("CTRL_RATE_HZ"), 20.f);
  EXPECT_FLOAT_EQ(of("VEH_MASS_KG"), 1.925f);
  EXPECT_FLOAT_EQ(of("MIS_1_H_M"), 1.f);
  said_.clear();
  ParamSet set;
  set.param_id = drivers::parameter_name("TLM_NAMED_HZ"), set.param_type = mav_param_type::kReal32,
  set.param_value = 10;
  ask(set);
  for (int i = 0; i < 20; ++i) {
    Cue c = cue(0, 20 * kMillisecond);
    c.body.has_height = 1, c.body.height_m = 1.25f;
    write("ground_altitude", c);
    run_for(45 * kMillisecond);
  }
  EXPECT_FLOAT_EQ(of("TLM_NAMED_HZ"), 10.f);
  EXPECT_NEAR(static_cast<double>(heard<NamedValueFloat>().size()), 10, 1.5);
}

TEST_F(TelemetryTest, HeightAndTimeToContactAreToldWhileSomebodySees) {
  Cue c = cue(0, 30 * kMillisecond);
  c.body.has_height = 1, c.body.height_m = 0.75f;
  write("ground_altitude", c);
  Cue t = cue(1, 30 * kMillisecond);
  t.body.detail[0] = 45;  // frames of 1/30 s
  write("time_to_contact", t);
  run_for(20 * kMillisecond);
  const auto values = heard<NamedValueFloat>();
  ASSERT_EQ(values.size(), 2u);
  EXPECT_EQ(std::string_view(values[0].name.data()), "height");
  EXPECT_FLOAT_EQ(values[0].value, 0.75f);
  EXPECT_EQ(values[0].time_boot_ms, (kT0 - 30 * kMillisecond) / kMillisecond);
  EXPECT_EQ(std::string_view(values[1].name.data()), "tau");
  EXPECT_FLOAT_EQ(values[1].value, 1.5f);
  run_for(5 * kSecond);  // nobody sees any more
  EXPECT_EQ(heard<NamedValueFloat>().size(), 2u);
}

/// A downward flow of so much a step of 1/30 s, with the gyro's own turn beside it.
TEST_F(TelemetryTest, OpticalFlowIsTheSumOfAnUnbrokenRunWithTheGyroOfTheSameTime) {
  constexpr DurationNs kStep = kSecond / 30;
  const auto step = [&](bool valid) {
    for (int k = 0; k < 7; ++k) {
      ImuSample imu;
      imu.exposed_at_ns = now_ns_ - 6 * kStep / 7 + k * kStep / 7;
      imu.gyro_body_radps = {0.3f, -0.2f, 0.1f};
      telemetry_->note(imu);
    }
    Cue c = cue(2, 40 * kMillisecond);
    c.body.validity = valid ? Validity::kValid : Validity::kBlind;
    c.body.detail = {0.02f, -0.01f, 0.01f, -0.006f, 0.003f, static_cast<float>(to_seconds(kStep)), 1.1f, 0.1f};
    write("ground_flow", c);
    Cue g = cue(0, 30 * kMillisecond);
    g.body.has_height = 1, g.body.height_m = 1.05f;
    write("ground_altitude", g);
    const TimeNs until_ns = now_ns_ + kStep;
    run_to(until_ns - 5 * kMillisecond);
    now_ns_ = until_ns;
  };
  for (int i = 0; i < 60; ++i) step(true);
  const auto flows = heard<OpticalFlowRad>();
  ASSERT_GT(flows.size(), 15u);
  ASSERT_LT(flows.size(), 32u);
  double seconds = 0, x = 0;
  for (const auto& m : flows) {
    const double s = m.integration_time_us * 1e-6;
    seconds += s, x += static_cast<double>(m.integrated_x);
    EXPECT_NEAR(static_cast<double>(m.integrated_x), 0.02 * 30 * s, 1e-4);
    EXPECT_NEAR(static_cast<double>(m.integrated_y), -0.01 * 30 * s, 1e-4);
    EXPECT_EQ(m.quality, 204);
    EXPECT_NEAR(static_cast<double>(m.distance), 1.1, 1e-5) << "the camera is 5 cm below the other, and slants";
  }
  for (std::size_t i = 2; i < flows.size(); ++i) {
    const double s = flows[i].integration_time_us * 1e-6;
    EXPECT_NEAR(static_cast<double>(flows[i].integrated_xgyro), 0.3 * s, 2e-4) << i;
    EXPECT_NEAR(static_cast<double>(flows[i].integrated_zgyro), 0.1 * s, 2e-4) << i;
  }
  EXPECT_NEAR(seconds, 2.0, 0.15) << "nothing is left out, nothing twice";
  said_.clear();
  for (int i = 0; i < 30; ++i) step(false);
  EXPECT_LE(heard<OpticalFlowRad>().size(), 1u);  // what had been summed up before
  said_.clear();
  step(true);
  run_for(kSecond);
  EXPECT_LE(heard<OpticalFlowRad>().size(), 1u) << "never older than its age limit";
}

/// A level camera's field whose left half meets a wall at 2 m ahead and whose right half nothing.
FlowMessage wall_on_the_left(const CameraGeometry& camera, TimeNs now_ns) {
  FlowMessage m;
  m.exposed_at_ns = now_ns;
  m.first_exposed_at_ns = now_ns - kSecond / 30;
  for (FlowField* field : {&m.seen, &m.still}) {
    field->columns = 12, field->rows = 9;
    for (int row = 0; row < 9; ++row)
      for (int column = 0; column < 12; ++column) {
        FlowCell& cell = field->at(column, row);
        cell.x_px = (static_cast<float>(column) + 0.5f) * static_cast<float>(camera.intrinsics.width_px) / 12;
        cell.y_px = (static_cast<float>(row) + 0.5f) * static_cast<float>(camera.intrinsics.height_px) / 9;
        m.depth_m[static_cast<std::size_t>(row * 12 + column)] = column < 6 ? 2.f : 6.f;
      }
  }
  return m;
}

TEST_F(TelemetryTest, ObstaclesAreInTheirBinsFreeWaysAreSaidFreeAndTheRestIsUnknown) {
  config_.camera.R_body_cam = R_body_cam_from_pitch_down(Radians{0.0});
  start();
  FlowWriter(*flight_, shm::kFlow)
      .publish(wall_on_the_left(config_.camera, now_ns_ - 20 * kMillisecond), now_ns_ - 20 * kMillisecond, now_ns_);
  run_for(30 * kMillisecond);
  const auto messages = heard<ObstacleDistance>();
  ASSERT_EQ(messages.size(), 1u) << "the same field is not told twice";
  const ObstacleDistance& m = messages[0];
  EXPECT_EQ(m.frame, mav_frame::kBodyFrd);
  EXPECT_EQ(m.increment, 5);
  EXPECT_FLOAT_EQ(m.increment_f, 5.f);
  EXPECT_FLOAT_EQ(m.angle_offset, 0.f);
  EXPECT_EQ(m.max_distance, 400);
  EXPECT_EQ(m.time_usec, static_cast<std::uint64_t>((kT0 - 20 * kMillisecond - kSecond / 30) / kMicrosecond));
  for (const int bin : {-5, -4, -3, -2, -1}) {  // -25 ... -5 degrees: a wall at 2 m straight ahead
    const double truth_cm = 200 / std::cos(bin * 5 * M_PI / 180);
    EXPECT_NEAR(m.distances[static_cast<std::size_t>(bin + 72)], truth_cm, 6) << bin;
  }
  for (const int bin : {1, 2, 3, 4, 5}) EXPECT_EQ(m.distances[static_cast<std::size_t>(bin)], 401) << bin;
  for (std::size_t bin = 8; bin < 64; ++bin) EXPECT_EQ(m.distances[bin], 65535) << bin;
}

TEST_F(TelemetryTest, AnOldFieldIsNotTold) {
  FlowWriter(*flight_, shm::kFlow)
      .publish(wall_on_the_left(config_.camera, now_ns_), now_ns_ - 200 * kMillisecond, now_ns_);
  run_for(500 * kMillisecond);
  EXPECT_TRUE(heard<ObstacleDistance>().empty());
}

TEST_F(TelemetryTest, OurOwnMessagesAreForThoseWhoAsk) {
  write("ground_altitude", cue(0, 20 * kMillisecond));
  FlowWriter(*flight_, shm::kFlow).publish(wall_on_the_left(config_.camera, now_ns_), now_ns_, now_ns_);
  shm::RingWriter(*flight_, shm::kCommand, "Command").write(Command{}, now_ns_);
  run_for(2 * kSecond);
  EXPECT_TRUE(heard<WaspCue>().empty());
  EXPECT_TRUE(heard<WaspState>().empty());
  EXPECT_TRUE(heard<WaspFlow>().empty());
  command(mav_cmd::kRequestMessage, WaspCue::kId);
  command(mav_cmd::kRequestMessage, WaspState::kId);
  command(mav_cmd::kRequestMessage, WaspLatency::kId);
  run_for(kSecond);
  EXPECT_EQ(heard<WaspCue>().size(), 1u);
  EXPECT_EQ(heard<WaspState>().size(), 1u);
  EXPECT_TRUE(heard<WaspLatency>().empty()) << "nothing has run";
}

TEST_F(TelemetryTest, CuesAreToldInTurnEachOnce) {
  command(mav_cmd::kSetMessageInterval, WaspCue::kId, 20'000);
  Cue ground = cue(0, 20 * kMillisecond);
  ground.frame_sequence = 77, ground.finished_at_ns = ground.exposed_at_ns + 12'345'000;
  ground.body.has_height = 1, ground.body.height_m = 0.5f, ground.body.height_sigma_m = 0.01f;
  ground.body.has_climb = 1, ground.body.climb_1ps = -0.3f;
  write("ground_altitude", ground);
  Cue blind = cue(1, 20 * kMillisecond);
  blind.body.validity = Validity::kBlind, blind.body.avoid = 1;
  write("time_to_contact", blind);
  run_for(kSecond);
  const auto cues = heard<WaspCue>();
  ASSERT_EQ(cues.size(), 2u);
  const WaspCue& m = cues[0];
  EXPECT_EQ(std::string(m.name.data()), "ground_altitude");
  EXPECT_EQ(m.time_usec, static_cast<std::uint64_t>((kT0 - 20 * kMillisecond) / kMicrosecond));
  EXPECT_EQ(m.frame_sequence, 77u);
  EXPECT_EQ(m.latency_us, 12'345u);
  EXPECT_EQ(m.valid, 1);
  EXPECT_EQ(m.has, wasp_cue_has::kHeight | wasp_cue_has::kClimb);
  EXPECT_FLOAT_EQ(m.height, 0.5f);
  EXPECT_FLOAT_EQ(m.climb_slope, -0.3f);
  EXPECT_EQ(std::string(cues[1].name.data()), "time_to_contact");
  EXPECT_EQ(cues[1].behaviour, 1);
  EXPECT_EQ(cues[1].valid, 0);
  EXPECT_EQ(cues[1].has, wasp_cue_has::kAvoid);
  ground.step_index = 1;
  write("ground_altitude", ground);
  run_for(kSecond);
  EXPECT_EQ(heard<WaspCue>().size(), 3u);
}

TEST_F(TelemetryTest, LatenciesAreThoseOfTheTableOfStages) {
  config_.telemetry.latencies_hz = 20;
  start();
  StageTable& table = stage_table(*flight_);
  Stage* const compute = table.add("ground_flow", "compute", 2 * kMillisecond);
  for (int i = 1; i <= 100; ++i) compute->record(i * 30 * kMicrosecond);
  table.add("ground_flow", "end to end", 0)->record(40 * kMillisecond);
  table.add("control", "compute", 0)->record(kMillisecond);
  table.add("control", "tick to byte", 0)->record(3 * kMillisecond);
  run_for(220 * kMillisecond);
  const auto told = heard<WaspLatency>();
  ASSERT_GE(told.size(), 4u);
  EXPECT_EQ(std::string(told[0].name.data()), "ground_flow");
  EXPECT_EQ(told[0].behaviour, 2);
  EXPECT_EQ(told[0].samples, 100u);
  EXPECT_EQ(told[0].over_budget, 34u);
  EXPECT_NEAR(told[0].compute_p50, 1500, 50);
  EXPECT_NEAR(told[0].compute_p99, 2970, 100);
  EXPECT_FLOAT_EQ(told[0].compute_max, 3000);
  EXPECT_FLOAT_EQ(told[0].end_to_end_max, 40'000);
  EXPECT_FLOAT_EQ(told[0].wake_max, 0);
  EXPECT_EQ(std::string(told[1].name.data()), "control");
  EXPECT_EQ(told[1].behaviour, 255);
  EXPECT_FLOAT_EQ(told[1].end_to_end_max, 3000);
  EXPECT_EQ(std::string(told[2].name.data()), "ground_flow") << "in turn";
}

TEST_F(TelemetryTest, TheStateIsThatOfTheNewestTick) {
  config_.telemetry.state_hz = 50;
  start();
  Command c;
  c.tick = 5, c.released_at_ns = now_ns_, c.exposed_at_ns = now_ns_ - 33 * kMillisecond;
  c.q_ned_body = {0.8f, 0.6f, 0, 0};
  c.thrust = 0.4f, c.cue_source = 2, c.mode = FlightMode::kBehaviour, c.sent = 1, c.velocity_held = 1;
  shm::RingWriter ring(*flight_, shm::kCommand, "Command");
  ring.write(c, now_ns_);
  run_for(100 * kMillisecond);
  c.tick = 6, c.exposed_at_ns = kNever;
  ring.write(c, now_ns_);
  run_for(100 * kMillisecond);
  const auto told = heard<WaspState>();
  ASSERT_EQ(told.size(), 2u) << "each tick once";
  EXPECT_EQ(told[0].tick, 5u);
  EXPECT_EQ(told[0].evidence_age_us, 33'000u);
  EXPECT_EQ(told[0].q, c.q_ned_body);
  EXPECT_EQ(told[0].cue_source, 2);
  EXPECT_EQ(told[0].mode, wasp_flight_mode::kBehaviour);
  EXPECT_EQ(told[0].flags, wasp_state_flags::kSent | wasp_state_flags::kVelocityHeld);
  EXPECT_EQ(told[1].evidence_age_us, 0xffffffffu);
}

TEST_F(TelemetryTest, AFlowFieldComesInPartsOfOneField) {
  config_.telemetry.flow_field_hz = 5;
  start();
  FlowMessage field = wall_on_the_left(config_.camera, now_ns_);
  field.frame_sequence = 9, field.derotated = 1;
  for (int i = 0; i < field.still.count(); ++i) {
    FlowCell& cell = field.still.cells[static_cast<std::size_t>(i)];
    cell.u_px = 0.25f * static_cast<float>(i), cell.v_px = -1.5f, cell.valid = i % 7 != 0;
  }
  FlowWriter writer(*flight_, shm::kFlow);
  writer.publish(field, now_ns_, now_ns_);
  gate_ = LineGate(LineGateParams{0, 6'000});  // too little for a field at once
  for (std::uint32_t newer = 10; heard<WaspFlow>().size() < 3; ++newer) {
    run_for(10 * kMillisecond);
    field.frame_sequence = newer;
    writer.publish(field, now_ns_, now_ns_);
    ASSERT_LT(newer, 100u);
  }
  const auto parts = heard<WaspFlow>();
  std::size_t cells = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(parts[i].frame_sequence, 9u) << "of one field, whatever came meanwhile";
    EXPECT_EQ(parts[i].first, cells);
    EXPECT_EQ(parts[i].columns, 12);
    EXPECT_EQ(parts[i].rows, 9);
    EXPECT_EQ(parts[i].width, config_.camera.intrinsics.width_px);
    EXPECT_EQ(parts[i].flags, wasp_flow_flags::kStill);
    EXPECT_NEAR(parts[i].interval_us, 33'333, 1);
    for (std::size_t k = 0; k < parts[i].count; ++k, ++cells) {
      if (cells % 7 == 0) {
        EXPECT_EQ(parts[i].u[k], INT16_MIN) << cells;
        continue;
      }
      EXPECT_NEAR(static_cast<float>(parts[i].u[k]) * parts[i].scale, 0.25f * static_cast<float>(cells), 0.01) << cells;
      EXPECT_NEAR(static_cast<float>(parts[i].v[k]) * parts[i].scale, -1.5, 0.01) << cells;
    }
  }
  EXPECT_EQ(cells, 108u);
}

TEST_F(TelemetryTest, RatesAreSetAndStoppedByCommand) {
  const auto status = ComputerWatch().look(now_ns_);
  const auto count = [&](DurationNs duration) {
    said_.clear();
    for (TimeNs until = now_ns_ + duration; now_ns_ < until;) {
      auto fresh = status;
      fresh.uptime = static_cast<std::uint32_t>(now_ns_ / kMillisecond);
      telemetry_->inbox().computer.store(fresh);
      run_for(100 * kMillisecond);
    }
    return heard<OnboardComputerStatus>().size();
  };
  EXPECT_NEAR(static_cast<double>(count(5 * kSecond)), 5, 1);
  command(mav_cmd::kSetMessageInterval, 390, 200'000);
  EXPECT_NEAR(static_cast<double>(count(5 * kSecond)), 25, 2);
  command(mav_cmd::kSetMessageInterval, 390, -1);
  EXPECT_EQ(count(5 * kSecond), 0u);
  command(mav_cmd::kRequestMessage, 390);
  EXPECT_EQ(count(2 * kSecond), 1u);
  command(mav_cmd::kSetMessageInterval, 390, 0);
  EXPECT_NEAR(static_cast<double>(count(5 * kSecond)), 5, 1);
  said_.clear();
  command(mav_cmd::kSetMessageInterval, 390, 1000);  // faster than we will
  command(mav_cmd::kSetMessageInterval, std::numeric_limits<float>::quiet_NaN(), 1e6f);
  command(mav_cmd::kGetMessageInterval, 390);
  run_for(100 * kMillisecond);
  const auto acks = heard<CommandAck>();
  ASSERT_EQ(acks.size(), 3u);
  EXPECT_EQ(acks[0].result, mav_result::kDenied);
  EXPECT_EQ(acks[1].result, mav_result::kUnsupported);
  EXPECT_EQ(acks[2].result, mav_result::kAccepted);
  EXPECT_EQ(heard<MessageInterval>().at(0).interval_us, 1'000'000);
}

TEST_F(TelemetryTest, TheComputersStateIsToldWithItsSentinels) {
  telemetry_->inbox().computer.store(ComputerWatch().look(now_ns_));
  run_for(20 * kMillisecond);
  const auto told = heard<OnboardComputerStatus>();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_GT(told[0].ram_total, 100u);
  EXPECT_LT(told[0].ram_usage, told[0].ram_total);
  EXPECT_LE(told[0].cpu_combined[0], 100);
  EXPECT_EQ(told[0].gpu_combined[0], 255);
  EXPECT_EQ(told[0].fan_speed[0], 32767);
  run_for(10 * kSecond);  // the reader has died: nothing stale is repeated
  EXPECT_LE(heard<OnboardComputerStatus>().size(), 6u);
}

TEST_F(TelemetryTest, TextsOfTheMainThreadGoOut) {
  telemetry_->inbox().tell(mav_severity::kCritical, "failsafe because: link lost");
  run_for(20 * kMillisecond);
  const auto texts = heard<Statustext>();
  ASSERT_EQ(texts.size(), 1u);
  EXPECT_EQ(std::string_view(texts[0].text.data()), "failsafe because: link lost");
  EXPECT_EQ(texts[0].severity, 2);
  EXPECT_EQ(severity_of("failsafe because: link lost"), mav_severity::kCritical);
  EXPECT_EQ(severity_of("autopilot: PreArm: whatever"), std::nullopt) << "no echo";
  EXPECT_EQ(severity_of("imu refused: a jump"), mav_severity::kWarning);
}

}  // namespace
}  // namespace wasp::scheduling
