#include "scheduling/guardian.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>

#include "rt/clock.h"
#include "rt/process.h"
#include "rt/thread.h"
#include "types/frames.h"

namespace wasp::scheduling {
namespace {

constexpr DurationNs kHeartbeatPeriod = 1 * kSecond;
constexpr DurationNs kReopenLook = 20 * kMillisecond;

/// One line on standard error, in the form of the flight's own log; one write, nothing buffered.
void say(const std::string& text) {
  const std::string line = fmt::format("{:10.3f}  guardian: {}\n", to_seconds(rt::now()), text);
  static_cast<void>(!write(STDERR_FILENO, line.data(), line.size()));
}

int open_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int s : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) sigaddset(&set, s);
  sigprocmask(SIG_BLOCK, &set, nullptr);
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);  // a full quota for files is an error of write, not the end
  return signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
}

/// Priority above the flight's, which children do not inherit, on a core of its own; locked memory. What is refused is
/// said: a flight without real time is guarded all the same.
void rise(const GuardConfig& config) {
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(static_cast<unsigned>(rt::nearest_usable_core(config.core)), &one);
  if (config.core >= 0) sched_setaffinity(0, sizeof one, &one);
  const sched_param priority{config.priority};
  if (sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &priority) != 0)
    say(std::string("runs without real-time priority: ") + std::strerror(errno));
  if (const std::string why = rt::lock_memory(64 * 1024); !why.empty()) say("memory not locked: " + why);
}

}  // namespace

Guardian::Guardian(GuardPlan plan, std::vector<std::string> command, bool real_time)
    : plan_(std::move(plan)),
      command_(std::move(command)),
      real_time_(real_time),
      signals_fd_(open_signals()),
      port_(drivers::Endpoint::parse(plan_.autopilot.endpoint)),
      watchdog_(plan_.guard.watchdog),
      page_(GuardPage::create()),
      signing_(drivers::open_signing(plan_.autopilot.signing, drivers::LinkSigning::kGuardianLink)),
      voice_(plan_.autopilot.identity()) {
  sched_getaffinity(0, sizeof cores_, &cores_);
  if (signing_) voice_.use_signing(*signing_);
  if (!plan_.guard.neutral) plan_.guard.times.neutral_ns = 0;
  if (!real_time) {  // ordinary threads are late by the host's leave: patience for tens of milliseconds
    plan_.guard.times.patience_ns *= 5;
    plan_.guard.times.kill_after_ns *= 25;
  }
}

Guardian::~Guardian() {
  flight_.reset();
  successor_.reset();
  if (signals_fd_ >= 0) close(signals_fd_);
}

std::unique_ptr<FlightChild> Guardian::child() {
  const bool hurried = state_.ours || state_.restarted;
  return std::make_unique<FlightChild>(command_, page_.fd(), port_.fd(), cores_, hurried);
}

bool Guardian::may_restart() const { return static_cast<int>(page_.block().incarnation.load()) < plan_.guard.restarts; }

/// Of a flight that hangs and may have to be killed.
void Guardian::prepare_successor() {
  try {
    successor_ = child();
  } catch (const std::exception& e) {  // tried again when it is needed
    say(fmt::format("no successor is prepared: {}", e.what()));
  }
}

void Guardian::start() {
  GuardBlock& block = page_.block();
  block.next_due_ns.store(0);
  block.commanding.store(0);
  block.beat_at_ns.store(0);
  killed_ = reported_end_ = false;
  if (successor_ && successor_->poll()) successor_.reset();
  flight_ = successor_ ? std::move(successor_) : child();
  flight_->go();
}

int Guardian::run() {
  if (real_time_) rise(plan_.guard);
  say(fmt::format("holds {}; {} {} ms after a control release that is not served, {}{}", port_.endpoint().path,
                  plan_.guard.neutral ? "neutral" : "silence", plan_.guard.times.patience_ns / kMillisecond,
                  plan_.guard.restarts > 0 ? "a dead flight is started again and never commands" : "no restart",
                  watchdog_.present() ? "; hardware watchdog fed" : ""));
  start();
  TimeNs planned_ns = rt::now();
  for (;;) {
    wait(planned_ns);
    take_signals();
    const GuardSight seen = sight(planned_ns);
    const GuardDeed deed = guard_step(plan_.guard.times, seen, state_);
    act(deed, seen.now_ns);
    watchdog_.feed();
    tend_line();
    planned_ns = line_gone_ ? std::min(deed.look_again_at_ns, seen.now_ns + kReopenLook) : deed.look_again_at_ns;
    if (const auto end = flight_->poll(); end && !ended(*end)) {
      const bool speaking = state_.ours && rt::now() - state_.taken_at_ns < plan_.guard.times.neutral_ns;
      if (!speaking) return end->signal != 0 ? 128 + end->signal : end->code;
    }
  }
}

/// Until the time has come, the flight has ended, a signal waits or the line hangs up.
void Guardian::wait(TimeNs until_ns) {
  std::array<pollfd, 3> wanted{pollfd{signals_fd_, POLLIN, 0},
                               pollfd{flight_->poll() ? -1 : flight_->pid_fd(), POLLIN, 0},
                               pollfd{line_gone_ ? -1 : port_.fd(), 0, 0}};
  const timespec patience = rt::to_timespec(std::max<DurationNs>(until_ns - rt::now(), 0));
  ppoll(wanted.data(), wanted.size(), &patience, nullptr);
  if (wanted[2].revents != 0 && port_.hung_up(wanted[2].revents)) line_gone_ = true;
}

void Guardian::take_signals() {
  signalfd_siginfo info{};
  while (read(signals_fd_, &info, sizeof info) == sizeof info) {
    const auto number = static_cast<int>(info.ssi_signo);
    flight_->signal(number == SIGQUIT ? SIGKILL : number);
    if (number == SIGQUIT) plan_.guard.restarts = 0;
  }
}

/// A line that hung up is opened again and handed to the flight.
void Guardian::tend_line() {
  if (!line_gone_) return;
  if (!port_.try_reopen()) return;
  line_gone_ = false;
  flight_->give_line(port_.fd());
  if (successor_) successor_->give_line(port_.fd());
}

GuardSight Guardian::sight(TimeNs planned_ns) {
  const GuardBlock& block = page_.block();
  GuardSight seen;
  seen.alive = !flight_->poll();
  seen.beat_at_ns = block.beat_at_ns.load(std::memory_order_acquire);
  seen.next_due_ns = block.next_due_ns.load(std::memory_order_relaxed);
  seen.commanding = block.commanding.load(std::memory_order_relaxed) != 0;
  seen.now_ns = rt::now();
  seen.woken_late_ns = std::max<DurationNs>(seen.now_ns - planned_ns, 0);
  return seen;
}

void Guardian::act(const GuardDeed& deed, TimeNs now_ns) {
  GuardBlock& block = page_.block();
  if (deed.take) {
    block.owner.store(static_cast<std::uint32_t>(LineOwner::kGuardian));
    block.takeovers.fetch_add(1);
    heartbeat_due_ns_ = spoken_ = 0;
    if (port_.pending_output_bytes() > 0) port_.discard_output();  // the last setpoint must not come late
  }
  if (state_.ours && (deed.speak || deed.take)) speak(now_ns);
  if (deed.take)
    say(fmt::format("took the line: {} ms since the last beat", (now_ns - state_.beat_at_taking_ns) / kMillisecond));
  if (deed.take && !flight_->poll() && may_restart()) prepare_successor();
  if (deed.give_back) {
    successor_.reset();
    block.owner.store(static_cast<std::uint32_t>(LineOwner::kFlight));
    say(fmt::format("gave the line back after {} ms and {} neutral setpoints",
                    (now_ns - state_.taken_at_ns) / kMillisecond, spoken_));
  }
  if (deed.kill && !killed_) {
    killed_ = true;
    flight_->kill_at_once();
    say("the control thread does not beat: flight process killed");
  }
}

/// Heartbeat first: should the flight have died within a frame, the receiver looks for the next one there.
void Guardian::speak(TimeNs now_ns) {
  GuardBlock& block = page_.block();
  std::array<std::uint8_t, 256> out;
  std::size_t used = 0;
  if (signing_) {  // not behind the flight, which may have learned a later time from the autopilot
    signing_->follow(now_ns);
    signing_->clock().advance_to(block.signing_time.load());
  }
  if (now_ns >= heartbeat_due_ns_) {
    drivers::CompanionState state{FlightMode::kFailsafe, ModeReason::kNone, true,
                                  static_cast<std::uint8_t>(block.incarnation.load())};
    used += voice_.encode_heartbeat(state, std::span<std::uint8_t>(out).subspan(used));
    heartbeat_due_ns_ = now_ns + kHeartbeatPeriod;
  }
  if (plan_.guard.times.neutral_ns > 0) {
    const Quat q = quat_from_euler({0.f, 0.f, block.yaw_rad.load()});
    const bool by_rate = drivers::semantics_of(plan_.autopilot.wish(0.f)).heading_rate_used;
    const drivers::AttitudeTargetCommand neutral{
        {q.w(), q.x(), q.y(), q.z()}, by_rate, 0.f, block.neutral_thrust.load()};
    used += voice_.encode_attitude_target(neutral, now_ns, std::span<std::uint8_t>(out).subspan(used));
    block.setpoints.fetch_add(1);
    ++spoken_;
  }
  port_.write(std::span<const std::uint8_t>(out.data(), used));
}

/// Starts a flight that crashed again; false if it ended by itself or has had its chances.
bool Guardian::ended(const ProcessEnd& end) {
  GuardBlock& block = page_.block();
  const bool crashed = end.signal != 0 || block.commanding.load() != 0;
  if (!reported_end_ && crashed)
    say(end.signal != 0 ? fmt::format("flight process ended by signal {} ({})", end.signal, strsignal(end.signal))
                        : fmt::format("flight process ended with code {} while it commanded", end.code));
  reported_end_ = true;
  const bool ran = block.beat_at_ns.load() != 0;
  if (!crashed || !ran || !may_restart()) return false;
  block.incarnation.fetch_add(1);
  state_.restarted = true;
  try {
    start();
  } catch (const std::exception& e) {  // neutral goes on to its end
    say(fmt::format("flight process cannot be started again: {}", e.what()));
    return false;
  }
  say(fmt::format("flight process started again (pid {}); it never commands", flight_->pid()));
  return true;
}

}  // namespace wasp::scheduling
