// A grey frame with the depth frame of the same exposure: found, missing, or overwritten under the step's eyes.
#include "scheduling/frame_source.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>

#include "rt/clock.h"
#include "scheduling/flight_regions.h"

namespace wasp::scheduling {
namespace {

constexpr std::uint32_t kWidth = 8, kHeight = 4;

class FrameSourceTest : public ::testing::Test {
 protected:
  FrameSourceTest()
      : instance_("test-source-" + std::to_string(getpid())),
        camera_(shm::Region::create(
            shm::camera_region(instance_),
            std::vector<shm::TopicSpec>{
                {shm::kGray, "Frame", shm::TopicKind::kRing, shm::kFrameSlots, kFramePixelOffset + kWidth * kHeight},
                {shm::kDepth, "Frame", shm::TopicKind::kRing, shm::kFrameSlots,
                 kFramePixelOffset + 2 * kWidth * kHeight}})),
        flight_(create_flight_region(instance_, {.flows = {shm::kFlow}}, false)),
        gray_(camera_, shm::kGray),
        depth_(camera_, shm::kDepth) {}
  ~FrameSourceTest() override {
    shm::Region::remove(camera_.name());
    shm::Region::remove(flight_.name());
  }

  template <class T>
  static void show(shm::RingWriter& ring, std::uint32_t sequence, TimeNs at_ns, T value) {
    std::byte* slot = ring.loan();
    FrameHeader h;
    h.exposed_at_ns = at_ns;
    h.sequence = sequence;
    h.format = sizeof(T) == 2 ? PixelFormat::kDepth16Mm : PixelFormat::kMono8;
    h.width_px = kWidth;
    h.height_px = kHeight;
    h.stride_bytes = kWidth * sizeof(T);
    std::memcpy(slot, &h, sizeof h);
    std::fill_n(reinterpret_cast<T*>(slot + kFramePixelOffset), kWidth * kHeight, value);
    ring.publish(rt::now());
  }
  void show_depth(std::uint32_t n, TimeNs at_ns) {
    show<std::uint16_t>(depth_, n, at_ns, static_cast<std::uint16_t>(1000 + n));
  }
  void show_gray(std::uint32_t n, TimeNs at_ns) { show<std::uint8_t>(gray_, n, at_ns, static_cast<std::uint8_t>(n)); }
  static Frame take(FrameSource& source) { return source.wait(rt::now() + 10 * kSecond, true); }

  std::string instance_;
  shm::Region camera_, flight_;
  shm::RingWriter gray_, depth_;
};

TEST_F(FrameSourceTest, GreyFramesComeWithTheDepthOfTheirExposureOrWithout) {
  FrameSource source(camera_, flight_, Stream::kGrayDepth);
  show_depth(1, 100);
  show_depth(2, 200);  // a frame ahead already
  show_gray(1, 100);
  const Frame paired = take(source);
  ASSERT_TRUE(paired.depth.valid());
  EXPECT_EQ(paired.depth.row(1)[3], 1001);
  EXPECT_EQ(paired.gray.row(1)[3], 1);
  show_gray(2, 201);  // another exposure under the same number
  EXPECT_FALSE(take(source).depth.valid());
  show_gray(3, 300);
  const Frame lonely = take(source);
  EXPECT_EQ(lonely.gray.row(0)[0], 3);
  EXPECT_FALSE(lonely.depth.valid());
  EXPECT_TRUE(source.intact(lonely));
  EXPECT_EQ(source.lost(), 0u);
}

TEST_F(FrameSourceTest, DepthOverwrittenDuringTheStepSpoilsIt) {
  FrameSource source(camera_, flight_, Stream::kGrayDepth);
  show_depth(1, 100);
  show_gray(1, 100);
  const Frame frame = take(source);
  ASSERT_TRUE(frame.depth.valid());
  EXPECT_TRUE(source.intact(frame));
  for (std::uint32_t n = 2; n < 2 + shm::kFrameSlots; ++n) show_depth(n, 100 * n);  // grey stands still
  EXPECT_FALSE(source.intact(frame));
  EXPECT_EQ(source.lost(), 1u);
}

TEST_F(FrameSourceTest, AStandingDepthImageBesideALivingGreyOneIsLeftOut) {
  FrameSource source(camera_, flight_, Stream::kGrayDepth, {.live = true, .stuck_frames = 2});
  const TimeNs start_ns = rt::now() - kSecond;
  for (std::uint32_t n = 1; n <= 4; ++n) {
    show<std::uint16_t>(depth_, n, start_ns + n, static_cast<std::uint16_t>(n < 4 ? 1000 : 2000));
    show_gray(n, start_ns + n);
    const Frame frame = take(source);
    ASSERT_TRUE(frame) << n;
    EXPECT_EQ(frame.depth.valid(), n == 1 || n == 4) << n;
  }
  EXPECT_EQ(source.counts().of(FrameFault::kDuplicate), 2u);
  EXPECT_EQ(source.counts().frozen, 1u);
}

TEST_F(FrameSourceTest, AFrameOfAnotherSizeThanTheCameraPromisedIsRefused) {
  FrameSource other(camera_, flight_, Stream::kGray, {.width_px = 2 * kWidth, .height_px = kHeight});
  FrameSource source(camera_, flight_, Stream::kGray, {.width_px = kWidth, .height_px = kHeight});
  show_gray(1, 100);
  EXPECT_TRUE(take(source));
  EXPECT_FALSE(take(other));
  EXPECT_EQ(other.counts().of(FrameFault::kMalformed), 1u);
  EXPECT_EQ(source.counts().of(FrameFault::kMalformed), 0u);
}

TEST_F(FrameSourceTest, ADepthStreamAtAnotherResolutionIsRefusedAndCounted) {
  FrameSource alone(camera_, flight_, Stream::kDepth, {.width_px = 2 * kWidth, .height_px = 2 * kHeight});
  show_depth(1, 100);
  EXPECT_FALSE(take(alone));
  EXPECT_EQ(alone.counts().of(FrameFault::kMalformed), 1u);
  FrameSource right(camera_, flight_, Stream::kDepth, {.width_px = kWidth, .height_px = kHeight});
  show_depth(2, 200);
  EXPECT_TRUE(take(right).depth.valid());
}

TEST_F(FrameSourceTest, ACameraOfAnotherSizeThanConfiguredIsRefusedBeforeTheFlightNamingBoth) {
  Intrinsics right, wrong;
  right.width_px = kWidth, right.height_px = kHeight;
  wrong.width_px = 640, wrong.height_px = 480;
  EXPECT_NO_THROW(check_frame_size(camera_, shm::kDepth, wrong, "camera")) << "it has shown nothing yet";
  show_depth(1, 100);
  EXPECT_NO_THROW(check_frame_size(camera_, shm::kDepth, right, "camera"));
  try {
    check_frame_size(camera_, shm::kDepth, wrong, "camera");
    FAIL();
  } catch (const std::runtime_error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("'depth'"), std::string::npos) << text;
    EXPECT_NE(text.find("[camera] says 640 x 480"), std::string::npos) << text;
  }
}

TEST_F(FrameSourceTest, AFlowFieldIsReadInPlaceAndOneThatLiesIsNotFollowed) {
  FrameSource source(camera_, flight_, Stream::kFlow);
  FlowWriter writer(flight_, shm::kFlow);
  FlowMessage message;
  message.seen.columns = 17;  // beyond its own cells
  writer.publish(message, 5, rt::now());
  EXPECT_FALSE(take(source));
  EXPECT_EQ(source.counts().of(FrameFault::kMalformed), 1u);
  message.seen.columns = 16;
  message.frame_sequence = 9;
  message.exposed_at_ns = 77;
  message.seen.at(15, 8).u_px = 2.5f;
  writer.publish(message, 5000, rt::now());
  const Frame frame = take(source);
  ASSERT_NE(frame.flow, nullptr);
  EXPECT_EQ(frame.sequence, 9u);
  EXPECT_EQ(frame.exposed_at_ns, 77);
  EXPECT_EQ(frame.shown_at_ns, 5000);
  EXPECT_EQ(frame.flow->seen.at(15, 8).u_px, 2.5f);
  for (std::uint32_t n = 0; n < shm::kFlowSlots; ++n) writer.publish(message, 6000, rt::now());
  EXPECT_FALSE(source.intact(frame));
}

}  // namespace
}  // namespace wasp::scheduling
