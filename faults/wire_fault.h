// What can be done to the bytes of one direction on their way: a pure function of bytes and time, with a seed.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <string_view>
#include <vector>

#include "faults/wire_log.h"
#include "messages/mavlink_frame.h"
#include "sim/random.h"

namespace wasp::faults {

enum class WireFaultKind : std::uint8_t {
  // Bytes; `value` says how many.
  kSilence,    ///< nothing passes
  kFlood,      ///< random bytes besides, `value` a second
  kNoise,      ///< random bytes in the place of the true ones
  kFlip,       ///< one bit of one byte in `value`
  kDrop,       ///< one byte in `value` is lost
  kDuplicate,  ///< one byte in `value` comes twice
  kDelay,      ///< all of it `value` ms later
  kHalf,       ///< the second half of every chunk is lost
  kBaud,       ///< the receiver listens at `value` times the sender's rate
  kReorder,    ///< neighbouring chunks change places
  // Frames, rewritten with a new checksum.
  kSystemId,        ///< the sender's system id becomes `value`
  kMode,            ///< HEARTBEAT.custom_mode becomes `value`
  kDisarmed,        ///< HEARTBEAT says not armed
  kDenyCommand,     ///< COMMAND_ACK denied
  kNoCommand,       ///< COMMAND_LONG is lost
  kAttitudeNan,     ///< ATTITUDE_QUATERNION.q1 is not a number
  kAttitudeFrozen,  ///< its numbers stay what they were; its time goes on
  kAttitudeSlow,    ///< only one in `value` passes
  kAttitudeSpike,   ///< every `value`-th says upside down
  kAttitudeLost,    ///< none passes
  kImuNan,          ///< HIGHRES_IMU.zacc is not a number
  kImuHuge,         ///< ... is 1e30
  kImuLost,         ///< none passes
  kClockStep,       ///< every time stamp `value` s later
};

struct WireFault {
  WireFaultKind kind = WireFaultKind::kSilence;
  Direction direction = Direction::kToFlight;
  double value = 0;
  std::uint32_t seed = 1;
};

class WireMangler {
 public:
  explicit WireMangler(const WireFault& fault) : fault_(fault), random_(fault.seed) {}

  /// Bytes that arrived at `now_ns`; what goes on at once is added to `out`.
  void feed(std::span<const std::uint8_t> bytes, TimeNs now_ns, std::vector<std::uint8_t>& out);
  /// What has become due by `now_ns` (delays, floods).
  void due(TimeNs now_ns, std::vector<std::uint8_t>& out);
  [[nodiscard]] const WireFault& fault() const { return fault_; }

 private:
  struct Late {
    TimeNs at_ns = 0;
    std::vector<std::uint8_t> bytes;
  };
  [[nodiscard]] bool by_frame() const { return fault_.kind >= WireFaultKind::kSystemId; }
  void mangle_bytes(std::span<const std::uint8_t> bytes, TimeNs now_ns, std::vector<std::uint8_t>& out);
  void mangle_frame(const mavlink::Frame& frame, std::vector<std::uint8_t>& out);
  template <class Message, class Edit>
  bool edit(const mavlink::Frame& frame, std::vector<std::uint8_t>& out, Edit&& change);
  [[nodiscard]] bool one_in(double n) { return random_.uniform() * n < 1; }
  std::uint8_t random_byte() { return static_cast<std::uint8_t>(random_.bits()); }

  WireFault fault_;
  sim::Random random_;
  mavlink::Parser parser_;
  std::deque<Late> late_;
  std::vector<std::uint8_t> held_;
  TimeNs flooded_until_ns_ = kNever;
  std::uint64_t seen_ = 0;
  bool frozen_known_ = false;
  mavlink::AttitudeQuaternion frozen_{};
};

/// A frame with the payload of `message`, version 2, the sender and sequence of `like`, and a checksum that holds.
template <class Message>
std::vector<std::uint8_t> reframed(const mavlink::Frame& like, const Message& message) {
  mavlink::Encoder encoder(like.system_id, like.component_id);
  encoder.set_sequence(like.sequence);
  std::vector<std::uint8_t> bytes(mavlink::kMaxFrame);
  bytes.resize(encoder.encode(message, bytes));
  return bytes;
}

}  // namespace wasp::faults
