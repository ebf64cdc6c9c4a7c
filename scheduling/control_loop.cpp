#include "scheduling/control_loop.h"

#include <span>

#include "rt/clock.h"
#include "shm/topics.h"
#include "types/frames.h"

namespace wasp::scheduling {
namespace {

constexpr DurationNs kHeartbeatPeriod = 1 * kSecond;
constexpr DurationNs kRequestPeriod = 500 * kMillisecond;
constexpr int kMissesBeforeHold = 2;
constexpr DurationNs kPunctualFor = 1 * kSecond;  // before arming is thought of again
constexpr float kOffTheGround_m = 0.2f;

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
      tick_to_byte_(wiring.stages->add("control", "tick to byte", config.control_deadline_ns)),
      line_(*wiring.port) {
  last_exposed_.fill(kNever);
  for (std::size_t i = 0; i < config.behaviours.size(); ++i) {
    if (!config.behaviours[i].enabled) continue;
    const std::string& name = config.behaviours[i].name;
    cues_.push_back({i, shm::RingReader(*wiring.flight, shm::cue_topic(name), "Cue"),
                     i < wiring.behaviour_watches.size() ? wiring.behaviour_watches[i] : nullptr,
                     wiring.stages->add(name, "age at use", config.control.arbiter.rows[i].age_limit_ns),
                     wiring.stages->add(name, "end to end", 0)});
  }
}

void ControlLoop::run(LoopControl& control) {
  RealtimeLoop loop(control, *wiring_.watch);
  // The threads beside it settle first; but a flight that was started again is waited for.
  const DurationNs settle_ns = control.status->incarnation > 0 ? kMillisecond : config_.control_period_ns;
  rt::PeriodicGrid grid(rt::now() + settle_ns, config_.control_period_ns, config_.control_thread.overrun);
  while (loop.tick() && !mission_over_.load(std::memory_order_relaxed)) tick(rt::wait_next(grid), control);
  last_beat();
}

void ControlLoop::tick(const rt::Release& release, LoopControl& control) WASP_REALTIME {
  this->release(release, control);
  control::ControlInput input;
  input.now_ns = release.released_at_ns;
  input.dt_s = static_cast<float>(to_seconds(config_.control_period_ns * static_cast<DurationNs>(1 + release.skipped)));
  input.stop_requested = control.stop_requested.load(std::memory_order_relaxed);
  input.deadlines_missed = consecutive_misses_ >= kMissesBeforeHold;
  LinkReport report;
  if (wiring_.link->load(report)) setup_bar_ = report.setup_bar;
  const char* const bar = bar_to_arming(input.now_ns);
  input.may_arm = bar == nullptr;
  gather(input);
  control::ControlOutput output = control::control_step(config_.control, input, state_);
  Command& command = output.command;
  command.due_at_ns = release.due_at_ns;
  command.released_at_ns = release.released_at_ns;
  command.tick = release.index;
  command.computed_at_ns = rt::now();
  send(input, output, control);
  account(input, command, release.skipped, control);
  commands_.write(command, rt::now());
  announce(command, bar);
  mark(input, command, control);
  end_of_tick(input, control);
  beat(input, output);
}

/// What the mission has reached.
void ControlLoop::mark(const control::ControlInput& input, const Command& command, LoopControl& control) WASP_REALTIME {
  const auto phase = state_.mission.phase;
  const bool leg = control::leg_of(phase) >= 0;
  const float climbed_m = command.height_m - state_.mission.ground_height_m;
  if (input.autopilot.armed) control.marks.reach(Milestone::kArmed, input.now_ns);
  if (leg && (climbed_m >= kOffTheGround_m || config_.control.mission.follow_recording))
    control.marks.reach(Milestone::kFlying, input.now_ns);
  if (phase == control::MissionPhase::kLand) control.marks.reach(Milestone::kLanding, input.now_ns);
}

/// What a release itself says: how late, and whether others were passed over.
void ControlLoop::release(const rt::Release& release, LoopControl& control) WASP_REALTIME {
  wiring_.watch->trace.record(release.released_at_ns, rt::TraceKind::kRelease, release.index,
                              release.released_at_ns - release.due_at_ns);
  consecutive_misses_ += static_cast<int>(release.skipped);
  control.status->ticks.fetch_add(1, std::memory_order_relaxed);
  control.status->skipped.fetch_add(release.skipped, std::memory_order_relaxed);
  if (release.skipped == 0 || config_.control_thread.overrun != rt::OverrunPolicy::kStop) return;
  if (control.overrun_stop.exchange(true)) return;
  control.stop_requested.store(true);
  wiring_.events->say(release.released_at_ns, "overrun of control, policy stop: landing in order; releases skipped: ",
                      static_cast<long>(release.skipped));
}

void ControlLoop::end_of_tick(const control::ControlInput& input, LoopControl& control) WASP_REALTIME {
  RunStatus& status = *control.status;
  const auto phase = state_.mission.phase;
  if (control::leg_of(phase) >= 0) control.flying.store(true, std::memory_order_relaxed);
  if (phase == control::MissionPhase::kDone || phase == control::MissionPhase::kBroken) {
    const MissionResult result = phase == control::MissionPhase::kBroken                ? MissionResult::kBrokenOff
                                 : state_.mission.early_end == control::EarlyEnd::kNone ? MissionResult::kFlown
                                                                                        : MissionResult::kStoppedEarly;
    status.mission_result.store(static_cast<std::uint32_t>(result), std::memory_order_relaxed);
    mission_over_.store(true);
  }
  status.armed.store(input.autopilot.armed ? 1 : 0, std::memory_order_relaxed);
}

/// False while the guardian speaks in our place: two voices at once would be none.
bool ControlLoop::line_is_ours() const WASP_REALTIME {
  return wiring_.guard == nullptr ||
         wiring_.guard->owner.load(std::memory_order_acquire) == static_cast<std::uint32_t>(LineOwner::kFlight);
}

/// Tells the guardian that control lives, until when it will, and what would be neutral meanwhile.
void ControlLoop::beat(const control::ControlInput& input, const control::ControlOutput& output) WASP_REALTIME {
  if (wiring_.guard == nullptr) return;
  GuardBlock& guard = *wiring_.guard;
  const Command& command = output.command;
  const auto& q = input.attitude.q_ned_body;
  if (input.attitude_present)
    guard.yaw_rad.store(euler_from_quat(Quat(q[0], q[1], q[2], q[3])).yaw_rad, std::memory_order_relaxed);
  guard.neutral_thrust.store(output.neutral_thrust, std::memory_order_relaxed);
  guard.commanding.store(command.sent != 0 && input.autopilot.armed ? 1 : 0, std::memory_order_relaxed);
  guard.tick.store(command.tick, std::memory_order_relaxed);
  const TimeNs now_ns = rt::now();
  guard.next_due_ns.store(rt::next_due(command.due_at_ns, config_.control_period_ns, now_ns),
                          std::memory_order_relaxed);
  guard.beat_at_ns.store(now_ns, std::memory_order_release);
}

/// Control ends in order: nothing hangs on it any more.
void ControlLoop::last_beat() noexcept {
  if (wiring_.guard == nullptr) return;
  wiring_.guard->commanding.store(0);
  wiring_.guard->next_due_ns.store(0);
}

void ControlLoop::gather(control::ControlInput& input) WASP_REALTIME {
  for (const CueSource& source : cues_) {
    const std::size_t i = source.behaviour;
    input.cues.present[i] = source.ring.copy_newest(input.cues.cues[i]);
    input.cues.off[i] = source.watch != nullptr && source.watch->demoted.load(std::memory_order_relaxed) != 0;
    input.cues.overdue[i] = source.watch != nullptr && source.watch->overdue(input.now_ns);
  }
  input.attitude_present = attitude_.copy_newest(input.attitude);
  mean_inertial(input);
  LinkReport report;
  if (wiring_.link->load(report))
    input.autopilot = {report.heard_at_ns, report.armed != 0,
                       drivers::main_mode_of(config_.autopilot.flavour, report.custom_mode) == config_.autopilot.mode(),
                       report.semantics};
}

/// Mean specific force and pressure of the samples that came since the last tick; bounded by the ring's length.
void ControlLoop::mean_inertial(control::ControlInput& input) WASP_REALTIME {
  ImuSample sample;
  int n = 0;
  std::array<float, 3> sum{};
  control::PressureMean pressure;
  for (std::uint32_t i = 0; i < shm::kImuSlots && imu_.read(sample); ++i) {
    for (std::size_t k = 0; k < 3; ++k) sum[k] += sample.accel_body_mps2[k];
    pressure.add(sample);
    ++n;
  }
  input.pressure_hpa = pressure.take();
  input.accel_present = n > 0;
  for (std::size_t k = 0; n > 0 && k < 3; ++k) input.accel_body_mps2[k] = sum[k] / static_cast<float>(n);
}

std::size_t ControlLoop::encode(const Command& command, TimeNs now_ns) WASP_REALTIME {
  if (command.sent == 0) return 0;
  const bool by_rate = config_.autopilot.flavour != drivers::Flavour::kArduPilot;
  return wiring_.autopilot->encode_attitude_target(
      {command.q_ned_body, by_rate, command.yaw_rate_radps, command.thrust}, now_ns, out_);
}

/// The last look at the clock: what has grown too old since the arbiter looked is replaced. Returns the bytes used.
std::size_t ControlLoop::refuse_if_too_old(const control::ControlInput& input, control::ControlOutput& output,
                                           std::size_t used, LoopControl& control) WASP_REALTIME {
  const TimeNs now_ns = rt::now();
  const control::Refusal refusal = control::refusal_at(output, now_ns);
  if (output.command.sent == 0 || refusal == control::Refusal::kNone) return used;
  control::refuse(config_.control, input, refusal, state_, output);
  control.status->commands_refused.fetch_add(1, std::memory_order_relaxed);
  wiring_.events->say(now_ns,
                      refusal == control::Refusal::kCueTooOld
                          ? "command refused: its cue grew too old before the write; tick "
                          : "command refused: its attitude grew too old before the write; tick ",
                      static_cast<long>(output.command.tick));
  return encode(output.command, now_ns);
}

void ControlLoop::send(const control::ControlInput& input, control::ControlOutput& output,
                       LoopControl& control) WASP_REALTIME {
  Command& command = output.command;
  std::size_t used = encode(command, command.computed_at_ns);
  if (wiring_.hook.before_write != nullptr) wiring_.hook.before_write(wiring_.hook.context, command.tick);
  used = refuse_if_too_old(input, output, used, control);
  const std::size_t setpoint_bytes = used;
  used = append_heartbeat(command, control.status->incarnation.load(std::memory_order_relaxed), used);
  used = append_requests(input, output, used, command.computed_at_ns);
  if (used == 0 || !line_is_ours()) return;
  const SetpointLine::Sent sent = line_.send(std::span<const std::uint8_t>(out_.data(), used), setpoint_bytes);
  if (sent.flushed) control.status->setpoints_flushed.fetch_add(1, std::memory_order_relaxed);
  if (!sent.setpoint_whole) heartbeat_due_ns_ = 0;  // it did not go out either
  if (command.sent != 0 && sent.setpoint_whole) command.written_at_ns = rt::now();
  if (command.written_at_ns == 0)
    streaming_since_ns_ = kNever;
  else if (streaming_since_ns_ == kNever)
    streaming_since_ns_ = command.written_at_ns;
}

/// Once a second, and at once when what it says of us has changed: behind the setpoint in the same write. Returns the
/// bytes used.
std::size_t ControlLoop::append_heartbeat(const Command& command, std::uint32_t incarnation,
                                          std::size_t used) WASP_REALTIME {
  const drivers::CompanionState state{command.mode, command.reason, false, static_cast<std::uint8_t>(incarnation)};
  if (command.computed_at_ns < heartbeat_due_ns_ && state == told_) return used;
  told_ = state;
  heartbeat_due_ns_ = command.computed_at_ns + kHeartbeatPeriod;
  return used + wiring_.autopilot->encode_heartbeat(state, std::span<std::uint8_t>(out_).subspan(used));
}

/// Some autopilots refuse the mode until setpoints have come for a while.
bool ControlLoop::may_enter_mode(TimeNs now_ns) const WASP_REALTIME {
  const DurationNs first_ns = drivers::facts_of(config_.autopilot.flavour).stream_first_ns;
  return first_ns == 0 || (streaming_since_ns_ != kNever && now_ns - streaming_since_ns_ >= first_ns);
}

/// Mode, arming and disarming: behind the setpoint in the same write. Returns the bytes used.
std::size_t ControlLoop::append_requests(const control::ControlInput& input, const control::ControlOutput& output,
                                         std::size_t used, TimeNs now_ns) WASP_REALTIME {
  const auto rest = [&] { return std::span<std::uint8_t>(out_).subspan(used); };
  drivers::AutopilotLink& link = *wiring_.autopilot;
  const bool in_turn = drivers::facts_of(config_.autopilot.flavour).asks_in_turn;
  const bool enter = in_turn ? output.ask_follow : output.ask_follow || output.ask_arm;
  const bool arm = output.ask_arm && (!in_turn || input.autopilot.follows);
  const bool ask_mode = enter && config_.autopilot.enter_mode && may_enter_mode(now_ns);
  const bool ask_arm = arm && config_.autopilot.arm;
  if ((!ask_mode && !ask_arm && !output.ask_disarm) || now_ns < request_due_ns_) return used;
  if (ask_mode) used += link.encode_set_mode(config_.autopilot.mode(), 0, 0, rest());
  if (ask_arm || output.ask_disarm) used += link.encode_arm(ask_arm, 0, rest());
  request_due_ns_ = now_ns + (in_turn ? 2 * kRequestPeriod : kRequestPeriod);
  return used;
}

void ControlLoop::account(const control::ControlInput& input, const Command& command, std::uint64_t skipped,
                          LoopControl& control) WASP_REALTIME {
  RunStatus& status = *control.status;
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
  if (missed) status.deadline_misses.fetch_add(1, std::memory_order_relaxed);
  if (command.sent != 0 && command.mode == FlightMode::kBehaviour)
    status.behaviour_ticks.fetch_add(1, std::memory_order_relaxed);
  account_cues(input, command, status);
  report_miss(command, skipped, missed);
}

void ControlLoop::account_cues(const control::ControlInput& input, const Command& command,
                               RunStatus& status) WASP_REALTIME {
  for (const CueSource& source : cues_) {
    const std::size_t i = source.behaviour;
    const Cue& cue = input.cues.cues[i];
    const bool late = input.cues.overdue[i] || (input.cues.present[i] && cue.over_budget != 0);
    const auto state = input.cues.off[i] ? BehaviourState::kDemoted
                       : late            ? BehaviourState::kOverBudget
                                         : BehaviourState::kPunctual;
    if (i < status.behaviour_state.size())
      status.behaviour_state[i].store(static_cast<std::uint32_t>(state), std::memory_order_relaxed);
    if (!input.cues.present[i]) continue;
    source.age->record(input.now_ns - cue.exposed_at_ns);
    if (command.written_at_ns == 0 || cue.exposed_at_ns == last_exposed_[i]) continue;
    source.end_to_end->record(command.written_at_ns - cue.exposed_at_ns);
    last_exposed_[i] = cue.exposed_at_ns;
  }
}

/// Tells the supervisor of a tick that missed anything.
void ControlLoop::report_miss(const Command& command, std::uint64_t skipped, bool missed) WASP_REALTIME {
  ThreadWatch& watch = *wiring_.watch;
  const bool written = command.written_at_ns != 0;
  watch.trace.record(command.computed_at_ns, rt::TraceKind::kComputed, command.tick,
                     command.computed_at_ns - command.released_at_ns);
  if (written)
    watch.trace.record(command.written_at_ns, rt::TraceKind::kWritten, command.tick,
                       command.written_at_ns - command.due_at_ns);
  const rt::ThreadUsage usage = watch.take_usage();
  if (!missed && skipped == 0 && command.refused == 0) return;
  Miss miss;
  miss.kind = skipped > 0            ? MissKind::kSkipped
              : command.refused != 0 ? MissKind::kRefused
              : written              ? MissKind::kLate
                                     : MissKind::kNotWritten;
  miss.number = command.tick;
  miss.due_at_ns = command.due_at_ns;
  miss.released_at_ns = command.released_at_ns;
  miss.computed_at_ns = command.computed_at_ns;
  miss.written_at_ns = command.written_at_ns;
  miss.late_ns = (written ? command.written_at_ns : command.computed_at_ns) - command.due_at_ns;
  if (skipped > 0) miss.late_ns += static_cast<DurationNs>(skipped) * config_.control_period_ns;
  miss.limit_ns = config_.control_deadline_ns;
  miss.skipped = skipped;
  miss.usage = usage;
  watch.report(miss);
}

const char* ControlLoop::bar_to_arming(TimeNs now_ns) WASP_REALTIME {
  if (consecutive_misses_ >= kMissesBeforeHold) punctual_from_ns_ = now_ns + kPunctualFor;
  if (now_ns < punctual_from_ns_) return "control missed its deadlines";
  if (wiring_.watch->stolen.load(std::memory_order_relaxed) != 0)
    return "control does not run as the thread table says";
  if (setup_bar_ != drivers::SetupBar::kNone) return drivers::name_of(setup_bar_);
  return nullptr;
}

void ControlLoop::announce(const Command& command, const char* bar) WASP_REALTIME {
  const auto say = [&](const char* head, const char* tail) noexcept {
    wiring_.events->say(command.released_at_ns, head, tail);
  };
  const bool other_mode = command.mode != announced_mode_, other_reason = command.reason != announced_reason_;
  if (other_mode) say("flight mode: ", control::name_of(command.mode));
  if (other_mode || other_reason) {
    if (command.mode == FlightMode::kHold) say("hold because: ", control::name_of(command.reason));
    if (command.mode == FlightMode::kManual) say("manual because: ", control::name_of(command.reason));
    if (command.mode == FlightMode::kFailsafe) say("failsafe because: ", control::name_of(command.reason));
  }
  const auto phase = static_cast<control::MissionPhase>(command.mission_phase);
  if (command.mission_phase != announced_phase_) say("mission: ", control::name_of(phase));
  if (state_.mission.early_end != announced_end_)
    say("mission ends early: ", control::name_of(state_.mission.early_end));
  const bool waiting = phase == control::MissionPhase::kWait || phase == control::MissionPhase::kArm;
  if (waiting && bar != nullptr && bar != announced_bar_) say("not arming: ", bar);
  announced_bar_ = bar;
  announced_end_ = state_.mission.early_end;
  announced_mode_ = command.mode;
  announced_reason_ = command.reason;
  announced_phase_ = command.mission_phase;
}

}  // namespace wasp::scheduling
