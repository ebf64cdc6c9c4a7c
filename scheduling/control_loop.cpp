#include "scheduling/control_loop.h"

#include <span>

#include "rt/clock.h"
#include "shm/topics.h"

namespace wasp::scheduling {
namespace {

constexpr DurationNs kHeartbeatPeriod = 1 * kSecond;
constexpr DurationNs kRequestPeriod = 500 * kMillisecond;
constexpr int kMissesBeforeHold = 2;

}  // namespace

ControlLoop::ControlLoop(const Config& config, const ControlWiring& wiring)
    : config_(config),
      wiring_(wiring),
      attitude_(*wiring.flight, shm::kAttitude, "Attitude"),
      imu_(*wiring.flight, shm::kImu, "Imu"),
      commands_(*wiring.flight, shm::kCommand, "Command"),
      wake_(wiring.stages->add("control", "wake-up", 0)),
      compute_(wiring.stages->add("control", "compute", config.control_thread.budget_ns)),
      write_(wiring.stages->add("control", "write", 0)),
      tick_to_byte_(wiring.stages->add("control", "tick to byte", config.control_deadline_ns)) {
  last_exposed_.fill(kNever);
  for (std::size_t i = 0; i < config.behaviours.size(); ++i) {
    const std::string& name = config.behaviours[i].name;
    cues_.emplace_back(*wiring.flight, shm::cue_topic(name), "Cue");
    behaviour_stages_.push_back({wiring.stages->add(name, "age at use", config.control.arbiter.rows[i].age_limit_ns),
                                 wiring.stages->add(name, "end to end", 0)});
  }
}

void ControlLoop::run(LoopControl& control) {
  RealtimeLoop loop(control);
  rt::PeriodicGrid grid(rt::now() + config_.control_period_ns, config_.control_period_ns);
  while (loop.tick() && !mission_over_.load(std::memory_order_relaxed)) tick(rt::wait_next(grid), control);
}

void ControlLoop::tick(const rt::Release& release, LoopControl& control) WASP_REALTIME {
  control::ControlInput input;
  input.now_ns = release.released_at_ns;
  input.dt_s = static_cast<float>(to_seconds(config_.control_period_ns * static_cast<DurationNs>(1 + release.skipped)));
  input.stop_requested = control.stop_requested.load(std::memory_order_relaxed);
  consecutive_misses_ += static_cast<int>(release.skipped);
  input.deadlines_missed = consecutive_misses_ >= kMissesBeforeHold;
  gather(input);
  const control::ControlOutput output = control::control_step(config_.control, input, state_);
  Command command = output.command;
  command.due_at_ns = release.due_at_ns;
  command.released_at_ns = release.released_at_ns;
  command.tick = release.index;
  command.computed_at_ns = rt::now();
  send(output, command, command.computed_at_ns);
  RunStatus& status = *control.status;
  status.ticks.fetch_add(1, std::memory_order_relaxed);
  status.skipped.fetch_add(release.skipped, std::memory_order_relaxed);
  account(input, command, control);
  commands_.write(command, rt::now());
  announce(command);
  const auto phase = state_.mission.phase;
  if (control::leg_of(phase) >= 0) control.flying.store(true, std::memory_order_relaxed);
  if (phase == control::MissionPhase::kDone || phase == control::MissionPhase::kBroken) {
    status.mission_result.store(phase == control::MissionPhase::kDone ? 1 : 2, std::memory_order_relaxed);
    mission_over_.store(true);
  }
  status.armed.store(input.autopilot.armed ? 1 : 0, std::memory_order_relaxed);
}

void ControlLoop::gather(control::ControlInput& input) WASP_REALTIME {
  for (std::size_t i = 0; i < cues_.size(); ++i) input.cues.present[i] = cues_[i].copy_newest(input.cues.cues[i]);
  input.attitude_present = attitude_.copy_newest(input.attitude);
  mean_acceleration(input);
  LinkReport report;
  if (wiring_.link->load(report))
    input.autopilot = {report.heard_at_ns, report.armed != 0,
                       static_cast<int>(report.custom_mode) == config_.follow_mode};
}

/// Mean specific force of the samples that came since the last tick; bounded by the ring's length.
void ControlLoop::mean_acceleration(control::ControlInput& input) WASP_REALTIME {
  ImuSample sample;
  int n = 0;
  std::array<float, 3> sum{};
  for (std::uint32_t i = 0; i < shm::kImuSlots && imu_.read(sample); ++i) {
    for (std::size_t k = 0; k < 3; ++k) sum[k] += sample.accel_body_mps2[k];
    ++n;
  }
  input.accel_present = n > 0;
  for (std::size_t k = 0; n > 0 && k < 3; ++k) input.accel_body_mps2[k] = sum[k] / static_cast<float>(n);
}

void ControlLoop::send(const control::ControlOutput& output, Command& command, TimeNs now_ns) WASP_REALTIME {
  std::size_t used = 0;
  if (command.sent != 0)
    used = wiring_.autopilot->encode_attitude_target({command.q_ned_body, true, command.yaw_rate_radps, command.thrust},
                                                     now_ns, out_);
  const std::size_t setpoint_bytes = used;
  used = append_requests(output, used, now_ns);
  if (used == 0) return;
  const drivers::IoResult written = wiring_.port->write(std::span<const std::uint8_t>(out_.data(), used));
  if (command.sent != 0 && written.bytes >= setpoint_bytes) command.written_at_ns = rt::now();
}

/// Heartbeat, TIMESYNC request, arming: behind the setpoint in the same write. Returns the bytes used.
std::size_t ControlLoop::append_requests(const control::ControlOutput& output, std::size_t used,
                                         TimeNs now_ns) WASP_REALTIME {
  const auto rest = [&] { return std::span<std::uint8_t>(out_).subspan(used); };
  drivers::AutopilotLink& link = *wiring_.autopilot;
  if (now_ns >= heartbeat_due_ns_) {
    used += link.encode_heartbeat(mavlink::mav_state::kActive, rest());
    heartbeat_due_ns_ = now_ns + kHeartbeatPeriod;
  }
  if ((output.ask_arm || output.ask_disarm) && now_ns >= request_due_ns_) {
    if (output.ask_arm) used += link.encode_set_mode(static_cast<std::uint32_t>(config_.follow_mode), 0, 0, rest());
    used += link.encode_arm(output.ask_arm, 0, rest());
    request_due_ns_ = now_ns + kRequestPeriod;
  }
  return used;
}

void ControlLoop::account(const control::ControlInput& input, Command& command, LoopControl& control) WASP_REALTIME {
  wake_->record(command.released_at_ns - command.due_at_ns);
  compute_->record(command.computed_at_ns - command.released_at_ns);
  const bool written = command.written_at_ns != 0;
  if (written) {
    write_->record(command.written_at_ns - command.computed_at_ns);
    tick_to_byte_->record(command.written_at_ns - command.due_at_ns);
  }
  const bool missed =
      command.sent != 0 && (!written || command.written_at_ns - command.due_at_ns > config_.control_deadline_ns);
  consecutive_misses_ = missed ? consecutive_misses_ + 1 : 0;
  if (missed) control.status->deadline_misses.fetch_add(1, std::memory_order_relaxed);
  for (std::size_t i = 0; i < cues_.size(); ++i) {
    const Cue& cue = input.cues.cues[i];
    if (!input.cues.present[i]) continue;
    behaviour_stages_[i].age->record(input.now_ns - cue.exposed_at_ns);
    if (!written || cue.exposed_at_ns == last_exposed_[i]) continue;
    behaviour_stages_[i].end_to_end->record(command.written_at_ns - cue.exposed_at_ns);
    last_exposed_[i] = cue.exposed_at_ns;
  }
}

void ControlLoop::announce(const Command& command) WASP_REALTIME {
  if (command.mode != announced_mode_)
    wiring_.events->say(command.released_at_ns, "flight mode: ", control::name_of(command.mode));
  if (command.mode != announced_mode_ && command.mode == FlightMode::kFailsafe)
    wiring_.events->say(command.released_at_ns, "failsafe because: ", control::name_of(command.reason));
  if (command.mission_phase != announced_phase_)
    wiring_.events->say(command.released_at_ns,
                        "mission: ", control::name_of(static_cast<control::MissionPhase>(command.mission_phase)));
  announced_mode_ = command.mode;
  announced_phase_ = command.mission_phase;
}

}  // namespace wasp::scheduling
