#include "scheduling/link_loop.h"

#include <algorithm>
#include <cmath>

#include "drivers/text_line.h"
#include "rt/clock.h"
#include "shm/topics.h"
#include "types/position_sample.h"

namespace wasp::scheduling {
namespace {
constexpr DurationNs kPatience = 20 * kMillisecond;  // longest sleep: the stop flag is seen by then
constexpr DurationNs kTimesyncPeriod = 200 * kMillisecond;
constexpr DurationNs kReopenPeriod = 50 * kMillisecond;
constexpr DurationNs kPatienceWithFrames = 2 * kSecond;  // bytes come, frames do not: say so
constexpr std::uint64_t kSenselessBytes = 200;
constexpr std::size_t kQuestionBytes = 60;  // of a command, signed
constexpr int kReadsPerWake = 8;
constexpr DurationNs kQuiet = 1 * kSecond;            // after it a refusal is news again
constexpr DurationNs kRefusalNews = 10 * kSecond;     // the same refusal of a command is said again after it
constexpr DurationNs kStranger = 300 * kMillisecond;  // others speak, the autopilot does not: say so
constexpr DurationNs kStrangerPeriod = 10 * kSecond;
constexpr DurationNs kMovedAfter = 2 * kSecond;  // a datagram peer so long silent may come back from another port
constexpr DurationNs kAutopilotBeat = 200 * kMillisecond;
constexpr DurationNs kCredible = 500 * kMillisecond;  // age of a position at its arrival
}  // namespace

LinkLoop::LinkLoop(const shm::Region& flight, drivers::LinePort& port, drivers::AutopilotLink& autopilot,
                   StageTable& stages, rt::Seqlock<LinkReport>& report, EventQueue& events, ThreadWatch& watch,
                   const drivers::SetupWish& wish, const LinkServices& services)
    : port_(port),
      autopilot_(autopilot),
      imu_(flight, shm::kImu, "Imu"),
      attitude_(flight, shm::kAttitude, "Attitude"),
      position_(flight, shm::kPosition, "Position"),
      commands_(flight, shm::kCommand, "Command"),
      services_(services),
      gate_(services.gate),
      age_(stages.add("link", "imu age", 0)),
      compute_(stages.add("link", "compute", watch.budget_ns)),
      report_(report),
      events_(events),
      watch_(watch),
      setup_(wish, autopilot.identity()) {}

void LinkLoop::run(LoopControl& control) {
  RealtimeLoop loop(control, watch_);
  faults_.use(control.faults);
  opened_at_ns_ = understood_at_ns_ = rt::now();
  while (loop.tick()) {
    if (gone_)
      reopen(control);
    else
      serve(control);
  }
}

void LinkLoop::serve(LoopControl& control) WASP_REALTIME {
  if (rt::now() > peer_until_ns_) port_.forget_peer();
  const bool readable = port_.wait_readable(rt::now() + kPatience);
  const TimeNs woken_ns = rt::now();
  look_at_line();
  if (readable) take(control);
  if (gone_) return;
  ask_for_time(woken_ns);
  set_up(woken_ns, *control.status);
  speak();
  if (!readable) return;
  const TimeNs done_ns = rt::now();
  compute_->record(done_ns - woken_ns);
  watch_.trace.record(done_ns, rt::TraceKind::kDone, 0, done_ns - woken_ns);
}

/// When the next setpoint falls due, and until when the line is busy.
void LinkLoop::look_at_line() WASP_REALTIME {
  const TimeNs now_ns = rt::now();
  gate_.look(port_.written_total(), now_ns);
  Command command;
  // One that sends nothing while it is on the ground will hardly begin within a period.
  const bool ticks = commands_.copy_newest(command) && command.sent != 0 &&
                     now_ns - command.due_at_ns < 3 * services_.control_period_ns;
  gate_.next_setpoint(ticks ? command.due_at_ns + services_.control_period_ns : kNever);
}

/// Telemetry, as far as there is room.
void LinkLoop::speak() WASP_REALTIME {
  if (services_.telemetry == nullptr) return;
  services_.telemetry->serve(rt::now(), gate_, [this](std::span<const std::uint8_t> bytes) noexcept {
    port_.write(bytes);
    gate_.look(port_.written_total(), rt::now());
  });
}

/// What has arrived, until the line is empty.
void LinkLoop::take(LoopControl& control) WASP_REALTIME {
  for (int i = 0; i < kReadsPerWake; ++i) {  // bounded: a flood cannot hold this thread for ever
    const drivers::IoResult got = port_.read(buffer_);
    if (got.status == drivers::IoStatus::kGone) {
      gone_ = true;
      events_.say(rt::now(), "serial line gone: ", port_.endpoint().path);
    }
    if (got.bytes == 0) break;
    received_at_ns_ = rt::now();
    heard_ = false;
    autopilot_.receive(std::span<const std::uint8_t>(buffer_.data(), got.bytes), received_at_ns_, *this);
    if (heard_) {
      peer_until_ns_ = received_at_ns_ + kMovedAfter;
      port_.adopt_peer();
    }
    if (heartbeat_seen_ && heard_) {  // before the first heartbeat `armed` would be a guess
      now_.heard_at_ns = received_at_ns_;
      report_.store(now_);
    }
  }
  watch_for_sense(received_at_ns_);
  control.status->bad_frames.store(autopilot_.wire_counts().bad_crc, std::memory_order_relaxed);
  watch_the_other_side(*control.status);
  watch_signatures();
  ask_for_beats();
}

/// Bytes without a single frame among them come of a wrong baud rate, or of a device that is no autopilot.
void LinkLoop::watch_for_sense(TimeNs now_ns) WASP_REALTIME {
  const mavlink::Counts& counts = autopilot_.wire_counts();
  if (counts.good != frames_understood_) {
    frames_understood_ = counts.good;
    bytes_understood_ = counts.bytes;
    understood_at_ns_ = now_ns;
    sense_missed_ = false;
    return;
  }
  const std::uint64_t bytes = counts.bytes - bytes_understood_;
  if (sense_missed_ || bytes < kSenselessBytes || now_ns - understood_at_ns_ < kPatienceWithFrames) return;
  sense_missed_ = true;
  drivers::TextLine words;
  words << static_cast<double>(bytes) << " bytes but no frame (" << static_cast<double>(counts.good)
        << " before): wrong baud rate?";
  events_.say(now_ns, "the autopilot's line: ", words.view());
}

/// What the driver counts and somebody must hear of: samples without numbers, a clock that began anew, strangers in the
/// autopilot's place.
void LinkLoop::watch_the_other_side(RunStatus& status) WASP_REALTIME {
  const drivers::LinkCounts& now = autopilot_.counts();
  status.samples_refused.store(implausible_ + now.refused_samples, std::memory_order_relaxed);
  if (now.refused_samples != seen_.refused_samples) tell(drivers::SampleFault::kNotFinite, "sample refused: ", driver_);
  if (now.clock_restarts != seen_.clock_restarts && received_at_ns_ >= clock_due_ns_) {
    events_.say(received_at_ns_, "the autopilot's clock began anew: it was started again, or its time was set");
    clock_due_ns_ = received_at_ns_ + kQuiet;
  }
  if (now.clock_restarts != seen_.clock_restarts) beats_asked_ = false;
  if (now.reboots != seen_.reboots) setup_.restart();
  const bool silent = !heard_ && received_at_ns_ - std::max(now_.heard_at_ns, opened_at_ns_) > kStranger;
  if (now.foreign_systems != seen_.foreign_systems && silent && received_at_ns_ >= stranger_due_ns_) {
    drivers::TextLine words;
    words << "id";
    for (const mavlink::SourceCounts& source : autopilot_.sources())
      if (source.system_id != autopilot_.identity().autopilot_system_id)
        words << " " << static_cast<double>(source.system_id);
    words << ": [autopilot] system_id?";
    events_.say(received_at_ns_, "the autopilot is silent, but another system speaks, ", words.view());
    stranger_due_ns_ = received_at_ns_ + kStrangerPeriod;
  }
  seen_ = now;
}

/// Says why frames of a signed line were refused, once a burst.
void LinkLoop::watch_signatures() WASP_REALTIME {
  const mavlink::SignatureCounts* now = autopilot_.signature_counts();
  if (now == nullptr) return;
  const std::string_view why = drivers::refusal_since(signatures_seen_, *now);
  signatures_seen_ = *now;
  if (why.empty()) return;
  const bool news = why != refusal_told_ || received_at_ns_ >= refusal_until_ns_;
  refusal_told_ = why;
  refusal_until_ns_ = received_at_ns_ + kQuiet;
  if (news) events_.say(received_at_ns_, "frame refused: ", why);
}

/// Says what is wrong with a stream's samples, once a burst.
void LinkLoop::tell(drivers::SampleFault fault, std::string_view head, Told& told) WASP_REALTIME {
  const bool news = fault != told.fault || received_at_ns_ >= told.until_ns;
  told = {fault, received_at_ns_ + kQuiet};
  if (news) events_.say(received_at_ns_, head, drivers::name_of(fault));
}

/// Counts and tells of a sample that must not be used.
bool LinkLoop::usable(drivers::SampleFault fault, std::string_view head, Told& told) WASP_REALTIME {
  if (fault == drivers::SampleFault::kNone) return true;
  ++implausible_;
  tell(fault, head, told);
  return false;
}

/// Asks the autopilot what it is and what it needs, and tells control and the log.
void LinkLoop::set_up(TimeNs now_ns, RunStatus& status) WASP_REALTIME {
  std::array<std::uint8_t, mavlink::kMaxFrame> out;
  if (gate_.fits(kQuestionBytes, now_ns))
    if (const std::size_t n = setup_.next_question(now_ns, autopilot_, out); n != 0)
      reply(std::span<const std::uint8_t>(out.data(), n));
  drivers::TextLine line;
  bool verdict = false;
  if (setup_.take_news(line, verdict)) events_.say(now_ns, line.view());
  for (std::size_t i = 0; verdict && i + 1 < status.autopilot.size(); ++i)
    status.autopilot[i].store(i < line.view().size() ? line.view()[i] : '\0', std::memory_order_relaxed);
  now_.setup_bar = setup_.bar();
  now_.semantics = setup_.semantics();
  if (!heartbeat_seen_) report_.store(now_);  // so that control can say what it waits for
}

/// Of an autopilot that is not asked by the setup: its mode and arming are to be known within half a second; by itself
/// it says them once a second.
void LinkLoop::ask_for_beats() WASP_REALTIME {
  if (beats_asked_ || setup_.active() || !heartbeat_seen_ || !gate_.fits(2 * kQuestionBytes, received_at_ns_)) return;
  beats_asked_ = true;
  std::array<std::uint8_t, mavlink::kMaxFrame> out;
  const std::size_t n = autopilot_.encode_message_interval(mavlink::Heartbeat::kId, kAutopilotBeat, 0, out);
  reply(std::span<const std::uint8_t>(out.data(), n));
  if (services_.position_period_ns <= 0) return;
  const std::size_t m =
      autopilot_.encode_message_interval(mavlink::LocalPositionNed::kId, services_.position_period_ns, 0, out);
  reply(std::span<const std::uint8_t>(out.data(), m));
}

/// Again at the next wake-up where there is no room now.
void LinkLoop::ask_for_time(TimeNs now_ns) WASP_REALTIME {
  constexpr std::size_t kSize = mavlink::Timesync::kMaxLength + mavlink::kMaxFrame - mavlink::kMaxPayload;
  if (now_ns < timesync_due_ns_ || !gate_.fits(kSize, now_ns)) return;
  timesync_due_ns_ = now_ns + kTimesyncPeriod;
  std::array<std::uint8_t, mavlink::kMaxFrame> out;
  reply(std::span<const std::uint8_t>(out.data(), autopilot_.encode_timesync_request(now_ns, out)));
}

void LinkLoop::reopen(LoopControl& control) {
  const rt::NonRealtimeSection opening;  // nothing waits for a line that is gone
  rt::sleep_until(rt::now() + kReopenPeriod);
  if (!port_.try_reopen()) return;
  gone_ = beats_asked_ = sense_missed_ = false;
  opened_at_ns_ = understood_at_ns_ = rt::now();
  autopilot_.restart();
  control.status->link_reconnects.fetch_add(1, std::memory_order_relaxed);
  events_.say(rt::now(), "serial line reopened");
}

void LinkLoop::on_imu(const ImuSample& received) WASP_REALTIME {
  heard_ = true;
  ImuSample sample = received;
  if (!faults_.pass(sample, received_at_ns_)) return;
  if (!usable(imu_judge_.judge(sample, received_at_ns_), "imu refused: ", imu_told_)) return;
  corrector_.apply(sample);
  imu_.write(sample, received_at_ns_);
  if (services_.telemetry != nullptr) services_.telemetry->note(sample);
  age_->record(received_at_ns_ - sample.exposed_at_ns);
}

void LinkLoop::on_attitude(const AttitudeSample& received) WASP_REALTIME {
  heard_ = true;
  AttitudeSample sample = received;
  if (!faults_.pass(sample, received_at_ns_)) return;
  if (!usable(attitude_judge_.judge(sample, received_at_ns_), "attitude refused: ", attitude_told_)) return;
  attitude_.write(sample, received_at_ns_);
  setup_.on_attitude(received_at_ns_);
}

void LinkLoop::on_heartbeat(const drivers::AutopilotStatus& status) WASP_REALTIME {
  heartbeat_seen_ = heard_ = true;
  now_.armed = status.armed ? 1 : 0;
  now_.custom_mode = status.custom_mode;
  setup_.on_heartbeat(status);
}

void LinkLoop::on_ack(std::uint16_t command, std::uint8_t result) WASP_REALTIME {
  using namespace mavlink;  // NOLINT: its enumerations
  if (result == mav_result::kAccepted || result == mav_result::kInProgress) return;
  const bool news = command != refused_command_ || result != refused_result_ || received_at_ns_ >= refused_until_ns_;
  if (!news) return;
  refused_command_ = command, refused_result_ = result, refused_until_ns_ = received_at_ns_ + kRefusalNews;
  if (result == mav_result::kTemporarilyRejected)
    return events_.say(received_at_ns_, "autopilot not yet ready for command ", static_cast<long>(command));
  const std::string_view what =
      command == mav_cmd::kComponentArmDisarm   ? "autopilot refuses to arm or disarm, MAV_RESULT "
      : command == mav_cmd::kDoSetMode          ? "autopilot refuses our mode, MAV_RESULT "
      : command == mav_cmd::kSetMessageInterval ? "autopilot keeps its own rate of a message, MAV_RESULT "
                                                : "autopilot refuses a command, MAV_RESULT ";
  events_.say(received_at_ns_, what, static_cast<long>(result));
}

void LinkLoop::on_statustext(std::uint8_t, std::string_view text) WASP_REALTIME {
  events_.say(received_at_ns_, "autopilot: ", text);
}

/// What the link does not handle itself: where the vehicle is, what it says of itself, and what others ask of us.
void LinkLoop::on_frame(const mavlink::Frame& frame) WASP_REALTIME {
  if (setup_.on_frame(frame)) return;
  const auto& self = autopilot_.identity();
  const bool autopilot =
      frame.system_id == self.autopilot_system_id && frame.component_id == self.autopilot_component_id;
  if (autopilot && frame.is<mavlink::LocalPositionNed>()) note_position(frame.as<mavlink::LocalPositionNed>());
  if (services_.telemetry != nullptr)
    services_.telemetry->receive(frame, received_at_ns_);
  else
    autopilot_.refuse_command(frame, *this);
}

void LinkLoop::note_position(const mavlink::LocalPositionNed& m) WASP_REALTIME {
  PositionSample sample;
  sample.position_ned_m = {m.x, m.y, m.z};
  sample.velocity_ned_mps = {m.vx, m.vy, m.vz};
  for (std::size_t i = 0; i < 3; ++i)
    if (!std::isfinite(sample.position_ned_m[i]) || !std::isfinite(sample.velocity_ned_mps[i])) return;
  const TimeNs remote_ns = static_cast<TimeNs>(m.time_boot_ms) * kMillisecond;
  const TimeNs mapped_ns = autopilot_.clock().synced() ? autopilot_.clock().to_local(remote_ns) : received_at_ns_;
  const bool credible = mapped_ns <= received_at_ns_ && received_at_ns_ - mapped_ns < kCredible;
  sample.exposed_at_ns = credible ? mapped_ns : received_at_ns_;
  sample.sequence = positions_++;
  sample.armed = now_.armed;
  position_.write(sample, received_at_ns_);
}

/// Whole, and before the next setpoint is due, or not at all: who asked asks again.
void LinkLoop::reply(std::span<const std::uint8_t> bytes) WASP_REALTIME {
  if (!gate_.fits(bytes.size(), rt::now())) return;
  port_.write(bytes);
  gate_.look(port_.written_total(), rt::now());
}

}  // namespace wasp::scheduling
