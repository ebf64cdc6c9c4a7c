// The MAVLink parser and the conversation above it. An input is either a byte stream as it is, or a script of frames
// whose checksums are made right here, since a fuzzer never hits one: only so do payloads reach the conversation.
// Promises: however a stream is cut into pieces, the same frames come out; each has its checksum by another
// implementation; samples are finite and never of the future; what is answered is one good frame. On a signed line, with a
// key that the input may know, only what is rightly signed comes out, and the times of a stream rise.
#include <cmath>
#include <vector>

#include "messages/signature_check.h"

#include "drivers/autopilot_link.h"
#include "tests/fuzz/bitwise_crc.h"
#include "tests/fuzz/fuzz_input.h"

namespace wasp {
namespace {

using fuzz::FuzzInput;
using fuzz::require;

struct Sink {
  TimeNs received_at_ns = 0;
  mavlink::Parser replies;

  template <class Numbers>
  static bool finite(const Numbers& numbers) noexcept {
    for (const float x : numbers)
      if (!std::isfinite(x)) return false;
    return true;
  }
  void on_imu(const ImuSample& s) noexcept {
    require(finite(s.accel_body_mps2) && finite(s.gyro_body_radps) && finite(s.mag_body_gauss) &&
                std::isfinite(s.pressure_hpa) && std::isfinite(s.temperature_degc),
            "IMU samples are finite");
    require(s.exposed_at_ns <= received_at_ns, "no sample of the future");
  }
  void on_attitude(const AttitudeSample& s) noexcept {
    require(finite(s.q_ned_body) && finite(s.rate_body_radps), "attitude samples are finite");
    require(s.exposed_at_ns <= received_at_ns, "no sample of the future");
  }
  void on_heartbeat(const drivers::AutopilotStatus& s) noexcept {
    require(s.received_at_ns == received_at_ns, "a heartbeat is of now");
  }
  void on_ack(std::uint16_t, std::uint8_t) noexcept {}
  void on_statustext(std::uint8_t, std::string_view text) noexcept {
    require(text.size() <= 50 && text.find('\0') == std::string_view::npos, "texts end where they end");
  }
  void reply(std::span<const std::uint8_t> frame) noexcept {
    int good = 0;
    replies.feed(frame, [&](const mavlink::Frame& f) noexcept { good += f.wire.size() == frame.size() ? 1 : 0; });
    require(good == 1, "an answer is one good frame");
  }
};

std::uint64_t mixed(std::uint64_t h, std::uint64_t value) { return (h ^ value) * 0x9E3779B97F4A7C15ull; }

/// Lengths of the pieces a stream arrives in, 1 ... 64 bytes and sometimes far more.
class Pieces {
 public:
  explicit Pieces(std::uint64_t seed) : state_(seed) {}
  std::size_t next() {
    state_ = mixed(state_, state_ >> 29) + 1;
    return (state_ >> 40) % 8 == 0 ? 1500 : 1 + (state_ >> 48) % 64;
  }

 private:
  std::uint64_t state_;
};

struct Accepted {
  std::uint64_t count = 0, digest = 0;
  bool operator==(const Accepted&) const = default;

  void add(const mavlink::Frame& frame) {
    const mavlink::MessageInfo* info = mavlink::find_message(frame.message_id);
    require(info != nullptr && fuzz::is_whole_frame(frame.wire, info->crc_extra), "accepted frames have a checksum");
    require(frame.payload + frame.length + 2 <= frame.wire.data() + frame.wire.size(), "a payload lies in its frame");
    ++count;
    for (const std::uint8_t byte : frame.wire) digest = mixed(digest, byte);
  }
};

/// Feeds the stream in one go and in pieces; both must hand out the same.
void check_stream(std::span<const std::uint8_t> stream, std::uint64_t seed) {
  mavlink::Parser at_once, in_pieces;
  Accepted first, second;
  at_once.feed(stream, [&](const mavlink::Frame& f) noexcept { first.add(f); });
  Pieces pieces(seed);
  for (auto rest = stream; !rest.empty();) {
    const std::size_t n = std::min(pieces.next(), rest.size());
    in_pieces.feed(rest.first(n), [&](const mavlink::Frame& f) noexcept { second.add(f); });
    rest = rest.subspan(n);
  }
  require(first == second, "pieces change nothing");
  require(at_once.counts().bytes == stream.size() && at_once.counts().good == first.count, "counts are right");
  require(at_once.counts().skipped_bytes <= stream.size(), "no byte is skipped twice");
}

constexpr mavlink::SigningKey kKey{{1, 2, 3}};

/// The same on a signed line: what is handed out carries the signature of the key, or is RADIO_STATUS, and no time of a
/// stream comes twice.
void check_signed_stream(std::span<const std::uint8_t> stream, std::uint64_t seed) {
  mavlink::SigningClock first_clock(seed % 1000), second_clock(seed % 1000);
  mavlink::SignatureCheck first_check(kKey, first_clock, true), second_check(kKey, second_clock, true);
  mavlink::Parser at_once, in_pieces;
  at_once.check_signatures(first_check);
  in_pieces.check_signatures(second_check);
  Accepted first, second;
  at_once.feed(stream, [&](const mavlink::Frame& f) noexcept {
    first.add(f);
    require(f.is_verified || f.is<mavlink::RadioStatus>(), "only the signed come through");
    if (!f.is_signed) return;
    const auto six = mavlink::signature_of(kKey, f.wire.first(f.wire.size() - 6));
    require(std::equal(six.begin(), six.end(), f.signature.begin() + 7), "the signature is right");
  });
  Pieces pieces(seed);
  for (auto rest = stream; !rest.empty();) {
    const std::size_t n = std::min(pieces.next(), rest.size());
    in_pieces.feed(rest.first(n), [&](const mavlink::Frame& f) noexcept { second.add(f); });
    rest = rest.subspan(n);
  }
  require(first == second && first_check.counts().refused() == second_check.counts().refused(), "pieces change nothing");
  require(at_once.counts().refused == first_check.counts().refused(), "refusals are counted");
}

std::uint64_t digest_of(std::span<const std::uint8_t> bytes) {
  std::uint64_t h = 1;
  for (const std::uint8_t byte : bytes) h = mixed(h, byte);
  return h;
}

/// A frame of any known message with any payload, of the autopilot or of somebody else, and its checksum.
void append_frame(FuzzInput& in, std::vector<std::uint8_t>& out) {
  const auto how = in.take<std::uint8_t>();
  const auto& info = mavlink::kMessages[in.take<std::uint16_t>() % mavlink::kMessages.size()];
  const bool v1 = (how & 1) != 0 && info.id < 256, is_signed = !v1 && (how & 2) != 0;
  const std::size_t length = v1 ? info.min_length : (how & 4) != 0 ? in.take<std::uint8_t>() : info.max_length;
  const std::uint8_t system = (how & 8) != 0 ? in.take<std::uint8_t>() : std::uint8_t{1};
  const std::uint8_t component = (how & 16) != 0 ? in.take<std::uint8_t>() : std::uint8_t{1};
  const std::size_t start = out.size();
  const auto put = [&out](std::size_t byte) { out.push_back(static_cast<std::uint8_t>(byte)); };
  put(v1 ? 0xFE : 0xFD), put(length);
  if (!v1) put(is_signed ? 1 : 0), put(0);
  put(in.take<std::uint8_t>()), put(system), put(component), put(info.id & 0xFF);
  if (!v1) put(info.id >> 8 & 0xFF), put(info.id >> 16);
  const auto payload = in.take_bytes(length);
  out.insert(out.end(), payload.begin(), payload.end());
  out.resize(out.size() + length - payload.size());
  std::uint16_t crc = 0xFFFF;
  for (std::size_t i = start + 1; i < out.size(); ++i) crc = fuzz::bitwise_crc(crc, out[i]);
  crc = fuzz::bitwise_crc(crc, info.crc_extra);
  put(crc & 0xFF), put(crc >> 8);
  if (!is_signed) return;
  out.resize(out.size() + 13, 0x5A);
  if ((how & 32) == 0) return;  // else rightly, at a time of the input's
  const auto time = in.take_bytes(2);
  std::copy(time.begin(), time.end(), out.end() - 12);
  std::fill(out.end() - 10, out.end() - 6, std::uint8_t{0});
  const auto six = mavlink::signature_of(kKey, std::span(out).subspan(start, out.size() - 6 - start));
  std::copy(six.begin(), six.end(), out.end() - 6);
}

/// The link over a script of what arrives and what time does.
void run_script(FuzzInput in, std::vector<std::uint8_t>& stream) {
  drivers::AutopilotLink link;
  Sink sink;
  std::array<std::uint8_t, mavlink::kMaxFrame> question;
  for (int steps = 0; !in.empty() && steps < 64; ++steps) {
    const std::size_t before = stream.size();
    switch (in.take<std::uint8_t>() % 6) {
      case 0: {
        const auto raw = in.take_bytes(in.take<std::uint8_t>());
        stream.insert(stream.end(), raw.begin(), raw.end());
        break;
      }
      case 1:
        sink.received_at_ns += in.take<std::uint32_t>();
        break;
      case 2:
        link.encode_timesync_request(sink.received_at_ns, question);
        break;
      case 3:
        if (in.take<std::uint8_t>() == 0) link.restart();
        break;
      default:
        append_frame(in, stream);
    }
    link.receive(std::span(stream).subspan(before), sink.received_at_ns, sink);
  }
  require(link.wire_counts().bytes == stream.size(), "the link saw every byte");
}

}  // namespace
}  // namespace wasp

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  wasp::fuzz::FuzzInput in(data, size);
  std::vector<std::uint8_t> stream;
  if ((in.take<std::uint8_t>() & 1) != 0) {
    wasp::run_script(in, stream);
  } else {
    const auto raw = in.rest();
    stream.assign(raw.begin(), raw.end());
    wasp::Sink sink;
    sink.received_at_ns = 1;
    wasp::drivers::AutopilotLink link;
    link.receive(stream, sink.received_at_ns, sink);
  }
  wasp::check_stream(stream, wasp::digest_of({data, size}));
  wasp::check_signed_stream(stream, wasp::digest_of({data, size}));
  return 0;
}
