#include "tools/link_session.h"

#include <fmt/format.h>

#include <cstdio>

#include "messages/frame_layout.h"
#include "rt/clock.h"
#include "types/frames.h"

namespace wasp::tools {
namespace {

constexpr DurationNs kTick = 20 * kMillisecond, kSetpointPeriod = 50 * kMillisecond;
constexpr float kMaxTilt_rad = 0.26f;

std::string name_of_message(std::uint32_t id) {
  const auto* info = mavlink::find_message(id);
  return info != nullptr ? info->name : fmt::format("message {}", id);
}

}  // namespace

LinkSession::LinkSession(const scheduling::AutopilotConfig& config)
    : config_(config),
      port_(drivers::Endpoint::parse(config.endpoint)),
      signing_(drivers::open_signing(config.signing, drivers::LinkSigning::kFlightLink)),
      link_(config.identity()),
      setup_(config.wish(kMaxTilt_rad), config.identity()),
      started_ns_(rt::now()) {
  if (signing_) link_.use_signing(*signing_);
}

void LinkSession::say(const std::string& text) const {
  fmt::print("{:8.2f} s  {}\n", to_seconds(rt::now() - started_ns_), text);
  std::fflush(stdout);
}

void LinkSession::listen(TimeNs until_ns) {
  std::array<std::uint8_t, 4096> buffer;
  while (port_.wait_readable(until_ns)) {
    const drivers::IoResult got = port_.read(buffer);
    if (got.status == drivers::IoStatus::kGone) {
      if (!port_.try_reopen()) rt::sleep_until(until_ns);
      return;
    }
    if (got.bytes == 0) return;
    const auto bytes = std::span<const std::uint8_t>(buffer).first(got.bytes);
    counter_.feed(bytes, [this](const mavlink::Frame& f) {
      ++messages_[{static_cast<unsigned>(f.system_id) << 8 | f.component_id, f.message_id}];
    });
    heard_ = false;
    link_.receive(bytes, rt::now(), *this);
    if (heard_) port_.adopt_peer();
  }
}

void LinkSession::on_attitude(const AttitudeSample& sample) noexcept {
  heard_ = true;
  setup_.on_attitude(rt::now());
  const auto& q = sample.q_ned_body;
  const Euler e = euler_from_quat(Quat(q[0], q[1], q[2], q[3]));
  sight_.roll_rad = e.roll_rad, sight_.pitch_rad = e.pitch_rad, sight_.yaw_rad = e.yaw_rad;
}

void LinkSession::on_heartbeat(const drivers::AutopilotStatus& status) noexcept {
  heard_ = true;
  setup_.on_heartbeat(status);
  sight_.armed = status.armed;
  sight_.follows = drivers::main_mode_of(config_.flavour, status.custom_mode) == config_.mode();
}

void LinkSession::on_ack(std::uint16_t command, std::uint8_t result) {
  if (result != 0) say(fmt::format("command {} answered with MAV_RESULT {}", command, result));
}

void LinkSession::on_statustext(std::uint8_t, std::string_view text) { say(fmt::format("autopilot: {}", text)); }

void LinkSession::on_frame(const mavlink::Frame& frame) {
  if (setup_.on_frame(frame)) return;
  const auto& own = link_.identity();
  if (frame.is<mavlink::LocalPositionNed>() && frame.system_id == own.autopilot_system_id) {
    const auto m = frame.as<mavlink::LocalPositionNed>();
    sight_.height_m = -m.z;
    sight_.climb_mps = -m.vz;
  }
  link_.refuse_command(frame, *this);
}

void LinkSession::ask(TimeNs now_ns) {
  std::array<std::uint8_t, mavlink::kMaxFrame> out;
  const auto send = [&](std::size_t n) { port_.write(std::span<const std::uint8_t>(out).first(n)); };
  if (now_ns >= heartbeat_due_ns_) {
    send(link_.encode_heartbeat({}, out));
    heartbeat_due_ns_ = now_ns + kSecond;
  }
  if (now_ns >= timesync_due_ns_) {
    send(link_.encode_timesync_request(now_ns, out));
    timesync_due_ns_ = now_ns + 200 * kMillisecond;
  }
  if (const std::size_t n = setup_.next_question(now_ns, link_, out); n != 0) send(n);
  drivers::TextLine line;
  bool verdict = false;
  if (setup_.take_news(line, verdict)) say(std::string(line.view()));
}

/// What bars arming bars nothing once it is armed: a vehicle in the air is flown on.
bool LinkSession::barred() const { return setup_.bar() != drivers::SetupBar::kNone && !sight_.armed; }

void LinkSession::fly(TimeNs now_ns, BenchFlight& flight) {
  if (now_ns < setpoint_due_ns_ || barred()) return;
  setpoint_due_ns_ = std::max(setpoint_due_ns_ + kSetpointPeriod, now_ns);
  sight_.now_ns = now_ns;
  sight_.force_up_mps2 = force_up_mps2_;
  const BenchWish wish = flight.step(sight_, setup_.semantics());
  if (const std::string news = flight.take_news(); !news.empty()) say(news);
  std::array<std::uint8_t, mavlink::kMaxFrame> out;
  const auto send = [&](std::size_t n) { port_.write(std::span<const std::uint8_t>(out).first(n)); };
  if (wish.send) send(link_.encode_attitude_target(wish.setpoint, now_ns, out));
  if (wish.ask_mode) send(link_.encode_set_mode(config_.mode(), 0, 0, out));
  if (wish.ask_arm || wish.ask_disarm) send(link_.encode_arm(wish.ask_arm, 0, out));
}

void LinkSession::run(double seconds, BenchFlight* flight) {
  const TimeNs end_ns = rt::now() + from_seconds(seconds);
  TimeNs next_ns = rt::now();
  while (flight != nullptr ? !flight->over() : rt::now() < end_ns) {
    const TimeNs now_ns = rt::now();
    ask(now_ns);
    if (flight != nullptr) {
      fly(now_ns, *flight);
      if (barred() && now_ns > end_ns) return say(fmt::format("not flying: {}", drivers::name_of(setup_.bar())));
    }
    next_ns = std::max(next_ns + kTick, now_ns);
    listen(next_ns);
  }
}

bool LinkSession::report() const {
  const double seconds = to_seconds(rt::now() - started_ns_);
  fmt::print("\n{:>7} {:>9}  {:<24} {:>8}\n", "system", "component", "message", "per s");
  for (const auto& [key, count] : messages_)
    fmt::print("{:>7} {:>9}  {:<24} {:>8.1f}\n", key.first >> 8, key.first & 0xff, name_of_message(key.second),
               static_cast<double>(count) / seconds);
  const auto& wire = counter_.counts();
  fmt::print("bytes {}, good frames {}, bad checksums {}, unknown ids {}, lost by sequence {}\n", wire.bytes, wire.good,
             wire.bad_crc, wire.unknown_id, wire.sequence_lost);
  if (link_.clock().synced())
    fmt::print("clock: autopilot - ours {:.6f} s, least round trip {:.2f} ms, drift {:.1f} ppm\n",
               to_seconds(link_.clock().offset_at(rt::now())),
               static_cast<double>(link_.clock().least_round_trip_ns()) * 1e-6, link_.clock().drift() * 1e6);
  else
    fmt::print("clock: not synchronised ({} answers refused)\n", link_.counts().timesync_refused);
  if (setup_.bar() == drivers::SetupBar::kNone) {
    fmt::print("verdict: it can be flown by setpoints\n");
    return true;
  }
  fmt::print("verdict: not to be armed, {}\n", drivers::name_of(setup_.bar()));
  if (!setup_.verdict().refusal.empty()) fmt::print("  {}\n", setup_.verdict().refusal.view());
  return false;
}

}  // namespace wasp::tools
