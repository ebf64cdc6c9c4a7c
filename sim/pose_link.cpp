#include "sim/pose_link.h"

#include <cmath>
#include <numbers>
#include <string>

#include "drivers/autopilot_samples.h"

namespace wasp::sim {
namespace {

using namespace mavlink;  // NOLINT: message names
constexpr DurationNs kBeat = kSecond, kSync = 100 * kMillisecond, kAsk = 2 * kSecond, kAskSeldom = 20 * kSecond,
                     kQuiet = 10 * kSecond;
constexpr int kOften = 10;        // questions at the short interval
constexpr int kStreamsAfter = 2;  // questions before the old way of asking is tried as well
constexpr double kArmedHz = 5;    ///< of HEARTBEAT: until it says armed the vehicle is kept at the start
constexpr double kEnough = 0.7;   // of the rate asked for
constexpr std::uint8_t kStreamPosition = 6, kStreamExtra1 = 10;  // MAV_DATA_STREAM: position, attitude

float finite_or_zero(float x) { return std::isfinite(x) ? x : 0.f; }
Vec3 finite_or_zero(float x, float y, float z) { return {finite_or_zero(x), finite_or_zero(y), finite_or_zero(z)}; }

template <class Message>
TimeNs remote_ns(const Message& m) {
  if constexpr (requires { m.time_boot_ms; })
    return static_cast<TimeNs>(m.time_boot_ms) * kMillisecond;
  else if constexpr (requires { m.time_usec; })
    return m.time_usec <= INT64_MAX / 4000 ? static_cast<TimeNs>(m.time_usec) * kMicrosecond : -1;
  else
    return -1;  // carries none
}

}  // namespace

template <class Message>
void PoseLink::send(const Message& m, std::vector<std::uint8_t>& out) {
  std::array<std::uint8_t, kMaxFrame> bytes{};
  const std::size_t n = encoder_.encode(m, bytes);
  out.insert(out.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n));
}

void PoseLink::receive(std::span<const std::uint8_t> bytes, TimeNs arrived_at_ns) {
  parser_.feed(bytes, [&](const Frame& frame) { take(frame, arrived_at_ns); });
}

void PoseLink::restart() {
  parser_.reset();
  clock_.restart();
  dating_ = {};
  clock_doubted_ = false;
  beat_at_ns_ = kNever;
  asked_at_ns_.fill(0);
  beat_due_ns_ = ask_due_ns_ = 0;
  asked_ = 0;
}

void PoseLink::take(const Frame& frame, TimeNs arrived_at_ns) {
  if (frame.system_id != params_.system_id) return stranger(frame, arrived_at_ns);
  if (frame.component_id != mav_component::kCompIdAutopilot1) return;
  if (frame.is<Heartbeat>()) return heartbeat(frame.as<Heartbeat>(), arrived_at_ns);
  if (frame.is<Timesync>()) return timesync(frame.as<Timesync>(), frame, arrived_at_ns);
  if (frame.is<AttitudeQuaternion>()) return attitude(frame.as<AttitudeQuaternion>(), 0, arrived_at_ns);
  if (frame.is<Attitude>()) return attitude(frame.as<Attitude>(), 1, arrived_at_ns);
  if (!heard()) return;  // where it is means something only with whether it flies
  if (frame.is<LocalPositionNed>()) {
    const auto m = frame.as<LocalPositionNed>();
    const Eigen::Vector3d where(static_cast<double>(m.x), static_cast<double>(m.y), static_cast<double>(m.z));
    return position(m, 0, {where, finite_or_zero(m.vx, m.vy, m.vz)}, arrived_at_ns);
  }
  if (frame.is<GlobalPositionInt>()) return global_position(frame.as<GlobalPositionInt>(), arrived_at_ns);
  if (frame.is<Altitude>()) {
    const auto m = frame.as<Altitude>();
    const float up_m = std::isfinite(m.altitude_local) ? m.altitude_local : m.altitude_amsl;
    return position(m, 2, height_only(static_cast<double>(up_m), 0), arrived_at_ns);
  }
  if (frame.is<VfrHud>()) {
    const auto m = frame.as<VfrHud>();
    return position(m, 3, height_only(static_cast<double>(m.alt), m.climb), arrived_at_ns);
  }
}

ReportedPosition PoseLink::height_only(double up_m, float climb_mps) {
  return {{0, 0, -up_m}, {0, 0, -finite_or_zero(climb_mps)}};
}

/// Metres from where it was first heard, on a sphere; the height is relative to home.
void PoseLink::global_position(const GlobalPositionInt& m, TimeNs arrived_at_ns) {
  if (m.lat == 0 && m.lon == 0) return;  // no fix yet
  constexpr double kRadius_m = 6371000, kUnit_rad = 1e-7 * std::numbers::pi / 180;
  if (!has_zero_) zero_latitude_ = m.lat, zero_longitude_ = m.lon;
  has_zero_ = true;
  const double narrower = std::cos(zero_latitude_ * kUnit_rad);
  const Eigen::Vector3d where((m.lat - zero_latitude_) * kUnit_rad * kRadius_m,
                              (m.lon - zero_longitude_) * kUnit_rad * kRadius_m * narrower, -1e-3 * m.relative_alt);
  position(m, 1, {where, 0.01f * Vec3(m.vx, m.vy, m.vz)}, arrived_at_ns);
}

void PoseLink::stranger(const Frame& frame, TimeNs arrived_at_ns) {
  if (heard() || arrived_at_ns < stranger_due_ns_ || !frame.is<Heartbeat>()) return;
  stranger_due_ns_ = arrived_at_ns + kQuiet;
  pose_.say("system " + std::to_string(frame.system_id) + " speaks, not system " + std::to_string(params_.system_id) +
            ": --follow-system " + std::to_string(frame.system_id) + "?");
}

void PoseLink::heartbeat(const Heartbeat& m, TimeNs arrived_at_ns) {
  if (!heard()) pose_.say("the autopilot speaks");
  beat_at_ns_ = arrived_at_ns;
  pose_.armed((m.base_mode & mav_mode_flag::kSafetyArmed) != 0);
}

bool PoseLink::admit(Source& source, int rank, TimeNs now_ns) {
  if (!source.rank.admit(rank, now_ns)) return false;
  const bool changed = source.last_rank >= 0 && source.last_rank != rank;
  source.last_rank = rank;
  if (changed && &source == &position_) pose_.source_changed();
  return true;
}

TimeNs PoseLink::date(TimeNs remote, TimeNs arrived_at_ns) {
  if (remote < 0) return arrived_at_ns;
  switch (dating_.note(remote, arrived_at_ns)) {
    case SampleDating::News::kRestarted:
      pose_.say("the autopilot was started again");
      clock_.restart();
      pose_.restarted();
      has_zero_ = false;
      beat_at_ns_ = kNever;  // whether it is armed is to be heard anew
      asked_ = 0;
      ask_due_ns_ = 0;
      break;
    case SampleDating::News::kNotRealTime:
      pose_.say("the autopilot's clock runs at " + std::to_string(dating_.rate()) +
                " of real time: its samples are dated by their arrival");
      break;
    case SampleDating::News::kRealTime:
      pose_.say("the autopilot's clock keeps real time again");
      break;
    case SampleDating::News::kNone:
      break;
  }
  return clock_doubted_ ? arrived_at_ns : dating_.date(remote, arrived_at_ns, clock_);
}

template <class Message>
void PoseLink::attitude(const Message& m, int rank, TimeNs arrived_at_ns) {
  AttitudeSample sample;
  if (drivers::convert(m, sample) == drivers::Finiteness::kRefused) return;
  if (!admit(attitude_, rank, arrived_at_ns)) return;
  const auto& q = sample.q_ned_body;
  const auto& r = sample.rate_body_radps;
  pose_.attitude({date(remote_ns(m), arrived_at_ns), Quat(q[0], q[1], q[2], q[3]), {r[0], r[1], r[2]}}, arrived_at_ns);
}

template <class Message>
void PoseLink::position(const Message& m, int rank, const ReportedPosition& reported, TimeNs arrived_at_ns) {
  if (!reported.position_ned_m.allFinite() || reported.position_ned_m.norm() > 1e7) return;
  if (!admit(position_, rank, arrived_at_ns)) return;
  pose_.position(reported, date(remote_ns(m), arrived_at_ns), arrived_at_ns);
}

void PoseLink::timesync(const Timesync& m, const Frame& frame, TimeNs arrived_at_ns) {
  if (m.tc1 == 0) {
    send(Timesync{arrived_at_ns, m.ts1, frame.system_id, frame.component_id}, answers_);
    return;
  }
  for (TimeNs& asked : asked_at_ns_) {
    if (asked == 0 || asked != m.ts1) continue;
    asked = 0;
    const auto outcome = clock_.add({m.ts1, m.tc1, arrived_at_ns});
    clock_doubted_ = outcome == drivers::ClockOutcome::kOutlier;  // it stood still or jumped: soon known
  }
}

void PoseLink::speak(TimeNs now_ns, std::vector<std::uint8_t>& out) {
  out.insert(out.end(), answers_.begin(), answers_.end());
  answers_.clear();
  if (now_ns >= beat_due_ns_) {
    beat_due_ns_ = now_ns + kBeat;
    Heartbeat m;
    m.type = mav_type::kOnboardController;
    m.autopilot = mav_autopilot::kInvalid;
    m.system_status = mav_state::kActive;
    m.mavlink_version = 3;
    send(m, out);
  }
  if (now_ns >= sync_due_ns_) {
    sync_due_ns_ = now_ns + kSync;
    Timesync m;
    m.ts1 = now_ns;
    asked_at_ns_[next_question_++ % asked_at_ns_.size()] = now_ns;
    send(m, out);
  }
  if (heard() && now_ns >= ask_due_ns_) ask(now_ns, out);
}

/// For attitude and position, until they come often enough; then now and then, should they stop.
void PoseLink::ask(TimeNs now_ns, std::vector<std::uint8_t>& out) {
  ask_due_ns_ = now_ns + (asked_ < kOften ? kAsk : kAskSeldom);
  const double enough_hz = kEnough * params_.rate_hz;
  if (asked_ > 0 && pose_.attitude_rate_hz(now_ns) >= enough_hz && pose_.position_rate_hz(now_ns) >= enough_hz) return;
  const auto interval = [&](std::uint32_t id, double hz) {
    CommandLong m;
    m.command = mav_cmd::kSetMessageInterval;
    m.param1 = static_cast<float>(id);
    m.param2 = static_cast<float>(std::lround(1e6 / hz));
    m.target_system = params_.system_id;
    m.target_component = mav_component::kCompIdAutopilot1;
    send(m, out);
  };
  for (const std::uint32_t id : {AttitudeQuaternion::kId, Attitude::kId, LocalPositionNed::kId})
    interval(id, params_.rate_hz);
  interval(Heartbeat::kId, kArmedHz);  // ArduPilot obliges, PX4 does not
  if (++asked_ <= kStreamsAfter) return;
  for (const std::uint8_t stream : {kStreamPosition, kStreamExtra1}) {
    RequestDataStream m;
    m.req_message_rate = static_cast<std::uint16_t>(std::lround(params_.rate_hz));
    m.target_system = params_.system_id;
    m.target_component = mav_component::kCompIdAutopilot1;
    m.req_stream_id = stream;
    m.start_stop = 1;
    send(m, out);
  }
}

}  // namespace wasp::sim
