#include "faults/wire_fault.h"

#include <algorithm>
#include <limits>

#include "faults/uart_line.h"
#include "messages/checksum.h"

namespace wasp::faults {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

}  // namespace

void WireMangler::feed(std::span<const std::uint8_t> bytes, TimeNs now_ns, std::vector<std::uint8_t>& out) {
  if (!by_frame()) return mangle_bytes(bytes, now_ns, out);
  parser_.feed(bytes, [&](const mavlink::Frame& frame) { mangle_frame(frame, out); });
}

void WireMangler::mangle_bytes(std::span<const std::uint8_t> bytes, TimeNs now_ns, std::vector<std::uint8_t>& out) {
  switch (fault_.kind) {
    case WireFaultKind::kSilence:
      return;
    case WireFaultKind::kNoise:
      for (std::size_t i = 0; i < bytes.size(); ++i) out.push_back(random_byte());
      return;
    case WireFaultKind::kFlip:
      for (const std::uint8_t b : bytes)
        out.push_back(static_cast<std::uint8_t>(one_in(fault_.value) ? b ^ (1u << random_.bits() % 8) : b));
      return;
    case WireFaultKind::kDrop:
      for (const std::uint8_t b : bytes)
        if (!one_in(fault_.value)) out.push_back(b);
      return;
    case WireFaultKind::kDuplicate:
      for (const std::uint8_t b : bytes) out.insert(out.end(), one_in(fault_.value) ? 2 : 1, b);
      return;
    case WireFaultKind::kDelay:
      late_.push_back({now_ns + from_seconds(fault_.value * 1e-3), {bytes.begin(), bytes.end()}});
      return;
    case WireFaultKind::kHalf:
      out.insert(out.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 2));
      return;
    case WireFaultKind::kBaud: {
      const auto heard = heard_at(bytes, 1, fault_.value);
      out.insert(out.end(), heard.begin(), heard.end());
      return;
    }
    case WireFaultKind::kReorder:
      if (held_.empty()) return held_.assign(bytes.begin(), bytes.end());
      out.insert(out.end(), bytes.begin(), bytes.end());
      out.insert(out.end(), held_.begin(), held_.end());
      return held_.clear();
    default:
      out.insert(out.end(), bytes.begin(), bytes.end());
  }
}

void WireMangler::due(TimeNs now_ns, std::vector<std::uint8_t>& out) {
  for (; !late_.empty() && late_.front().at_ns <= now_ns; late_.pop_front())
    out.insert(out.end(), late_.front().bytes.begin(), late_.front().bytes.end());
  if (fault_.kind != WireFaultKind::kFlood) return;
  if (flooded_until_ns_ == kNever) flooded_until_ns_ = now_ns;
  const auto n = static_cast<std::size_t>(to_seconds(now_ns - flooded_until_ns_) * fault_.value);
  if (n == 0) return;
  for (std::size_t i = 0; i < n; ++i) out.push_back(random_byte());
  flooded_until_ns_ = now_ns;
}

/// Adds the frame with its message changed; false if it is another message.
template <class Message, class Edit>
bool WireMangler::edit(const mavlink::Frame& frame, std::vector<std::uint8_t>& out, Edit&& change) {
  if (!frame.is<Message>()) return false;
  Message message = frame.as<Message>();
  change(message);
  const auto bytes = reframed(frame, message);
  out.insert(out.end(), bytes.begin(), bytes.end());
  return true;
}

void WireMangler::mangle_frame(const mavlink::Frame& frame, std::vector<std::uint8_t>& out) {
  using namespace mavlink;
  const auto nth = [&] { return ++seen_ % std::max<std::uint64_t>(1, static_cast<std::uint64_t>(fault_.value)) == 0; };
  const bool attitude = frame.is<AttitudeQuaternion>(), imu = frame.is<HighresImu>();
  bool changed = false;
  switch (fault_.kind) {
    case WireFaultKind::kSystemId: {
      const MessageInfo* info = find_message(frame.message_id);
      if (info == nullptr || frame.version != 2) break;
      std::vector<std::uint8_t> bytes(frame.wire.begin(), frame.wire.end());
      bytes[5] = static_cast<std::uint8_t>(fault_.value);
      const std::size_t end = kHeaderV2 + frame.length;
      const std::uint16_t crc = crc_add(crc_add(kCrcInitial, std::span(bytes).subspan(1, end - 1)), info->crc_extra);
      bytes[end] = static_cast<std::uint8_t>(crc), bytes[end + 1] = static_cast<std::uint8_t>(crc >> 8);
      out.insert(out.end(), bytes.begin(), bytes.end());
      return;
    }
    case WireFaultKind::kMode:
      changed = edit<Heartbeat>(frame, out, [&](auto& m) { m.custom_mode = static_cast<std::uint32_t>(fault_.value); });
      break;
    case WireFaultKind::kDisarmed:
      changed = edit<Heartbeat>(frame, out, [](auto& m) { m.base_mode &= static_cast<std::uint8_t>(~128); });
      break;
    case WireFaultKind::kDenyCommand:
      changed = edit<CommandAck>(frame, out, [](auto& m) { m.result = mav_result::kDenied; });
      break;
    case WireFaultKind::kNoCommand:
      changed = frame.is<CommandLong>();
      break;
    case WireFaultKind::kAttitudeNan:
      changed = edit<AttitudeQuaternion>(frame, out, [](auto& m) { m.q1 = kNan; });
      break;
    case WireFaultKind::kAttitudeFrozen:
      changed = edit<AttitudeQuaternion>(frame, out, [&](auto& m) {
        if (!frozen_known_) frozen_ = m, frozen_known_ = true;
        const auto time = m.time_boot_ms;
        m = frozen_;
        m.time_boot_ms = time;
      });
      break;
    case WireFaultKind::kAttitudeSlow:
      changed = attitude && !nth();
      break;
    case WireFaultKind::kAttitudeSpike:
      if (attitude && nth())
        changed = edit<AttitudeQuaternion>(frame, out, [](auto& m) { m.q1 = 0, m.q2 = 1, m.q3 = m.q4 = 0; });
      break;
    case WireFaultKind::kAttitudeLost:
      changed = attitude;
      break;
    case WireFaultKind::kImuNan:
      changed = edit<HighresImu>(frame, out, [](auto& m) { m.zacc = kNan; });
      break;
    case WireFaultKind::kImuHuge:
      changed = edit<HighresImu>(frame, out, [](auto& m) { m.zacc = 1e30f; });
      break;
    case WireFaultKind::kImuLost:
      changed = imu;
      break;
    case WireFaultKind::kClockStep: {
      const double s = fault_.value;
      changed =
          edit<AttitudeQuaternion>(
              frame, out, [s](auto& m) { m.time_boot_ms += static_cast<std::uint32_t>(std::int64_t(s * 1e3)); }) ||
          edit<HighresImu>(frame, out,
                           [s](auto& m) { m.time_usec += static_cast<std::uint64_t>(std::int64_t(s * 1e6)); }) ||
          edit<Timesync>(frame, out, [s](auto& m) {
            if (m.tc1 != 0) m.tc1 += from_seconds(s);
          });
      break;
    }
    default:
      break;
  }
  if (!changed) out.insert(out.end(), frame.wire.begin(), frame.wire.end());
}

}  // namespace wasp::faults
