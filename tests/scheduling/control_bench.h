// The real control loop on a pseudo-terminal, with a made-up world around it: attitude, acceleration, a height cue and
// an autopilot that arms when asked. The loop can be stalled in the middle of a tick.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <atomic>
#include <span>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "messages/frame_parser.h"
#include "messages/mavlink_frame.h"
#include "rt/thread.h"
#include "scheduling/control_loop.h"
#include "scheduling/flight_regions.h"
#include "shm/topics.h"

namespace wasp::scheduling {

/// A raw pseudo-terminal; the test is the autopilot's end.
class PtyLine {
 public:
  PtyLine() : master_(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    grantpt(master_);
    unlockpt(master_);
    slave_path_ = ptsname(master_);
    slave_ = open(slave_path_.c_str(), O_RDWR | O_NOCTTY);  // keeps the line up
  }
  ~PtyLine() {
    close(slave_);
    close(master_);
  }
  PtyLine(const PtyLine&) = delete;
  PtyLine& operator=(const PtyLine&) = delete;
  [[nodiscard]] std::string endpoint() const { return "serial:" + slave_path_ + ":921600"; }
  /// What has arrived.
  std::vector<std::uint8_t> read() {
    std::vector<std::uint8_t> all;
    std::array<std::uint8_t, 4096> chunk;
    for (ssize_t n; (n = ::read(master_, chunk.data(), chunk.size())) > 0;)
      all.insert(all.end(), chunk.begin(), chunk.begin() + n);
    return all;
  }
  /// The autopilot speaks.
  void write(std::span<const std::uint8_t> bytes) {
    EXPECT_EQ(::write(master_, bytes.data(), bytes.size()), std::ssize(bytes));
  }

 private:
  int master_, slave_ = -1;
  std::string slave_path_;
};

struct BenchOptions {
  rt::OverrunPolicy overrun = rt::OverrunPolicy::kSkip;
  DurationNs cue_age_limit_ns = 60 * kSecond;
  DurationNs attitude_age_limit_ns = 60 * kSecond;
  rt::ThreadSpec control_thread = {};
  bool found_armed = false;
  int pressure_every = 0;  ///< so many inertial samples carry one pressure, and no cue a height; 0: the cue's height
};

using WireMessage = std::variant<mavlink::SetAttitudeTarget, mavlink::Heartbeat, mavlink::CommandLong>;

class ControlBench {
 public:
  explicit ControlBench(const BenchOptions& options)
      : instance_("test-control-" + std::to_string(getpid()) + "-" + std::to_string(count_++)),
        config_(configuration(options)),
        flight_(create_flight_region(instance_, {.names = {"maker"}}, false)),
        port_(drivers::Endpoint::parse(line_.endpoint())),
        autopilot_(drivers::LinkIdentity{}),
        cue_(flight_, shm::cue_topic("maker"), "Cue"),
        attitude_(flight_, shm::kAttitude, "Attitude"),
        imu_(flight_, shm::kImu, "Imu"),
        commands_(flight_, shm::kCommand, "Command"),
        options_(options) {
    control.status = &run_status(flight_);
    watch = &board.add({"control", options.control_thread.core, options.control_thread.priority, kMillisecond});
    armed_ = options.found_armed;
  }
  ~ControlBench() {
    end();
    shm::Region::remove(shm::flight_region(instance_));
  }
  ControlBench(const ControlBench&) = delete;
  ControlBench& operator=(const ControlBench&) = delete;

  /// Starts world and loop. `behaviour`: the watch of the one behaviour, null for none.
  void start(const ThreadWatch* behaviour = nullptr) {
    ControlWiring wiring{&flight_, &stages(), &report_, &port_, &autopilot_, &events_, watch};
    if (behaviour != nullptr) wiring.behaviour_watches.push_back(behaviour);
    wiring.hook = {&ControlBench::stall, this};
    loop_ = std::make_unique<ControlLoop>(config_, wiring);
    tell_world();
    world_ = std::thread([this] {
      while (!world_over_) {
        tell_world();
        rt::sleep_until(rt::now() + 5 * kMillisecond);
      }
    });
    thread_ = rt::Thread(options_.control_thread, [this] { loop_->run(control); });
  }
  void end() {
    control.stop = true;
    thread_.join();
    world_over_ = true;
    if (world_.joinable()) world_.join();
    take_commands();
  }
  /// The next tick is held up before its write.
  void stall_once(DurationNs duration_ns) { stall_ns_ = duration_ns; }
  /// Every tick is, until told otherwise (0).
  void stall_always(DurationNs duration_ns) { always_ns_ = duration_ns; }
  /// The tick that was held up; 0 while none was.
  [[nodiscard]] std::uint64_t stalled_tick() const { return stalled_tick_.load(); }

  /// Collects commands until one fulfils `wanted`; false if none comes within a minute.
  template <class Wanted>
  bool wait_for_command(Wanted&& wanted) {
    std::size_t looked = 0;
    for (int i = 0; i < 30'000; ++i) {
      take_commands();
      for (; looked < commands.size(); ++looked)
        if (wanted(commands[looked])) return true;
      rt::sleep_until(rt::now() + 2 * kMillisecond);
    }
    return false;
  }
  bool wait_until_flying() {
    return wait_for_command(
        [](const Command& c) { return c.mode == FlightMode::kBehaviour && c.q_ned_body[2] > 0.04f; });
  }
  bool wait_for_tick(std::uint64_t tick) {
    return wait_for_command([tick](const Command& c) { return c.tick >= tick; });
  }
  bool wait_for_more_ticks(std::uint64_t ticks) {
    return wait_for_command([](const Command&) { return true; }) && wait_for_tick(commands.back().tick + ticks);
  }
  [[nodiscard]] const Command* command_of(std::uint64_t tick) const {
    for (const auto& c : commands)
      if (c.tick == tick) return &c;
    return nullptr;
  }
  /// What reached the wire since the last call, in order.
  std::vector<WireMessage> wire() {
    std::vector<WireMessage> list;
    const auto bytes = line_.read();
    parser_.feed(bytes, [&](const mavlink::Frame& f) {
      if (f.is<mavlink::SetAttitudeTarget>()) list.emplace_back(f.as<mavlink::SetAttitudeTarget>());
      if (f.is<mavlink::Heartbeat>()) list.emplace_back(f.as<mavlink::Heartbeat>());
      if (f.is<mavlink::CommandLong>()) list.emplace_back(f.as<mavlink::CommandLong>());
    });
    return list;
  }
  /// Setpoints among them.
  std::vector<mavlink::SetAttitudeTarget> setpoints() {
    std::vector<mavlink::SetAttitudeTarget> list;
    for (const auto& m : wire())
      if (const auto* s = std::get_if<mavlink::SetAttitudeTarget>(&m)) list.push_back(*s);
    return list;
  }
  std::vector<std::string> event_texts() {
    Event e;
    while (events_.take(e)) texts_.emplace_back(e.text.data());
    return texts_;
  }
  bool said(const std::string& words) {
    for (const auto& t : event_texts())
      if (t.find(words) != std::string::npos) return true;
    return false;
  }
  /// False if nothing of the kind is said within a minute.
  bool wait_for_said(const std::string& words) {
    for (int i = 0; i < 30'000 && !said(words); ++i) rt::sleep_until(rt::now() + 2 * kMillisecond);
    return said(words);
  }
  StageTable& stages() { return stage_table(flight_); }
  RunStatus& status() { return run_status(flight_); }
  [[nodiscard]] DurationNs period_ns() const { return config_.control_period_ns; }
  shm::Region& flight_region() { return flight_; }

  LoopControl control;
  std::atomic<bool> cues_stop{false}, attitude_stops{false}, autopilot_refuses{false}, autopilot_leaves{false},
      disarmed_for_good{false};
  WatchBoard board;
  ThreadWatch* watch;
  std::vector<Command> commands;

 private:
  static Config configuration(const BenchOptions& o) {
    Config c = load_config({}, {"maker"});
    c.behaviours[0].enabled = true;
    c.control_thread.overrun = o.overrun;
    c.control.arbiter.rows[0] = {
        .age_limit_ns = o.cue_age_limit_ns, .height_rank = 0, .heading_weight = 1.f, .pitch_weight = 1.f};
    c.control.attitude_age_limit_ns = o.attitude_age_limit_ns;
    c.control.link_age_limit_ns = 60 * kSecond;
    c.control.barometer.enabled = o.pressure_every > 0;
    c.control.mission.leg_count = 1;
    c.control.mission.legs[0] = {0.5f, 3600.f};
    c.control.mission.patience_s = 600.f;
    return c;
  }
  static void stall(void* self, std::uint64_t tick) WASP_REALTIME {
    auto* bench = static_cast<ControlBench*>(self);
    if (const DurationNs every_ns = bench->always_ns_.load(); every_ns > 0)
      return rt::sleep_until(rt::now() + every_ns);
    const DurationNs stall_ns = bench->stall_ns_.exchange(0);
    if (stall_ns == 0) return;
    rt::sleep_until(rt::now() + stall_ns);
    bench->stalled_tick_.store(tick);
  }
  void tell_world() {
    const TimeNs now_ns = rt::now();
    AttitudeSample attitude;
    attitude.exposed_at_ns = now_ns;
    if (!attitude_stops) attitude_.write(attitude, now_ns);
    ImuSample imu;
    imu.exposed_at_ns = now_ns;
    imu.accel_body_mps2 = {0, 0, -9.80665f};
    if (options_.pressure_every > 0 && inertial_samples_++ % options_.pressure_every == 0)
      imu.pressure_hpa = 1000.f, imu.fields = kImuHasPressure;
    imu_.write(imu, now_ns);
    Cue cue;
    cue.exposed_at_ns = now_ns;
    cue.body.validity = Validity::kValid;
    cue.body.has_height = options_.pressure_every == 0 ? 1 : 0;
    cue.body.has_pitch = 1;
    cue.body.height_m = 0.5f;
    cue.body.pitch_rad = 0.1f;  // never level: a level setpoint is not the behaviour's
    if (!cues_stop) cue_.write(cue, now_ns);
    Command command;
    if (commands_now_.copy_newest(command) &&
        command.mission_phase == static_cast<std::uint8_t>(control::MissionPhase::kArm))
      armed_ = armed_ || !autopilot_refuses;
    if (disarmed_for_good) armed_ = false;
    report_.store({now_ns, armed_ ? 1u : 0u, armed_ && !autopilot_leaves ? 1u : 0u, drivers::SetupBar::kNone, {}});
  }
  void take_commands() {
    Command c;
    while (commands_.read(c)) commands.push_back(c);
  }

  static inline int count_ = 0;
  std::string instance_;
  PtyLine line_;
  Config config_;
  shm::Region flight_;
  drivers::LinePort port_;
  drivers::AutopilotLink autopilot_;
  shm::RingWriter cue_, attitude_, imu_;
  shm::RingReader commands_;
  shm::RingReader commands_now_{flight_, shm::kCommand, "Command"};
  BenchOptions options_;
  rt::Seqlock<LinkReport> report_;
  EventQueue events_;
  mavlink::Parser parser_;
  std::vector<std::string> texts_;
  std::atomic<DurationNs> stall_ns_{0}, always_ns_{0};
  std::atomic<std::uint64_t> stalled_tick_{0};
  bool armed_ = false;
  int inertial_samples_ = 0;
  std::atomic<bool> world_over_{false};
  std::unique_ptr<ControlLoop> loop_;
  std::thread world_;
  rt::Thread thread_;
};

}  // namespace wasp::scheduling
