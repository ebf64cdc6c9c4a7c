// The pure parts of the drivers, and the account that the rings keep.
#include <gtest/gtest.h>

#include "drivers/exposure_time.h"
#include "drivers/v4l2_mode.h"
#include "drivers/wall_clock_map.h"
#include "shm/topics.h"
#include "sim/owned_region.h"
#include "tools/camera_rings.h"

namespace wasp {
namespace {

using namespace drivers;

TEST(ExposureTime, TheMiddleIsFoundFromEitherEnd) {
  EXPECT_EQ(mid_exposure(1000, StampSource::kStartOfExposure, 200, 50), 1100);
  EXPECT_EQ(mid_exposure(1000, StampSource::kEndOfFrame, 200, 50), 850);
  static_assert(!believable_stamp(1001, 1000) && believable_stamp(1000, 1000) && !believable_stamp(0, kSecond));
}

TEST(WallClockMap, AStepIsNotBelievedAndAnyOffsetIs) {
  WallClockMap map;
  const std::int64_t year = 31'000'000 * kSecond;
  EXPECT_EQ(map.to_monotonic(year + 900, {1000, year + 1000}), 900) << "whatever the wall clock says";
  EXPECT_EQ(map.to_monotonic(year + 1900, {2000, year + 2000}), 1900);
  EXPECT_EQ(map.to_monotonic(year + 2900, {3000, year + 3000 + kSecond / 2}), std::nullopt) << "half a second ahead";
  EXPECT_EQ(map.to_monotonic(year + 3900 + kSecond / 2, {4000, year + 4000 + kSecond / 2}), 3900) << "and then steady";
  EXPECT_EQ(map.to_monotonic(year, {5000, year - 10}), std::nullopt) << "from the future";
}

CameraRequest request(int width_px, int height_px, double rate_hz, const std::string& pixels = {}) {
  CameraRequest r;
  r.width_px = width_px, r.height_px = height_px, r.rate_hz = rate_hz;
  r.settings.pixel_format = pixels;
  return r;
}

TEST(V4l2Mode, TheCheapestFormatThatIsFastEnoughIsTaken) {
  const std::vector<V4l2Mode> webcam{{V4L2_PIX_FMT_MJPEG, 1280, 720, {30}},
                                     {V4L2_PIX_FMT_YUYV, 1280, 720, {10, 5}},
                                     {V4L2_PIX_FMT_YUYV, 640, 480, {30, 15}},
                                     {V4L2_PIX_FMT_RGB24, 320, 240, {30}}};
  EXPECT_EQ(choose_mode(webcam, request(640, 480, 30), "x").fourcc, V4L2_PIX_FMT_YUYV);
  EXPECT_EQ(choose_mode(webcam, request(1280, 720, 30), "x").fourcc, V4L2_PIX_FMT_MJPEG);
  EXPECT_EQ(choose_mode(webcam, request(1280, 720, 10), "x").fourcc, V4L2_PIX_FMT_YUYV);
  EXPECT_EQ(choose_mode(webcam, request(1280, 720, 60), "x").fourcc, V4L2_PIX_FMT_YUYV) << "none is: the size counts";
  EXPECT_EQ(choose_mode(webcam, request(1280, 720, 10, "MJPG"), "x").fourcc, V4L2_PIX_FMT_MJPEG);
  EXPECT_THROW(choose_mode(webcam, request(320, 240, 30), "x"), CameraError) << "RGB is none of ours";
  EXPECT_THROW(choose_mode(webcam, request(640, 480, 30, "BA81"), "x"), CameraError);
}

struct Rings {
  std::string name = "wasp.test." + std::to_string(getpid()) + ".rings.camera";
  tools::CameraTopics topics = tools::front_topics(true);
  std::vector<shm::TopicSpec> specs = topics.specs(16, 16);
  sim::OwnedRegion owned{name, specs, "test"};
  tools::CameraRings rings{owned.region, topics, 16, 16};
  shm::RingReader gray{owned.region, shm::kGray, "Frame"}, depth{owned.region, shm::kDepth, "Frame"};

  static FrameHeader header(const shm::Sample& sample) {
    FrameHeader h;
    std::memcpy(&h, sample.data, sizeof h);
    return h;
  }
};

TEST(CameraRings, SequencesRiseOverEveryNewBeginningAndGapsAreCountedOnce) {
  Rings r;
  r.rings.opened();
  for (const std::uint32_t n : {7u, 8u, 11u}) r.rings.publish({.exposed_at_ns = 1, .sequence = n});
  EXPECT_EQ(r.rings.status().dropped, 2u) << "what came before the first is nobody's loss";
  r.rings.note_corrupt();
  r.rings.publish({.exposed_at_ns = 1, .sequence = 13});
  EXPECT_EQ(r.rings.status().dropped, 2u) << "12 was damaged, not dropped";
  EXPECT_EQ(r.rings.status().corrupt, 1u);
  r.rings.opened();
  r.rings.publish({.exposed_at_ns = 1, .sequence = 0});
  EXPECT_EQ(r.rings.status().dropped, 2u);
  EXPECT_EQ(r.rings.status().frames, 5u);
  std::uint32_t last = 0;
  for (shm::Sample s = r.gray.next(); s; s = r.gray.next()) {
    EXPECT_GT(Rings::header(s).sequence, last);
    last = Rings::header(s).sequence;
  }
  EXPECT_EQ(last, 8u) << "1 2 5 7 8";
}

TEST(CameraRings, BothImagesOfAnExposureBearOneNumberHoweverTheyCome) {
  Rings r;
  r.rings.opened();
  r.rings.publish({.exposed_at_ns = 5, .sequence = 1});
  r.rings.publish({.exposed_at_ns = 6, .sequence = 2, .gray = false});
  EXPECT_EQ(r.gray.newest(), 1u);
  EXPECT_EQ(r.depth.newest(), 2u);
  r.rings.publish({.exposed_at_ns = 6, .sequence = 2, .depth = false});
  EXPECT_EQ(r.rings.status().frames, 2u);
  EXPECT_EQ(Rings::header(r.gray.look(2)).sequence, Rings::header(r.depth.look(2)).sequence);
  r.rings.publish({.exposed_at_ns = 7, .sequence = 3, .depth = false});
  EXPECT_EQ(r.depth.newest(), 2u) << "an exposure without depth";
  EXPECT_EQ(r.rings.status().dropped, 0u);
}

}  // namespace
}  // namespace wasp
