// The parser against damage, noise, odd frames and odd chunk sizes.
#include <gtest/gtest.h>

#include <random>

#include "messages/checksum.h"
#include "messages/mavlink_frame.h"
#include "tests/messages/hex.h"

namespace wasp::mavlink {
namespace {

using Bytes = std::vector<std::uint8_t>;

void append(Bytes& to, const Bytes& more) {
  for (const std::uint8_t byte : more) to.push_back(byte);
}

template <class M>
Bytes encoded(Encoder& encoder, const M& message) {
  std::array<std::uint8_t, kMaxFrame> out{};
  return Bytes(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(encoder.encode(message, out)));
}

/// Any frame by hand: the checksum is right for `crc_extra`.
Bytes frame_v2(std::uint32_t id, std::uint8_t crc_extra, const Bytes& payload, std::uint8_t incompat = 0,
               std::uint8_t sequence = 0, std::uint8_t system = 1, std::uint8_t component = 1) {
  Bytes frame{kStartV2,
              static_cast<std::uint8_t>(payload.size()),
              incompat,
              0,
              sequence,
              system,
              component,
              static_cast<std::uint8_t>(id),
              static_cast<std::uint8_t>(id >> 8),
              static_cast<std::uint8_t>(id >> 16)};
  append(frame, payload);
  const std::uint16_t crc = crc_add(crc_add(kCrcInitial, std::span(frame).subspan(1)), crc_extra);
  append(frame, {static_cast<std::uint8_t>(crc), static_cast<std::uint8_t>(crc >> 8)});
  return frame;
}

Bytes frame_v1(std::uint8_t id, std::uint8_t crc_extra, const Bytes& payload, std::uint8_t sequence = 0) {
  Bytes frame{kStartV1, static_cast<std::uint8_t>(payload.size()), sequence, 1, 1, id};
  append(frame, payload);
  const std::uint16_t crc = crc_add(crc_add(kCrcInitial, std::span(frame).subspan(1)), crc_extra);
  append(frame, {static_cast<std::uint8_t>(crc), static_cast<std::uint8_t>(crc >> 8)});
  return frame;
}

/// Ids of the good frames in `bytes`, fed in one piece.
std::vector<std::uint32_t> ids(Parser& parser, const Bytes& bytes) {
  std::vector<std::uint32_t> found;
  parser.feed(bytes, [&](const Frame& frame) noexcept { found.push_back(frame.message_id); });
  return found;
}

using Ids = std::vector<std::uint32_t>;

Heartbeat beat() {
  Heartbeat m;
  m.custom_mode = 0x01020304;
  m.mavlink_version = 3;
  return m;
}

TEST(FrameParser, ReadsBothVersionsInterleaved) {
  Encoder encoder(1, 1);
  Bytes stream = encoded(encoder, beat());
  append(stream, frame_v1(0, Heartbeat::kCrcExtra, Bytes(9, 7)));
  append(stream, encoded(encoder, Timesync{}));
  Parser parser;
  EXPECT_EQ(ids(parser, stream), (Ids{0, 0, 111}));
  EXPECT_EQ(parser.counts().skipped_bytes, 0u);
}

TEST(FrameParser, AcceptsAnEmptyPayloadAndAnOverlongOne) {
  Parser parser;
  Bytes stream = frame_v2(Ping::kId, Ping::kCrcExtra, {});
  append(stream, frame_v2(Heartbeat::kId, Heartbeat::kCrcExtra, Bytes(255, 1)));
  append(stream, frame_v2(Heartbeat::kId, Heartbeat::kCrcExtra, Bytes(9, 0)));  // untrimmed zeros
  EXPECT_EQ(ids(parser, stream), (Ids{4, 0, 0}));
}

TEST(FrameParser, RefusesAWrongVersionOneLengthAndABroadcastSender) {
  Parser parser;
  EXPECT_TRUE(ids(parser, frame_v1(0, Heartbeat::kCrcExtra, Bytes(8, 7))).empty());
  EXPECT_TRUE(ids(parser, frame_v2(0, Heartbeat::kCrcExtra, {1}, 0, 0, 0, 1)).empty());
  EXPECT_TRUE(ids(parser, frame_v2(0, Heartbeat::kCrcExtra, {1}, 0, 0, 1, 0)).empty());
  EXPECT_GE(parser.counts().bad_header, 1u);
}

TEST(FrameParser, GoesOnRightAfterAFailedStart) {
  Encoder encoder(1, 1);
  Parser parser;
  ids(parser, encoded(encoder, beat()));
  Bytes stream = frame_v2(ParamValue::kId, ParamValue::kCrcExtra, Bytes(3, 5));
  stream[1] = 200;  // claims to reach far into what follows
  for (int i = 0; i < 20; ++i) append(stream, encoded(encoder, beat()));
  EXPECT_EQ(ids(parser, stream), Ids(20, 0u));
  EXPECT_EQ(parser.counts().bad_crc, 1u);
}

TEST(FrameParser, FindsAFrameInsideADamagedOne) {
  Encoder encoder(1, 1);
  Bytes inner = encoded(encoder, beat());
  Bytes payload(40, 0xFD);
  std::copy(inner.begin(), inner.end(), payload.begin() + 5);
  Bytes outer = frame_v2(Statustext::kId, Statustext::kCrcExtra, payload);
  outer.back() ^= 1;
  Parser parser;
  EXPECT_EQ(ids(parser, outer), Ids{0});
}

TEST(FrameParser, PassesOverAnUnknownMessageWithAFrameInsideIt) {
  Encoder encoder(1, 1);
  Parser parser;
  ids(parser, encoded(encoder, beat()));
  Encoder recorded(1, 1);
  Bytes stream = frame_v2(20001, 84, encoded(recorded, CommandLong{1}), 0, 1);  // say, a file transfer that carries a log
  encoder.set_sequence(2);
  append(stream, encoded(encoder, beat()));
  EXPECT_EQ(ids(parser, stream), Ids{0});
  EXPECT_EQ(parser.counts().unknown_id, 1u);
  EXPECT_EQ(parser.counts().bad_crc, 0u);
  EXPECT_EQ(parser.counts().skipped_bytes, 0u);
}

TEST(FrameParser, DropsUnknownIncompatibilityFlags) {
  Encoder encoder(1, 1);
  Parser parser;
  ids(parser, encoded(encoder, beat()));
  Bytes stream = frame_v2(0, Heartbeat::kCrcExtra, {1}, 0x02);
  append(stream, encoded(encoder, beat()));
  EXPECT_EQ(ids(parser, stream), Ids{0});
  EXPECT_EQ(parser.counts().unsupported_flags, 1u);
}

TEST(FrameParser, CountsSequenceGapsPerSource) {
  Parser parser;
  const auto feed = [&](std::uint8_t component, std::uint8_t sequence) {
    ids(parser, frame_v2(0, Heartbeat::kCrcExtra, {1}, 0, sequence, 1, component));
  };
  feed(1, 250);
  feed(2, 9);
  feed(1, 255);  // 251 ... 254 missing
  feed(2, 10);
  feed(1, 0);
  feed(1, 0);  // repeated: no loss
  EXPECT_EQ(parser.counts().sequence_lost, 4u);
  ASSERT_EQ(parser.sources().size(), 2u);
  EXPECT_EQ(parser.sources()[0].sequence_lost, 4u);
  EXPECT_EQ(parser.sources()[1].sequence_lost, 0u);
  EXPECT_EQ(parser.sources()[0].good, 4u);
  EXPECT_EQ(parser.sources()[0].repeated, 1u);
  EXPECT_EQ(parser.sources()[1].repeated, 0u);
}

TEST(FrameParser, UnknownMessagesAreNotLost) {
  Parser parser;
  Bytes stream = frame_v2(0, Heartbeat::kCrcExtra, {1}, 0, 1);
  append(stream, frame_v2(20001, 28, {1, 2}, 0, 2));
  append(stream, frame_v2(0, Heartbeat::kCrcExtra, {1}, 0, 3));
  append(stream, frame_v2(0, Heartbeat::kCrcExtra, {1}, 0, 5));
  ids(parser, stream);
  EXPECT_EQ(parser.counts().sequence_lost, 1u);
}

TEST(FrameParser, TakesMoreSendersThanItTracks) {
  Parser parser;
  for (std::uint8_t component = 1; component <= 40; ++component)
    ids(parser, frame_v2(0, Heartbeat::kCrcExtra, {1}, 0, 0, 1, component));
  EXPECT_EQ(parser.counts().good, 40u);
  EXPECT_EQ(parser.sources().size(), 16u);
  EXPECT_EQ(parser.counts().untracked_sources, 24u);
}

TEST(FrameParser, ForgetsAPartialFrameOnReset) {
  Encoder encoder(1, 1);
  const Bytes whole = encoded(encoder, beat());
  Parser parser;
  ids(parser, Bytes(whole.begin(), whole.begin() + 15));
  parser.reset();
  EXPECT_EQ(ids(parser, whole), Ids{0});
  EXPECT_EQ(parser.counts().skipped_bytes, 15u);
}

/// Every byte of the stream is in a frame or counted as skipped, once nothing is pending.
TEST(FrameParser, SurvivesNoiseAndFindsTheFramesInIt) {
  std::mt19937 random(7);
  Encoder encoder(1, 1);
  Parser parser;
  std::size_t sent = 0, found = 0;
  const auto count = [&](const Frame& frame) noexcept {
    if (frame.is<Heartbeat>() && frame.as<Heartbeat>().custom_mode == beat().custom_mode) ++found;
  };
  for (int round = 0; round < 2000; ++round) {
    Bytes noise(random() % 300);
    for (auto& byte : noise) {
      byte = static_cast<std::uint8_t>(random());
      if (random() % 8 == 0) byte = random() % 2 == 0 ? kStartV1 : kStartV2;
    }
    append(noise, encoded(encoder, beat()));
    ++sent;
    while (!noise.empty()) {
      const std::size_t n = std::min<std::size_t>(noise.size(), 1 + random() % 64);
      parser.feed(std::span(noise).first(n), count);
      noise.erase(noise.begin(), noise.begin() + static_cast<std::ptrdiff_t>(n));
    }
  }
  parser.feed(Bytes(300, 0), count);  // closes every claim still open
  EXPECT_EQ(found, sent);
}

TEST(FrameParser, PureNoiseYieldsNothing) {
  std::mt19937 random(11);
  Parser parser;
  Bytes noise(1 << 20);
  for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
  EXPECT_TRUE(ids(parser, noise).empty());
  EXPECT_EQ(parser.counts().bytes, noise.size());
}

}  // namespace
}  // namespace wasp::mavlink
