// The MAVLink conversation with the autopilot: bytes in become samples, acknowledgements and answers; setpoints and
// commands become bytes. Protocol state only: no thread, no clock, no device. Who may call what: receive, the TIMESYNC
// request and the accessors belong to one thread; the other encoders may run on any thread.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/autopilot_samples.h"
#include "drivers/clock_map.h"
#include "drivers/companion_state.h"
#include "drivers/link_signing.h"
#include "messages/mavlink_frame.h"
#include "rt/contract.h"
#include "types/messages.h"

namespace wasp::drivers {

/// Who speaks to whom. wasp shares the system id of the vehicle.
struct LinkIdentity {
  std::uint8_t system_id = 1;
  std::uint8_t component_id = mavlink::mav_component::kCompIdOnboardComputer;
  std::uint8_t autopilot_system_id = 1;
  std::uint8_t autopilot_component_id = mavlink::mav_component::kCompIdAutopilot1;
};

/// HEARTBEAT of the autopilot.
struct AutopilotStatus {
  TimeNs received_at_ns = kNever;
  std::uint32_t custom_mode = 0;  ///< PX4: main mode in bits 16-23, sub mode in 24-31; ArduPilot: the mode number
  std::uint8_t base_mode = 0;
  bool armed = false;
  std::uint8_t system_status = 0;  ///< MAV_STATE
  std::uint8_t type = 0;           ///< MAV_TYPE
  std::uint8_t autopilot = 0;      ///< MAV_AUTOPILOT
};

/// Setpoint of SET_ATTITUDE_TARGET.
struct AttitudeTargetCommand {
  std::array<float, 4> q_ned_body{1, 0, 0, 0};  ///< w x y z
  bool use_yaw_rate = false;                    ///< clears the bit "ignore yaw rate"
  float yaw_rate_radps = 0;
  float thrust = 0;  ///< 0 ... 1
};

struct LinkCounts {
  std::uint64_t own_echoes = 0;         ///< frames with our own sender ids
  std::uint64_t foreign_systems = 0;    ///< frames of other system ids
  std::uint64_t other_components = 0;   ///< frames of other components of the vehicle
  std::uint64_t not_for_us = 0;         ///< addressed to somebody else
  std::uint64_t refused_samples = 0;    ///< not finite, or a quaternion without direction
  std::uint64_t partial_samples = 0;    ///< passed on without a side channel that was not finite
  std::uint64_t outranked_samples = 0;  ///< a better message carries the same quantity
  std::uint64_t unmapped_times = 0;     ///< stamped with the arrival time: not synced yet, or a time not credible
  std::uint64_t clock_restarts = 0;     ///< the autopilot's clock jumped
  std::uint64_t reboots = 0;            ///< of those, the times a stream's own time went back: it was started again
  std::uint64_t timesync_accepted = 0, timesync_refused = 0;
};

/// Lets only the best of several messages with the same content through; a worse one steps in after a second of
/// silence.
class PreferredSource {
 public:
  /// Rank 0 is best.
  bool admit(int rank, TimeNs now_ns) WASP_REALTIME {
    if (seen_at_ns_ != kNever && rank > rank_ && now_ns - seen_at_ns_ <= kSecond) return false;
    rank_ = rank;
    seen_at_ns_ = now_ns;
    return true;
  }

 private:
  int rank_ = 0;
  TimeNs seen_at_ns_ = kNever;
};

class AutopilotLink {
 public:
  explicit AutopilotLink(const LinkIdentity& identity = {}) noexcept
      : identity_(identity), encoder_(identity.system_id, identity.component_id) {}

  /// From now on what goes out is signed and what comes in is judged; `signing` outlives this. Before the first byte only.
  void use_signing(LinkSigning& signing) noexcept {
    signing_ = &signing;
    encoder_.sign_with(signing.signer());
    parser_.check_signatures(signing.check());
  }

  /// Takes bytes that arrived at `received_at_ns`. The sink has, all noexcept: on_imu(const ImuSample&),
  /// on_attitude(const AttitudeSample&), on_heartbeat(const AutopilotStatus&), on_ack(uint16_t command, uint8_t
  /// result), on_statustext(uint8_t severity, std::string_view), reply(std::span<const uint8_t>) for frames that must
  /// go out. It may have on_frame(const mavlink::Frame&), which is then given what nobody here handles (from whomever,
  /// echoes of our own apart), commands included; without it every command addressed to us is refused. Sample times
  /// never lie after `received_at_ns`. Realtime-safe: yes if the sink is.
  template <class Sink>
  void receive(std::span<const std::uint8_t> bytes, TimeNs received_at_ns, Sink& sink) WASP_REALTIME {
    if (signing_ != nullptr) signing_->follow(received_at_ns);
    parser_.feed(bytes, [&](const mavlink::Frame& frame) noexcept {
      if (is_from_autopilot(frame))
        dispatch(frame, received_at_ns, sink);
      else
        pass_on(frame, sink);
    });
  }

  /// Any message as a frame of ours, in the one sequence of this link; 0 if `out` is too small.
  template <class Message>
  std::size_t encode(const Message& message, std::span<std::uint8_t> out) WASP_REALTIME {
    return encoder_.encode(message, out);
  }
  [[nodiscard]] const LinkIdentity& identity() const noexcept { return identity_; }

  /// SET_ATTITUDE_TARGET with type mask 7, or 3 with a yaw rate. 0 if a number is not finite or `out` is too small.
  /// `now_ns` becomes the autopilot's time once the clocks are matched.
  std::size_t encode_attitude_target(const AttitudeTargetCommand& target, TimeNs now_ns,
                                     std::span<std::uint8_t> out) WASP_REALTIME;
  /// HEARTBEAT of an onboard controller, saying of us what companion_state.h says.
  std::size_t encode_heartbeat(const CompanionState& state, std::span<std::uint8_t> out) WASP_REALTIME;
  /// COMMAND_LONG to the autopilot; repeats carry `confirmation` + 1.
  std::size_t encode_command(std::uint16_t command, const std::array<float, 7>& parameters, std::uint8_t confirmation,
                             std::span<std::uint8_t> out) WASP_REALTIME;
  std::size_t encode_arm(bool arm, std::uint8_t confirmation, std::span<std::uint8_t> out) WASP_REALTIME;
  /// Custom mode: PX4 main and sub mode (6, 0 is OFFBOARD), ArduPilot mode number and 0.
  std::size_t encode_set_mode(std::uint32_t main_mode, std::uint32_t sub_mode, std::uint8_t confirmation,
                              std::span<std::uint8_t> out) WASP_REALTIME;
  /// Asks for message `id` every `interval_ns`; negative stops it, 0 is the autopilot's default.
  std::size_t encode_message_interval(std::uint32_t id, DurationNs interval_ns, std::uint8_t confirmation,
                                      std::span<std::uint8_t> out) WASP_REALTIME;
  /// Our side of a clock exchange, at 10 Hz or less. Receiving thread only.
  std::size_t encode_timesync_request(TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME;

  [[nodiscard]] const LinkCounts& counts() const noexcept { return counts_; }
  [[nodiscard]] const mavlink::Counts& wire_counts() const noexcept { return parser_.counts(); }
  /// Nullptr when signing is off.
  [[nodiscard]] const mavlink::SignatureCounts* signature_counts() const noexcept {
    return signing_ == nullptr ? nullptr : &signing_->check().counts();
  }
  [[nodiscard]] std::span<const mavlink::SourceCounts> sources() const noexcept { return parser_.sources(); }
  [[nodiscard]] const ClockMap& clock() const noexcept { return clock_; }
  /// The line was cut and is back: partial frames, open questions and the clock map are void. Counts stay.
  void restart() WASP_REALTIME;

  /// Answers a command addressed to us by name with "not supported", for a sink that serves none, or not this one.
  template <class Sink>
  void refuse_command(const mavlink::Frame& frame, Sink& sink) WASP_REALTIME {
    mavlink::CommandAck answer;
    if (!unsupported_command(frame, answer)) return;
    send(answer, sink);
  }

 private:
  enum Stream : std::size_t { kImuStream, kAttitudeStream, kStreams };

  template <class Sink>
  void dispatch(const mavlink::Frame& frame, TimeNs received_at_ns, Sink& sink) WASP_REALTIME {
    switch (frame.message_id) {
      case mavlink::HighresImu::kId:
        return imu(frame.as<mavlink::HighresImu>(), 0, received_at_ns, sink);
      case mavlink::ScaledImu::kId:
        return imu(frame.as<mavlink::ScaledImu>(), 1, received_at_ns, sink);
      case mavlink::RawImu::kId:
        return imu(frame.as<mavlink::RawImu>(), 2, received_at_ns, sink);
      case mavlink::AttitudeQuaternion::kId:
        return attitude(frame.as<mavlink::AttitudeQuaternion>(), 0, received_at_ns, sink);
      case mavlink::Attitude::kId:
        return attitude(frame.as<mavlink::Attitude>(), 1, received_at_ns, sink);
      case mavlink::Heartbeat::kId:
        return heartbeat(frame.as<mavlink::Heartbeat>(), received_at_ns, sink);
      case mavlink::CommandAck::kId:
        return ack(frame.as<mavlink::CommandAck>(), sink);
      case mavlink::Statustext::kId:
        return statustext(frame.as<mavlink::Statustext>(), sink);
      case mavlink::Timesync::kId:
        return timesync(frame, received_at_ns, sink);
      case mavlink::Ping::kId:
        return ping(frame, sink);
      default:
        return pass_on(frame, sink);
    }
  }

  template <class Sink>
  void pass_on(const mavlink::Frame& frame, Sink& sink) WASP_REALTIME {
    if constexpr (requires { sink.on_frame(frame); }) {
      if (frame.system_id != identity_.system_id || frame.component_id != identity_.component_id) sink.on_frame(frame);
    } else {
      refuse_command(frame, sink);
    }
  }

  template <class Message, class Sink>
  void imu(const Message& message, int rank, TimeNs received_at_ns, Sink& sink) WASP_REALTIME {
    if constexpr (requires { message.id; })
      if (message.id != 0) return;  // a second sensor of the same kind
    ImuSample sample;
    if (!usable(convert(message, sample)) || !admitted(imu_source_, rank, received_at_ns)) return;
    sample.exposed_at_ns = exposed_at(kImuStream, remote_time_ns(message), received_at_ns);
    sample.sequence = imu_sequence_++;
    sink.on_imu(static_cast<const ImuSample&>(sample));
  }

  template <class Message, class Sink>
  void attitude(const Message& message, int rank, TimeNs received_at_ns, Sink& sink) WASP_REALTIME {
    AttitudeSample sample;
    if (!usable(convert(message, sample)) || !admitted(attitude_source_, rank, received_at_ns)) return;
    sample.exposed_at_ns = exposed_at(kAttitudeStream, remote_time_ns(message), received_at_ns);
    sample.sequence = attitude_sequence_++;
    sink.on_attitude(static_cast<const AttitudeSample&>(sample));
  }

  template <class Sink>
  void heartbeat(const mavlink::Heartbeat& m, TimeNs received_at_ns, Sink& sink) WASP_REALTIME {
    const bool armed = (m.base_mode & mavlink::mav_mode_flag::kSafetyArmed) != 0;
    sink.on_heartbeat(
        AutopilotStatus{received_at_ns, m.custom_mode, m.base_mode, armed, m.system_status, m.type, m.autopilot});
  }

  template <class Sink>
  void ack(const mavlink::CommandAck& m, Sink& sink) WASP_REALTIME {
    if (for_us(m.target_system, m.target_component)) sink.on_ack(m.command, m.result);
  }

  /// Texts longer than 50 bytes arrive chunk by chunk.
  template <class Sink>
  void statustext(const mavlink::Statustext& m, Sink& sink) WASP_REALTIME {
    const std::string_view text(m.text.data(), m.text.size());
    sink.on_statustext(m.severity, {text.data(), std::min(text.find('\0'), text.size())});
  }

  template <class Sink>
  void timesync(const mavlink::Frame& frame, TimeNs received_at_ns, Sink& sink) WASP_REALTIME {
    const auto m = frame.as<mavlink::Timesync>();
    if (!for_us(m.target_system, m.target_component)) return;
    if (m.tc1 != 0) return add_exchange(m, received_at_ns);
    const mavlink::Timesync answer{received_at_ns, m.ts1, frame.system_id, frame.component_id};
    send(answer, sink);
  }

  /// PING is superseded but still answered when it asks everybody.
  template <class Sink>
  void ping(const mavlink::Frame& frame, Sink& sink) WASP_REALTIME {
    auto m = frame.as<mavlink::Ping>();
    if (m.target_system != 0 || m.target_component != 0) return;
    m.target_system = frame.system_id;
    m.target_component = frame.component_id;
    send(m, sink);
  }

  template <class Message, class Sink>
  void send(const Message& message, Sink& sink) WASP_REALTIME {
    std::array<std::uint8_t, mavlink::kMaxFrame> out;
    const std::size_t n = encoder_.encode(message, out);
    sink.reply(std::span<const std::uint8_t>(out.data(), n));
  }

  /// Autopilot time of a message [ns]; -1 when it does not fit.
  template <class Message>
  static TimeNs remote_time_ns(const Message& m) WASP_REALTIME {
    if constexpr (requires { m.time_boot_ms; })
      return static_cast<TimeNs>(m.time_boot_ms) * kMillisecond;
    else
      return m.time_usec <= INT64_MAX / 4000 ? static_cast<TimeNs>(m.time_usec) * kMicrosecond : -1;
  }

  bool is_from_autopilot(const mavlink::Frame& frame) WASP_REALTIME;
  bool for_us(std::uint8_t target_system, std::uint8_t target_component) WASP_REALTIME;
  bool usable(Finiteness finiteness) WASP_REALTIME;
  bool admitted(PreferredSource& source, int rank, TimeNs received_at_ns) WASP_REALTIME;
  bool unsupported_command(const mavlink::Frame& frame, mavlink::CommandAck& answer) const WASP_REALTIME;
  void add_exchange(const mavlink::Timesync& answer, TimeNs received_at_ns) WASP_REALTIME;
  TimeNs exposed_at(Stream stream, TimeNs remote_ns, TimeNs received_at_ns) WASP_REALTIME;
  void restart_clock() WASP_REALTIME;
  void share_offset(TimeNs now_ns) WASP_REALTIME;

  LinkIdentity identity_;
  mavlink::Parser parser_;
  mavlink::Encoder encoder_;
  LinkSigning* signing_ = nullptr;
  ClockMap clock_;
  std::array<TimeNs, 8> asked_at_ns_{};  ///< ts1 of open questions, 0 when answered
  std::size_t next_question_ = 0;
  std::atomic<DurationNs> shared_offset_ns_{kNever};  ///< autopilot clock minus ours, for the encoders
  std::array<TimeNs, kStreams> last_remote_ns_{-1, -1};
  PreferredSource imu_source_, attitude_source_;
  std::uint32_t imu_sequence_ = 0, attitude_sequence_ = 0;
  LinkCounts counts_;
};

}  // namespace wasp::drivers
