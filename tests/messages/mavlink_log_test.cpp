// Kinds of log told from content, descriptions at run time, and what an odd log is said to hold.
#include "tools/mavlink_log.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "tests/messages/hex.h"
#include "tools/mavlink_damage.h"
#include "tools/mavlink_fields.h"

namespace wasp::tools {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::uint64_t kTime_us = 1'700'000'000'000'000;

/// Frames of one sender, one after the other.
class Source {
 public:
  explicit Source(mavlink::FrameSigner* signer = nullptr) {
    if (signer != nullptr) encoder_.sign_with(*signer);
  }
  template <class M>
  Bytes frame(const M& message) {
    Bytes out(mavlink::kMaxFrame);
    out.resize(encoder_.encode(message, out));
    return out;
  }
  /// The next frame has this number.
  void jump_to(std::uint8_t sequence) { encoder_.set_sequence(sequence); }
  std::vector<Bytes> frames(std::size_t n) {
    std::vector<Bytes> all;
    for (std::size_t i = 0; i < n; ++i) {
      mavlink::Attitude m;
      m.time_boot_ms = static_cast<std::uint32_t>(1000 + i);
      m.roll = 0.1f * static_cast<float>(i);
      all.push_back(i % 3 == 0 ? frame(mavlink::Heartbeat{}) : frame(m));
    }
    return all;
  }

 private:
  mavlink::Encoder encoder_{1, 1};
};

void append(Bytes& to, const Bytes& more) { to.insert(to.end(), more.begin(), more.end()); }

enum class Order { kNone, kHighFirst, kLowFirst };
Bytes log_bytes(const std::vector<Bytes>& frames, Order order) {
  Bytes all;
  std::uint64_t time = kTime_us;
  for (const Bytes& frame : frames) {
    for (unsigned i = 0; order != Order::kNone && i < 8; ++i)
      all.push_back(static_cast<std::uint8_t>(time >> 8 * (order == Order::kHighFirst ? 7 - i : i)));
    append(all, frame);
    time += 253'254;  // the bytes of the times pass through both start bytes
  }
  return all;
}

Bytes joined(const std::vector<Bytes>& frames) { return log_bytes(frames, Order::kNone); }

TEST(MavlinkLog, KindsAreToldFromContent) {
  const auto frames = Source().frames(400);
  for (const auto& [order, kind] : {std::pair{Order::kNone, LogKind::kRaw}, {Order::kHighFirst, LogKind::kTlog},
                                    {Order::kLowFirst, LogKind::kTlogLittleEndian}}) {
    const MavlinkLog log = mavlink_log_of(log_bytes(frames, order), mavlink::kMessages);
    EXPECT_EQ(log.kind, kind);
    EXPECT_EQ(log.stream, joined(frames));
    EXPECT_EQ(log.stamps.size(), order == Order::kNone ? 0u : frames.size());
    if (order != Order::kNone) {
      EXPECT_EQ(log.time_us(frames[0].size()), kTime_us + 253'254);
    }
  }
}

TEST(MavlinkLog, SaysWhatIsNoMavlink) {
  const auto why = [](const std::string& text) {
    const MavlinkLog log = mavlink_log_of(Bytes(text.begin(), text.end()), mavlink::kMessages);
    EXPECT_EQ(log.kind, LogKind::kNotMavlink);
    return std::string(log.why);
  };
  EXPECT_EQ(why(""), "empty");
  EXPECT_NE(why("\xA3\x95\x80\x80").find("DataFlash"), std::string::npos);
  EXPECT_NE(why("ULog\x01\x12\x35").find("ULog"), std::string::npos);
  EXPECT_NE(why("\x1F\x8B\x08").find("gzip"), std::string::npos);
  EXPECT_NE(why("msgid,count\n0,46\n").find("no frame"), std::string::npos);
}

TEST(MavlinkLog, ATornTelemetryLogIsReadOn) {
  const auto frames = Source().frames(60);
  Bytes bytes = log_bytes(frames, Order::kHighFirst);
  const std::size_t record = 8 + frames[0].size();
  bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(record + 3), bytes.begin() + static_cast<std::ptrdiff_t>(record + 20));
  bytes.resize(bytes.size() - 5);  // and it ends in a frame
  const MavlinkLog log = mavlink_log_of(bytes, mavlink::kMessages);
  EXPECT_EQ(log.kind, LogKind::kTlog);
  const LogScan found = scan(log.stream, mavlink::kMessages);
  EXPECT_EQ(found.frames.size(), frames.size() - 2);
  for (const FoundFrame& f : found.frames) EXPECT_TRUE(log.time_us(f.begin).has_value());
  EXPECT_GT(found.truncated_bytes + found.stray_bytes, 0u);
}

TEST(MavlinkLog, GapsAndUnknownIdsOfASource) {
  Source source;
  std::vector<Bytes> frames = source.frames(10);
  Bytes stream = joined(frames);
  append(stream, test::from_hex("fd0200000a0101214e00aabbccdd"));  // number 10, id 20001, which nobody knows
  std::size_t known = frames.size();
  const LogScan first = scan(stream, mavlink::kMessages);
  EXPECT_EQ(first.frames.size(), known);
  EXPECT_EQ(first.unknown_ids.at(20001), 1u);
  EXPECT_EQ(first.sources.at({1, 1}).unknown_frames, 1u);
  EXPECT_EQ(first.sources.at({1, 1}).lost, 0u);
  source.jump_to(200);
  append(stream, source.frame(mavlink::Heartbeat{}));
  const LogScan second = scan(stream, mavlink::kMessages);
  EXPECT_EQ(second.sources.at({1, 1}).gaps, 1u);
  EXPECT_EQ(second.sources.at({1, 1}).lost, 200u - 11u);
}

TEST(MavlinkLog, BadChecksumsAreCounted) {
  std::vector<Bytes> frames = Source().frames(30);
  frames[7].back() ^= 1;
  frames[20][12] ^= 0x40;
  const LogScan found = scan(joined(frames), mavlink::kMessages);
  EXPECT_EQ(found.frames.size(), frames.size() - 2);
  EXPECT_EQ(found.bad_checksums, 2u);
  EXPECT_EQ(found.sources.at({1, 1}).lost, 2u);
}

TEST(MavlinkLog, SignedFramesUnderDamage) {
  mavlink::SigningKey key;
  std::iota(key.bytes.begin(), key.bytes.end(), std::uint8_t{0});
  mavlink::SigningClock clock(1'000'000), reader(0);
  mavlink::FrameSigner signer(key, clock, 1);
  const Bytes stream = joined(Source(&signer).frames(300));
  mavlink::SignatureCheck check(key, reader, true);
  const LogScan found = scan(stream, mavlink::kMessages, &check);
  EXPECT_EQ(found.frames.size(), 300u);
  EXPECT_EQ(check.counts().verified, 300u);
  const LogScan keyless = scan(stream, mavlink::kMessages);
  for (const DamageResult& d : damage_campaigns(stream, keyless.frames, mavlink::kMessages, 10)) {
    EXPECT_EQ(d.lost, 0u) << d.name;
    EXPECT_EQ(d.bad_checksum, 0u) << d.name;
    EXPECT_GT(d.other_signature, 0u) << d.name;
  }
}

TEST(MavlinkDescription, DecodesWhatTheStructsSay) {
  const MavlinkDescription description = MavlinkDescription::load(default_description());
  ASSERT_EQ(description.rows().size(), mavlink::kMessages.size());
  mavlink::Attitude m;
  m.time_boot_ms = 7;
  m.roll = 0.1f;
  m.pitch = NAN;
  m.yaw = -INFINITY;
  std::array<std::uint8_t, mavlink::Attitude::kMaxLength> payload{};
  m.pack(payload.data());
  EXPECT_EQ(decode(*description.find(30), payload).dump(),
            R"({"time_boot_ms":7,"roll":0.10000000149011612,"pitch":"nan","yaw":"-inf","rollspeed":0.0,)"
            R"("pitchspeed":0.0,"yawspeed":0.0})");
  mavlink::Statustext text;
  text.text = {'a', '"', static_cast<char>(0xE9)};
  std::array<std::uint8_t, mavlink::Statustext::kMaxLength> bytes{};
  text.pack(bytes.data());
  EXPECT_EQ(decode(*description.find(253), bytes).at("text").get<std::string>(), "a\"\u00e9");
  EXPECT_EQ(description.find(20001), nullptr);
}

TEST(MavlinkDescription, RefusesWhatIsNone) {
  const auto why = [](const std::string& text) {
    try {
      MavlinkDescription::parse(text, "x.json");
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const auto message = [](const std::string& field, int max) {
    return R"({"messages":[{"id":1,"name":"A","crc_extra":1,"min_length":1,"max_length":)" + std::to_string(max) +
           R"(,"fields":[{"name":"f","extension":false,)" + field + "}]}]}";
  };
  EXPECT_EQ(why(message(R"("type":"uint8_t","offset":0,"array_length":0)", 1)), "accepted");
  EXPECT_NE(why("{").find("x.json"), std::string::npos);
  EXPECT_NE(why("{}").find("no message description"), std::string::npos);
  EXPECT_NE(why(message(R"("type":"uint9_t","offset":0,"array_length":0)", 1)).find("unknown type"), std::string::npos);
  EXPECT_NE(why(message(R"("type":"float","offset":0,"array_length":0)", 1)).find("beyond"), std::string::npos);
  EXPECT_NE(why(message(R"("type":"uint8_t","offset":0,"array_length":99999999999999)", 1)).find("beyond"),
            std::string::npos);
  EXPECT_NE(why(message(R"("type":"uint8_t","offset":0,"array_length":0)", 300)).find("no such message"),
            std::string::npos);
}

}  // namespace
}  // namespace wasp::tools
