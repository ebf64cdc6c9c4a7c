// Judging messages of strangers: what is a frame is taken, what is not is refused by name.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <vector>

#include "tools/iceoryx_frame.h"
#include "tools/iceoryx_topics.h"

namespace wasp::iceoryx {
namespace {

struct Message {
  MessageHead head;
  FrameHeader frame;
  std::uint64_t bytes = 0;
};

/// 8x6 mono8, as it should be.
Message good() {
  Message m;
  std::memcpy(m.head.type.data(), "Frame", 5);
  m.frame.format = PixelFormat::kMono8;
  m.frame.width_px = 8;
  m.frame.height_px = 6;
  m.frame.stride_bytes = 8;
  m.head.payload_bytes = kFramePixelOffset + 48;
  m.head.number = 7;
  m.bytes = sizeof m.head + m.head.payload_bytes;
  return m;
}

std::string judge(const Message& m, FrameView& view) {
  static std::vector<std::byte> chunk;
  chunk.assign(std::max<std::size_t>(m.bytes, 512), std::byte{9});
  std::memcpy(chunk.data(), &m.head, sizeof m.head);
  std::memcpy(chunk.data() + sizeof m.head, &m.frame, sizeof m.frame);
  return read_frame(chunk.data(), m.bytes, view);
}

TEST(IceoryxFrame, AGoodMessageIsSeenWhole) {
  FrameView view;
  ASSERT_EQ(judge(good(), view), "");
  EXPECT_EQ(view.header.width_px, 8u);
  EXPECT_EQ(view.pixel_bytes, 48u);
  EXPECT_EQ(view.number, 7u);
  for (std::uint64_t i = 0; i < view.pixel_bytes; ++i) EXPECT_EQ(view.pixels[i], std::byte{9});
}

TEST(IceoryxFrame, EachLieIsNamed) {
  const std::vector<std::pair<const char*, std::function<void(Message&)>>> lies = {
      {"cannot hold the head", [](Message& m) { m.bytes = 63; }},
      {"not a message of wasp", [](Message& m) { m.head.magic ^= 1; }},
      {"message version 2", [](Message& m) { m.head.version = 2; }},
      {"'Imu', not a Frame",
       [](Message& m) {
         m.head.type = {'I', 'm', 'u'};
       }},
      {"speaks of 113 bytes, 112 follow", [](Message& m) { ++m.head.payload_bytes; }},
      {"speaks of 4294967295 bytes", [](Message& m) { m.head.payload_bytes = 0xffffffff; }},
      {"speaks of 10 bytes", [](Message& m) { m.head.payload_bytes = 10; }},
      {"pixel format 77", [](Message& m) { m.frame.format = PixelFormat{77}; }},
      {"impossible size 0x6", [](Message& m) { m.frame.width_px = 0; }},
      {"impossible size 8x4294967295", [](Message& m) { m.frame.height_px = 0xffffffff; }},
      {"impossible stride of 7", [](Message& m) { m.frame.stride_bytes = 7; }},
      {"impossible stride of 17 bytes for 8x6 depth16",
       [](Message& m) {
         m.frame.format = PixelFormat::kDepth16Mm;
         m.frame.stride_bytes = 17;
       }},
      {"8x7 mono8 needs 56 bytes of pixels, the message holds 48", [](Message& m) { m.frame.height_px = 7; }},
      {"needs 25769803752 bytes", [](Message& m) { m.frame.stride_bytes = 4294967292; }},
  };
  for (const auto& [name, lie] : lies) {
    Message m = good();
    lie(m);
    FrameView view;
    EXPECT_NE(judge(m, view).find(name), std::string::npos) << name << " / " << judge(m, view);
  }
}

TEST(IceoryxFrame, BarePixelsMustHaveExactlyTheSizeSaid) {
  FrameHeader expected;
  expected.format = PixelFormat::kDepth16Mm;
  expected.width_px = 4;
  expected.height_px = 3;
  expected.stride_bytes = 8;
  const std::vector<std::byte> pixels(25);
  FrameView view;
  EXPECT_EQ(read_raw_frame(pixels.data(), 24, expected, 5, view), "");
  EXPECT_EQ(view.header.exposed_at_ns, 5);
  EXPECT_EQ(view.pixels, pixels.data());
  EXPECT_NE(read_raw_frame(pixels.data(), 25, expected, 5, view).find("has 24 bytes, the message holds 25"),
            std::string::npos);
}

TEST(IceoryxFrame, AMessageIsAsLongAsItsTypeAndNeverLongerThanItsSlot) {
  std::vector<std::byte> slot(1024);
  FrameHeader header;
  header.stride_bytes = 10;
  header.height_px = 20;
  std::memcpy(slot.data(), &header, sizeof header);
  EXPECT_EQ(message_bytes("Frame", slot.data(), 1024), kFramePixelOffset + 200);
  header.stride_bytes = header.height_px = 0xffffffff;
  std::memcpy(slot.data(), &header, sizeof header);
  EXPECT_EQ(message_bytes("Frame", slot.data(), 1024), 1024u);
  EXPECT_EQ(message_bytes("Cue", slot.data(), 1024), sizeof(Cue));
  EXPECT_EQ(message_bytes("SomethingNew", slot.data(), 1024), 1024u);
}

}  // namespace
}  // namespace wasp::iceoryx
