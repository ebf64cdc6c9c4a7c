#include "scheduling/link_loop.h"

#include "rt/clock.h"
#include "shm/topics.h"

namespace wasp::scheduling {
namespace {
constexpr DurationNs kPatience = 20 * kMillisecond;  // longest sleep: the stop flag is seen by then
constexpr DurationNs kTimesyncPeriod = 200 * kMillisecond;
constexpr DurationNs kReopenPeriod = 50 * kMillisecond;
constexpr int kRoomForReply_bytes = 1024;  // pending output below which an answer may go out
constexpr int kReadsPerWake = 8;
}  // namespace

LinkLoop::LinkLoop(const shm::Region& flight, drivers::SerialPort& port, drivers::AutopilotLink& autopilot,
                   StageTable& stages, rt::Seqlock<LinkReport>& report, EventQueue& events, ThreadWatch& watch)
    : port_(port),
      autopilot_(autopilot),
      imu_(flight, shm::kImu, "Imu"),
      attitude_(flight, shm::kAttitude, "Attitude"),
      age_(stages.add("link", "imu age", 0)),
      compute_(stages.add("link", "compute", watch.budget_ns)),
      report_(report),
      events_(events),
      watch_(watch) {}

void LinkLoop::run(LoopControl& control) {
  RealtimeLoop loop(control, watch_);
  faults_.use(control.faults);
  while (loop.tick()) {
    if (gone_)
      reopen(control);
    else
      serve(control);
  }
}

void LinkLoop::serve(LoopControl& control) WASP_REALTIME {
  ask_for_time(rt::now());
  if (!port_.wait_readable(rt::now() + kPatience)) return;
  const TimeNs woken_ns = rt::now();
  take(control);
  const TimeNs done_ns = rt::now();
  compute_->record(done_ns - woken_ns);
  watch_.trace.record(done_ns, rt::TraceKind::kDone, 0, done_ns - woken_ns);
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
    if (heartbeat_seen_ && heard_) {  // before the first heartbeat `armed` would be a guess
      now_.heard_at_ns = received_at_ns_;
      report_.store(now_);
    }
  }
  control.status->bad_frames.store(autopilot_.wire_counts().bad_crc, std::memory_order_relaxed);
}

void LinkLoop::ask_for_time(TimeNs now_ns) WASP_REALTIME {
  if (now_ns < timesync_due_ns_) return;
  timesync_due_ns_ = now_ns + kTimesyncPeriod;
  std::array<std::uint8_t, mavlink::kMaxFrame> out;
  reply(std::span<const std::uint8_t>(out.data(), autopilot_.encode_timesync_request(now_ns, out)));
}

void LinkLoop::reopen(LoopControl& control) {
  const rt::NonRealtimeSection opening;  // nothing waits for a line that is gone
  rt::sleep_until(rt::now() + kReopenPeriod);
  if (!port_.try_reopen()) return;
  gone_ = false;
  autopilot_.restart();
  control.status->link_reconnects.fetch_add(1, std::memory_order_relaxed);
  events_.say(rt::now(), "serial line reopened");
}

void LinkLoop::on_imu(const ImuSample& received) WASP_REALTIME {
  heard_ = true;
  ImuSample sample = received;
  if (!faults_.pass(sample, received_at_ns_)) return;
  imu_.write(sample, received_at_ns_);
  age_->record(received_at_ns_ - sample.exposed_at_ns);
}

void LinkLoop::on_attitude(const AttitudeSample& received) WASP_REALTIME {
  heard_ = true;
  AttitudeSample sample = received;
  if (!faults_.pass(sample, received_at_ns_)) return;
  attitude_.write(sample, received_at_ns_);
}

void LinkLoop::on_heartbeat(const drivers::AutopilotStatus& status) WASP_REALTIME {
  heartbeat_seen_ = heard_ = true;
  now_.armed = status.armed ? 1 : 0;
  now_.custom_mode = status.custom_mode;
}

void LinkLoop::on_ack(std::uint16_t command, std::uint8_t result) WASP_REALTIME {
  if (result == 1) events_.say(received_at_ns_, "autopilot not yet ready for command ", static_cast<long>(command));
  if (result > 1) events_.say(received_at_ns_, "autopilot refused command ", static_cast<long>(command));
}

void LinkLoop::on_statustext(std::uint8_t, std::string_view text) WASP_REALTIME {
  events_.say(received_at_ns_, "autopilot: ", text);
}

void LinkLoop::reply(std::span<const std::uint8_t> bytes) WASP_REALTIME {
  if (port_.pending_output_bytes() < kRoomForReply_bytes) port_.write(bytes);
}

}  // namespace wasp::scheduling
