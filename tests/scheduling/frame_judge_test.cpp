// What is a new image of now: late, repeated, reordered, misdated and stuck frames, wrapped and restarted counts.
#include "scheduling/frame_judge.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "scheduling/image_hash.h"

namespace wasp::scheduling {
namespace {

constexpr DurationNs kFrame = 33 * kMillisecond;
constexpr FrameRules kLive{.live = true, .age_limit_ns = 95 * kMillisecond, .stuck_frames = 2};

struct FrameJudgeTest : ::testing::Test {
  FrameJudge judge{kLive};
  TimeNs now_ns = 1000 * kSecond;
  std::uint64_t image = 1;

  /// A frame exposed `age_ns` ago that nobody finds fault with.
  FrameFault good(std::uint32_t sequence, DurationNs age_ns = 20 * kMillisecond) {
    now_ns += kFrame;
    return judge.judge({sequence, now_ns - age_ns, ++image}, now_ns);
  }
};

TEST_F(FrameJudgeTest, AStreamOfNewFramesPasses) {
  for (std::uint32_t n = 0; n < 100; ++n) EXPECT_EQ(good(n), FrameFault::kNone);
  EXPECT_EQ(judge.counts().refused, FrameCounts{}.refused);
  EXPECT_EQ(judge.counts().frozen, 0u);
}

TEST_F(FrameJudgeTest, TheSameSequenceOrTheSameExposureIsARepeat) {
  ASSERT_EQ(good(7), FrameFault::kNone);
  const TimeNs exposed_at_ns = now_ns - 20 * kMillisecond;
  EXPECT_EQ(judge.judge({7, exposed_at_ns, image}, now_ns + 1), FrameFault::kDuplicate);
  EXPECT_EQ(judge.judge({7, exposed_at_ns + kFrame, 98}, now_ns + kFrame), FrameFault::kDuplicate);
  EXPECT_EQ(judge.judge({8, exposed_at_ns, 99}, now_ns + kFrame), FrameFault::kDuplicate);
  EXPECT_EQ(judge.counts().of(FrameFault::kDuplicate), 3u);
  EXPECT_EQ(good(9), FrameFault::kNone);
}

TEST_F(FrameJudgeTest, AnOlderExposureThanOneUsedIsOutOfOrder) {
  ASSERT_EQ(good(1), FrameFault::kNone);
  ASSERT_EQ(good(3), FrameFault::kNone);
  EXPECT_EQ(judge.judge({2, now_ns - 20 * kMillisecond - kFrame / 2, 77}, now_ns), FrameFault::kDisordered);
  EXPECT_EQ(good(4), FrameFault::kNone);
}

TEST_F(FrameJudgeTest, TheFutureAndTheFarPastAreMisdatedAndLockNobodyOut) {
  ASSERT_EQ(good(1), FrameFault::kNone);
  EXPECT_EQ(judge.judge({2, now_ns + 10 * kSecond, 50}, now_ns), FrameFault::kMisdated);
  EXPECT_EQ(judge.judge({3, now_ns + FrameJudge::kAhead + 1, 51}, now_ns), FrameFault::kMisdated);
  EXPECT_EQ(judge.judge({4, now_ns - kLive.age_limit_ns - 1, 52}, now_ns), FrameFault::kMisdated);
  EXPECT_EQ(judge.judge({5, kNever, 53}, now_ns), FrameFault::kMisdated);
  EXPECT_EQ(judge.judge({6, INT64_MAX, 54}, now_ns), FrameFault::kMisdated);
  EXPECT_EQ(judge.judge({7, INT64_MIN, 55}, now_ns), FrameFault::kMisdated);
  EXPECT_EQ(good(8), FrameFault::kNone);
  EXPECT_EQ(judge.counts().of(FrameFault::kMisdated), 6u);
}

TEST_F(FrameJudgeTest, TheSequenceMayWrap) {
  for (std::uint32_t n = UINT32_MAX - 3; n != 5; ++n) EXPECT_EQ(good(n), FrameFault::kNone) << n;
}

TEST_F(FrameJudgeTest, ACameraThatCountsFromZeroAgainIsTakenAtOnce) {
  for (const std::uint32_t last : {1u, 1000u, 0x7fffffffu, 0x80000001u, 0xffffffffu}) {
    ASSERT_EQ(good(last), FrameFault::kNone);
    EXPECT_EQ(good(0), FrameFault::kNone) << last;
    EXPECT_EQ(good(1 + (last == 1)), FrameFault::kNone) << last;
  }
}

TEST_F(FrameJudgeTest, AStuckImageIsRefusedAtOnceAndTheCameraCountsAsFrozenAtTheSecondRepeat) {
  std::uint32_t n = 0;
  ASSERT_EQ(good(++n), FrameFault::kNone);
  for (int i = 0; i < 10; ++i) {
    now_ns += kFrame;
    EXPECT_EQ(judge.judge({++n, now_ns - 20 * kMillisecond, image}, now_ns), FrameFault::kDuplicate);
    EXPECT_EQ(judge.counts().frozen, i >= 1 ? 1u : 0u);  // within three frames of the last good one, and told once
  }
  EXPECT_EQ(good(++n), FrameFault::kNone);  // moves again: taken at once
  now_ns += kFrame;
  EXPECT_EQ(judge.judge({++n, now_ns, image}, now_ns), FrameFault::kDuplicate);
  EXPECT_EQ(good(++n), FrameFault::kNone);
  EXPECT_EQ(judge.counts().frozen, 1u);  // one repeat alone is no freeze
}

TEST_F(FrameJudgeTest, ImagesAreNotComparedWhereNoneAreHashedOrNobodyAsks) {
  ASSERT_EQ(judge.judge({1, now_ns, 0}, now_ns), FrameFault::kNone);
  EXPECT_EQ(judge.judge({2, now_ns + 1, 0}, now_ns + 1), FrameFault::kNone);
  FrameRules rules = kLive;
  rules.stuck_frames = 0;
  FrameJudge off(rules);
  for (std::uint32_t n = 1; n < 5; ++n) EXPECT_EQ(off.judge({n, now_ns + n, 5}, now_ns + n), FrameFault::kNone);
  EXPECT_TRUE(off.depth_is_new(5));
  EXPECT_TRUE(off.depth_is_new(5));
}

TEST_F(FrameJudgeTest, AReplayIsGivenAsItWasRecorded) {
  FrameJudge replay;
  for (const TimeNs at_ns : {5, 5, 3, 9}) EXPECT_EQ(replay.judge({1, at_ns, 5}, 1000 * kSecond), FrameFault::kNone);
}

TEST_F(FrameJudgeTest, ADepthImageThatStandsStillBesideALivingGreyOneIsFound) {
  EXPECT_TRUE(judge.depth_is_new(1));
  EXPECT_TRUE(judge.depth_is_new(2));
  EXPECT_FALSE(judge.depth_is_new(2));
  EXPECT_EQ(judge.counts().frozen, 0u);
  EXPECT_FALSE(judge.depth_is_new(2));
  EXPECT_EQ(judge.counts().frozen, 1u);
  EXPECT_TRUE(judge.depth_is_new(3));
  EXPECT_EQ(judge.counts().of(FrameFault::kDuplicate), 2u);
}

/// An image with noise of one grey level.
std::vector<std::uint8_t> noisy(std::size_t bytes, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> pixels(bytes);
  for (auto& p : pixels) p = static_cast<std::uint8_t>(100 + random() % 2);
  return pixels;
}

TEST(ImageHash, DiffersForTwoExposuresOfTheSameStillSceneAndNotForTheSameImage) {
  constexpr int kWidth = 640, kHeight = 480;
  const auto a = noisy(kWidth * kHeight, 1), b = noisy(kWidth * kHeight, 2);
  const auto copy = a;
  const auto hash = [](const auto& p) { return image_hash(GrayView{p.data(), kWidth, kHeight, kWidth}); };
  EXPECT_EQ(hash(a), hash(copy));
  EXPECT_NE(hash(a), hash(b));
}

TEST(ImageHash, SeesOneSampledPixelInEverySampledPlace) {
  constexpr int kWidth = 640, kHeight = 480;
  auto pixels = noisy(kWidth * kHeight, 3);
  const auto hash = [&] { return image_hash(GrayView{pixels.data(), kWidth, kHeight, kWidth}); };
  const std::uint64_t before = hash();
  int seen = 0;
  for (auto& p : pixels) {  // each changed by one level and back
    p ^= 1;
    seen += hash() != before ? 1 : 0;
    p ^= 1;
    if (&p - pixels.data() > kWidth * 20) break;  // two sampled rows and what lies between
  }
  EXPECT_EQ(seen, 2 * 5 * 64);  // every second of a row's ten pieces, columns staggered
  EXPECT_EQ(hash(), before);
}

TEST(ImageHash, NeverReadsBeyondTheRowsOfSmallAndOddImages) {
  for (const int width : {1, 3, 63, 64, 65, 129})
    for (const int height : {1, 2, 63, 65}) {
      std::vector<std::uint16_t> exact(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 7);
      const DepthView view{exact.data(), width, height, width};
      const std::uint64_t before = image_hash(view);
      EXPECT_NE(before, 0u);
      exact[0] ^= 1;
      EXPECT_NE(image_hash(view), before) << width << " x " << height;
    }
  EXPECT_EQ(image_hash(GrayView{}), 0u);
}

TEST(ImageHash, DoesNotDependOnWhatLiesBetweenTheRows) {
  std::vector<std::uint8_t> padded(100 * 50, 1);
  const GrayView view{padded.data(), 90, 50, 100};
  const std::uint64_t before = image_hash(view);
  for (std::size_t v = 0; v < 50; ++v) padded[v * 100 + 95] = 9;
  EXPECT_EQ(image_hash(view), before);
}

}  // namespace
}  // namespace wasp::scheduling
