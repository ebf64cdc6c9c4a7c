// The camera relay: with nothing on, every frame of every ring comes through to the bit and in order; each point does
// what its row says, and depth stays ahead of the grey frame of its exposure.
#include "scheduling/camera_relay.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <set>
#include <thread>

#include "rt/clock.h"
#include "scheduling/flight_regions.h"
#include "scheduling/frame_source.h"

namespace wasp::scheduling {
namespace {

constexpr std::uint32_t kWidth = 32, kHeight = 16;

struct Seen {
  FrameHeader header;
  std::vector<std::uint8_t> bytes;  ///< pixels
  [[nodiscard]] std::uint8_t gray(std::size_t i) const { return bytes[i]; }
  [[nodiscard]] std::uint16_t depth(std::size_t i) const {
    return static_cast<std::uint16_t>(bytes[2 * i] | bytes[2 * i + 1] << 8);
  }
};

class CameraRelayTest : public ::testing::Test {
 protected:
  CameraRelayTest()
      : instance_("test-relay-" + std::to_string(getpid())),
        camera_(shm::Region::create(
            shm::camera_region(instance_),
            std::vector<shm::TopicSpec>{ring(shm::kGray, 1), ring(shm::kDepth, 2), ring(shm::kGrayDown, 1)})),
        relayed_(shm::Region::create(shm::relay_region(instance_), CameraRelay::topics(camera_))),
        flight_(create_flight_region(instance_, {}, false)),
        gray_(camera_, shm::kGray),
        depth_(camera_, shm::kDepth),
        down_(camera_, shm::kGrayDown),
        relay_(camera_, relayed_, stage_table(flight_), events_, board_of_threads_.add({"camera", -1, 0, kSecond})) {
    control_.status = &run_status(flight_);
    control_.faults = &board_;
    thread_ = std::thread([this] { relay_.run(control_); });
  }
  ~CameraRelayTest() override {
    control_.stop = true;
    thread_.join();
    for (const auto* region : {&camera_, &relayed_, &flight_}) shm::Region::remove(region->name());
  }
  static shm::TopicSpec ring(const char* name, std::uint64_t pixel_bytes) {
    return {name, "Frame", shm::TopicKind::kRing, shm::kFrameSlots, kFramePixelOffset + kWidth * kHeight * pixel_bytes};
  }
  template <class T>
  static void show(shm::RingWriter& out, std::uint32_t sequence, T value) {
    std::byte* slot = out.loan();
    FrameHeader h;
    h.exposed_at_ns = exposed(sequence);
    h.sequence = sequence;
    h.format = sizeof(T) == 2 ? PixelFormat::kDepth16Mm : PixelFormat::kMono8;
    h.width_px = kWidth;
    h.height_px = kHeight;
    h.stride_bytes = kWidth * sizeof(T);
    std::memcpy(slot, &h, sizeof h);
    auto* pixels = reinterpret_cast<T*>(slot + kFramePixelOffset);
    for (std::uint32_t i = 0; i < kWidth * kHeight; ++i) pixels[i] = static_cast<T>(value + i % 3);
    out.publish(rt::now());
  }
  static TimeNs exposed(std::uint32_t sequence) { return kSecond + sequence * kMillisecond; }
  void show_depth(std::uint32_t n) { show(depth_, n, static_cast<std::uint16_t>(1000 + n)); }
  void show_gray(std::uint32_t n) { show(gray_, n, static_cast<std::uint8_t>(n)); }
  void show_down(std::uint32_t n) { show(down_, n, static_cast<std::uint8_t>(100 + n)); }
  void show_both(std::uint32_t n) {
    show_depth(n);
    show_gray(n);
  }
  void set(FaultPoint point, float value) { board_.set(point, 0, INT64_MAX, value); }
  void set(FaultPoint point) { set(point, row_of(point).value); }
  void clear(FaultPoint point) { board_.clear(point); }

  static Seen take(shm::RingReader& reader) {
    Seen seen;
    if (!reader.wait(rt::now() + 60 * kSecond)) return seen;
    const shm::Sample sample = reader.next();
    std::memcpy(&seen.header, sample.data, sizeof seen.header);
    seen.bytes.resize(reader.payload_bytes() - kFramePixelOffset);
    std::memcpy(seen.bytes.data(), sample.data + kFramePixelOffset, seen.bytes.size());
    return seen;
  }
  Seen take_gray() { return take(gray_out_); }
  Seen take_depth() { return take(depth_out_); }
  /// A pair has passed, so everything before it has too.
  void pass_pair(std::uint32_t n) {
    show_both(n);
    ASSERT_EQ(take_depth().header.sequence, n);
    ASSERT_EQ(take_gray().header.sequence, n);
  }
  /// The relay has looked at so many frames since the start, whatever became of them.
  void wait_until_dealt_with(std::uint64_t frames) {
    const rt::Histogram& relayed = stage_table(flight_).stages[0].histogram;
    for (int i = 0; i < 60'000 && relayed.count() < frames; ++i) rt::sleep_until(rt::now() + kMillisecond);
  }
  bool said(const std::string& words) {
    for (int i = 0; i < 60'000; ++i) {
      Event e;
      while (events_.take(e)) texts_ += std::string(e.text.data()) + "\n";
      if (texts_.find(words) != std::string::npos) return true;
      rt::sleep_until(rt::now() + kMillisecond);
    }
    return false;
  }

  std::string instance_;
  shm::Region camera_, relayed_, flight_;
  shm::RingWriter gray_, depth_, down_;
  shm::RingReader gray_out_{relayed_, shm::kGray}, depth_out_{relayed_, shm::kDepth},
      down_out_{relayed_, shm::kGrayDown};
  FaultBoard board_;
  EventQueue events_;
  WatchBoard board_of_threads_;
  LoopControl control_;
  CameraRelay relay_;
  std::string texts_;
  std::thread thread_;
};

TEST_F(CameraRelayTest, EveryRingComesThroughToTheBitAndInOrder) {
  for (std::uint32_t n = 1; n <= 300; ++n) {
    show_both(n);
    show_down(n);
    for (auto* ends : {&depth_out_, &gray_out_, &down_out_}) {
      const Seen seen = take(*ends);
      ASSERT_EQ(seen.header.sequence, n);
      ASSERT_EQ(seen.header.exposed_at_ns, exposed(n));
    }
    const shm::Sample in = shm::RingReader(camera_, shm::kDepth).look(n), out = depth_out_.look(n);
    ASSERT_TRUE(in && out);
    ASSERT_EQ(std::memcmp(in.data, out.data, depth_.payload_bytes()), 0);
    const shm::Sample down_in = shm::RingReader(camera_, shm::kGrayDown).look(n), down_out = down_out_.look(n);
    ASSERT_EQ(std::memcmp(down_in.data, down_out.data, down_.payload_bytes()), 0);
  }
  EXPECT_EQ(control_.status->frames_lost.load(), 0u);
}

TEST_F(CameraRelayTest, AGreyFrameFindsTheDepthOfItsExposure) {
  FrameSource source(relayed_, flight_, Stream::kGrayDepth);
  for (std::uint32_t n = 1; n <= 1000; ++n) {
    show_both(n);
    const Frame frame = source.wait(rt::now() + 60 * kSecond, true);
    ASSERT_EQ(frame.sequence, n);
    ASSERT_TRUE(frame.depth.valid());
    ASSERT_EQ(frame.depth.row(0)[0], static_cast<std::uint16_t>(1000 + n));
  }
}

TEST_F(CameraRelayTest, FreezeRepeatsTheImageUnderNewHeaders) {
  set(FaultPoint::kCameraFreeze);
  for (std::uint32_t n = 1; n <= 4; ++n) {
    show_both(n);
    const Seen depth = take_depth(), gray = take_gray();
    EXPECT_EQ(depth.header.sequence, n);
    EXPECT_EQ(gray.header.exposed_at_ns, exposed(n));
    EXPECT_EQ(depth.depth(0), 1001);
    EXPECT_EQ(gray.gray(0), 1);
  }
  clear(FaultPoint::kCameraFreeze);
  pass_pair(5);
  set(FaultPoint::kDepthFreeze);
  for (std::uint32_t n = 6; n <= 8; ++n) {
    show_both(n);
    EXPECT_EQ(take_depth().depth(0), 1006);
    EXPECT_EQ(take_gray().gray(0), n);
  }
  clear(FaultPoint::kDepthFreeze);
  show_both(9);
  EXPECT_EQ(take_depth().depth(0), 1009);
}

TEST_F(CameraRelayTest, DroppedExposuresComeInNoRing) {
  set(FaultPoint::kCameraDrop, 1);
  for (std::uint32_t n = 1; n <= 3; ++n) {
    show_both(n);
    show_down(n);
  }
  wait_until_dealt_with(9);
  clear(FaultPoint::kCameraDrop);
  pass_pair(4);
  show_down(4);
  EXPECT_EQ(take(down_out_).header.sequence, 4u);
}

TEST_F(CameraRelayTest, ShareOfDropsAndDepthAlone) {
  set(FaultPoint::kDepthDrop, 0.5f);
  for (std::uint32_t n = 1; n <= 400; ++n) {
    show_both(n);
    ASSERT_EQ(take_gray().header.sequence, n);
  }
  EXPECT_NEAR(static_cast<double>(depth_out_.newest()), 200, 60);
}

TEST_F(CameraRelayTest, NoMoreFramesThanTheSlowRate) {
  set(FaultPoint::kCameraSlow, 0.001f);  // one in a quarter of an hour
  show_both(1);
  EXPECT_EQ(take_depth().header.sequence, 1u);
  EXPECT_EQ(take_gray().header.sequence, 1u);
  for (std::uint32_t n = 2; n <= 4; ++n) show_both(n);
  wait_until_dealt_with(8);
  clear(FaultPoint::kCameraSlow);
  pass_pair(5);
}

TEST_F(CameraRelayTest, ADisconnectedCameraIsSilentAndSaidToBeReopened) {
  set(FaultPoint::kCameraDisconnect);
  EXPECT_TRUE(said("camera disconnected"));
  show_both(1);
  wait_until_dealt_with(2);
  clear(FaultPoint::kCameraDisconnect);
  EXPECT_TRUE(said("camera reopened"));
  pass_pair(2);
}

TEST_F(CameraRelayTest, AReadErrorClosesTheCameraForItsTime) {
  set(FaultPoint::kCameraError, 30);
  show_both(1);
  EXPECT_TRUE(said("camera: read error (EIO), closed"));
  clear(FaultPoint::kCameraError);
  EXPECT_TRUE(said("camera reopened"));
  pass_pair(2);
}

TEST_F(CameraRelayTest, LateFramesKeepTheirOrderAndDepthItsPlace) {
  set(FaultPoint::kCameraLate, 80);
  FrameSource source(relayed_, flight_, Stream::kGrayDepth);
  const TimeNs shown_ns = rt::now();
  for (std::uint32_t n = 1; n <= 3; ++n) show_both(n);
  for (std::uint32_t n = 1; n <= 3; ++n) {
    const Frame frame = source.wait(rt::now() + 60 * kSecond, true);
    EXPECT_GE(frame.sample.published_at_ns, shown_ns + 80 * kMillisecond);
    EXPECT_EQ(frame.sequence, n);
    EXPECT_EQ(frame.exposed_at_ns, exposed(n));
    EXPECT_TRUE(frame.depth.valid());
  }
  show_both(4);
  while (gray_out_.newest() < 3) rt::sleep_until(rt::now() + kMillisecond);
  clear(FaultPoint::kCameraLate);
  show_both(5);  // behind what still waits
  EXPECT_EQ(source.wait(rt::now() + 60 * kSecond, true).sequence, 4u);
  EXPECT_EQ(source.wait(rt::now() + 60 * kSecond, true).sequence, 5u);
}

TEST_F(CameraRelayTest, AStoreThatIsFullLosesFramesAndCountsThem) {
  set(FaultPoint::kCameraLate, 600'000);
  for (std::uint32_t n = 1; n <= 40; ++n) {
    show_gray(n);
    rt::sleep_until(rt::now() + kMillisecond / 2);
  }
  const auto& lost = control_.status->frames_lost;  // in the store, or already in the ring if the host stood still
  for (int i = 0; i < 60'000 && lost.load() < 22; ++i) rt::sleep_until(rt::now() + kMillisecond);
  EXPECT_GE(lost.load(), 22u);  // 18 of the 40 are kept at most
  EXPECT_EQ(gray_out_.newest(), 0u);
}

TEST_F(CameraRelayTest, ReorderedExposuresChangePlacesInPairs) {
  set(FaultPoint::kCameraReorder);
  for (std::uint32_t n = 1; n <= 4; ++n) show_both(n);
  for (const std::uint32_t n : {2u, 1u, 4u, 3u}) {
    EXPECT_EQ(take_depth().header.sequence, n);
    const Seen gray = take_gray();
    EXPECT_EQ(gray.header.sequence, n);
    EXPECT_EQ(gray.gray(0), n);
  }
}

TEST_F(CameraRelayTest, DuplicatesAreTheSameFrameOnceMore) {
  set(FaultPoint::kCameraDuplicate, 2);
  show_both(1);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(take_gray().header.sequence, 1u);
    EXPECT_EQ(take_depth().header.exposed_at_ns, exposed(1));
  }
  clear(FaultPoint::kCameraDuplicate);
  pass_pair(2);
}

TEST_F(CameraRelayTest, HeadersSayWhatTheirFaultsSay) {
  std::uint32_t n = 0;
  const auto header_with = [&](FaultPoint point, float value) {
    set(point, value);
    show_gray(++n);
    const FrameHeader h = take_gray().header;
    clear(point);
    return h;
  };
  EXPECT_EQ(header_with(FaultPoint::kCameraSize, 0.5f).width_px, kWidth / 2);
  EXPECT_EQ(header_with(FaultPoint::kCameraSize, 100).width_px, kWidth * 100);
  FrameHeader stamped = header_with(FaultPoint::kCameraStampAhead, 250);
  EXPECT_EQ(stamped.exposed_at_ns, exposed(n) + 250 * kMillisecond);
  stamped = header_with(FaultPoint::kCameraStampBack, 250);
  EXPECT_EQ(stamped.exposed_at_ns, exposed(n) - 250 * kMillisecond);
  const FrameHeader torn = header_with(FaultPoint::kCameraTornHeader, 0);
  EXPECT_EQ(torn.sequence, n);
  EXPECT_TRUE(torn.width_px != kWidth && torn.height_px != kHeight && torn.format != PixelFormat::kMono8);
  FrameSource source(relayed_, flight_, Stream::kGray);
  set(FaultPoint::kCameraTornHeader);
  show_gray(++n);
  EXPECT_FALSE(source.wait(rt::now() + 60 * kSecond, true));  // not followed
  EXPECT_EQ(gray_out_.newest(), n);
}

TEST_F(CameraRelayTest, StampsStickAndCountsWrapAndRestart) {
  set(FaultPoint::kCameraStampStuck);
  for (std::uint32_t n = 1; n <= 3; ++n) {
    show_both(n);
    EXPECT_EQ(take_depth().header.exposed_at_ns, exposed(1));
    EXPECT_EQ(take_gray().header.exposed_at_ns, exposed(1));
  }
  clear(FaultPoint::kCameraStampStuck);
  set(FaultPoint::kCameraSequenceWrap);
  for (std::uint32_t n = 4; n <= 7; ++n) {
    show_both(n);
    EXPECT_EQ(take_depth().header.sequence, n - 6u);  // 2^32 - 2, 2^32 - 1, 0, 1
    EXPECT_EQ(take_gray().header.sequence, n - 6u);
  }
  clear(FaultPoint::kCameraSequenceWrap);
  set(FaultPoint::kCameraSequenceRestart);
  for (std::uint32_t n = 8; n <= 10; ++n) {
    show_gray(n);
    EXPECT_EQ(take_gray().header.sequence, n - 8u);
  }
}

TEST_F(CameraRelayTest, ImagesAreCorruptedAndDepthIsLeftAlone) {
  std::uint32_t n = 0;
  const auto image_with = [&](FaultPoint point) {
    set(point);
    show_both(++n);
    EXPECT_EQ(take_depth().depth(0), 1000 + n) << name_of(point);
    const Seen seen = take_gray();
    clear(point);
    return seen;
  };
  const auto all = [](const Seen& seen, std::uint8_t value) {
    return std::all_of(seen.bytes.begin(), seen.bytes.end(), [value](std::uint8_t x) { return x == value; });
  };
  EXPECT_TRUE(all(image_with(FaultPoint::kImageBlack), 0));
  EXPECT_TRUE(all(image_with(FaultPoint::kImageWhite), 255));
  const Seen torn = image_with(FaultPoint::kImageTear);
  EXPECT_EQ(torn.gray(0), n);
  EXPECT_EQ(torn.gray(kWidth * kHeight / 2 + 1), static_cast<std::uint8_t>(n - 1 + (kWidth * kHeight / 2 + 1) % 3));
  const Seen bright = image_with(FaultPoint::kImageGain);
  EXPECT_EQ(bright.gray(1), 3 * (n + 1));
  EXPECT_EQ(image_with(FaultPoint::kImageBand).gray(kWidth * kHeight / 2), 0);
  const Seen blurred = image_with(FaultPoint::kImageBlur);
  EXPECT_NEAR(blurred.gray(5), n + 1, 1);
  const Seen noisy = image_with(FaultPoint::kImageNoise);
  EXPECT_GT(std::set<std::uint8_t>(noisy.bytes.begin(), noisy.bytes.end()).size(), 30u);
}

TEST_F(CameraRelayTest, DepthIsCorruptedAndImagesAreLeftAlone) {
  std::uint32_t n = 0;
  const auto depth_with = [&](FaultPoint point) {
    set(point);
    show_both(++n);
    EXPECT_EQ(take_gray().gray(0), n) << name_of(point);
    const Seen seen = take_depth();
    clear(point);
    return seen;
  };
  const auto holes = [](const Seen& seen) {
    int count = 0;
    for (std::size_t i = 0; i < kWidth * kHeight; ++i) count += seen.depth(i) == 0;
    return count;
  };
  EXPECT_EQ(holes(depth_with(FaultPoint::kDepthNone)), static_cast<int>(kWidth * kHeight));
  set(FaultPoint::kDepthHoles, 1);
  show_both(++n);
  EXPECT_EQ(holes(take_depth()), static_cast<int>(kWidth * kHeight));
  take_gray();
  clear(FaultPoint::kDepthHoles);
  const Seen biased = depth_with(FaultPoint::kDepthBias);
  EXPECT_EQ(biased.depth(0), 1300 + n);
  EXPECT_EQ(depth_with(FaultPoint::kDepthQuantise).depth(1), 1000);
  EXPECT_EQ(depth_with(FaultPoint::kDepthZero).depth(2), 1);
  EXPECT_EQ(depth_with(FaultPoint::kDepthFar).depth(2), 65535);
  const Seen noisy = depth_with(FaultPoint::kDepthNoise);
  EXPECT_EQ(holes(noisy), 0);
  std::set<std::uint16_t> values;
  for (std::size_t i = 0; i < kWidth * kHeight; ++i) values.insert(noisy.depth(i));
  EXPECT_GT(values.size(), 100u);
}

TEST_F(CameraRelayTest, AFrameOverwrittenDuringTheCopyIsNeverPublished) {
  // A writer that never waits, many times faster than any camera: what comes through is whole, and what is lost
  // counted.
  std::atomic<bool> over{false};
  std::thread writer([&] {
    for (std::uint32_t n = 1; !over; ++n) {
      std::byte* slot = gray_.loan();
      FrameHeader h;
      h.exposed_at_ns = exposed(n);
      h.sequence = n;
      h.format = PixelFormat::kMono8;
      h.width_px = h.stride_bytes = kWidth;
      h.height_px = kHeight;
      std::memcpy(slot, &h, sizeof h);
      std::memset(slot + kFramePixelOffset, static_cast<int>(n & 255), kWidth * kHeight);
      gray_.publish(rt::now());
    }
  });
  std::uint32_t last = 0;
  int whole = 0;
  while (whole < 2000) {
    if (!gray_out_.wait(rt::now() + 60 * kSecond)) break;
    const shm::Sample sample = gray_out_.next();
    if (!sample) continue;
    FrameHeader h;
    std::memcpy(&h, sample.data, sizeof h);
    std::vector<std::uint8_t> pixels(kWidth * kHeight);
    std::memcpy(pixels.data(), sample.data + kFramePixelOffset, pixels.size());
    if (!gray_out_.intact(sample)) continue;
    ++whole;
    EXPECT_GT(h.sequence, last);
    last = h.sequence;
    EXPECT_TRUE(std::all_of(pixels.begin(), pixels.end(), [&](std::uint8_t x) { return x == (h.sequence & 255); }));
  }
  over = true;
  writer.join();
  EXPECT_EQ(whole, 2000);
}

}  // namespace
}  // namespace wasp::scheduling
