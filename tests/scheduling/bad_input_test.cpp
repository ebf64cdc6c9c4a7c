// "Bad input" on the autopilot's line, one test for each: what comes must be survived, counted and named, and the good
// samples between it must go on reaching the rings.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <thread>

#include "scheduling/link_loop.h"
#include "tests/scheduling/control_bench.h"
#include "types/position_sample.h"

namespace wasp::scheduling {
namespace {

class BadInput : public ::testing::Test {
 protected:
  BadInput()
      : instance_("test-bad-" + std::to_string(getpid())),
        line_(std::make_unique<PtyLine>()),
        flight_(create_flight_region(instance_, {}, false)),
        port_(drivers::Endpoint::parse(line_->endpoint())),
        watch_(board_.add({"link", -1, 0, kMillisecond})),
        loop_(flight_, port_, link_, stage_table(flight_), report_, events_, watch_),
        attitude_(flight_, shm::kAttitude, "Attitude") {
    control_.status = &run_status(flight_);
    thread_ = std::thread([this] { loop_.run(control_); });
  }
  ~BadInput() override {
    control_.stop = true;
    thread_.join();
    shm::Region::remove(flight_.name());
  }
  template <class M>
  std::vector<std::uint8_t> frame(const M& message) {
    std::vector<std::uint8_t> out(mavlink::kMaxFrame);
    out.resize(encoder_.encode(message, out));
    return out;
  }
  /// A new attitude each time: noise makes every reading another number.
  std::vector<std::uint8_t> attitude() {
    mavlink::AttitudeQuaternion m;
    const float yaw_rad = 1e-4f * static_cast<float>(++attitudes_);
    m.q1 = std::cos(yaw_rad / 2), m.q4 = std::sin(yaw_rad / 2);
    return frame(m);
  }
  std::vector<std::uint8_t> noise(std::size_t n) {
    std::vector<std::uint8_t> bytes(n);
    for (auto& b : bytes) b = static_cast<std::uint8_t>(random_());
    return bytes;
  }
  static void rest(int ms = 2) { rt::sleep_until(rt::now() + ms * kMillisecond); }
  template <class Condition>
  static bool soon(Condition&& condition) {
    for (int i = 0; i < 15'000; ++i, rest())
      if (condition()) return true;
    return false;
  }
  std::string said(const std::string& words) {
    Event e;
    while (events_.take(e)) texts_.emplace_back(e.text.data());
    for (const auto& t : texts_)
      if (t.find(words) != std::string::npos) return t;
    return {};
  }
  long times_said(const std::string& words) {
    said(words);
    return std::count_if(texts_.begin(), texts_.end(),
                         [&](const auto& t) { return t.find(words) != std::string::npos; });
  }

  std::string instance_;
  std::unique_ptr<PtyLine> line_;
  shm::Region flight_;
  drivers::LinePort port_;
  drivers::AutopilotLink link_;
  rt::Seqlock<LinkReport> report_;
  EventQueue events_;
  WatchBoard board_;
  ThreadWatch& watch_;
  LinkLoop loop_;
  LoopControl control_;
  shm::RingReader attitude_;
  mavlink::Encoder encoder_{1, 1};
  std::mt19937 random_{7};
  int attitudes_ = 0;
  std::vector<std::string> texts_;
  std::thread thread_;
};

TEST_F(BadInput, AWrongBaudRateIsNamedOnceWithItsCounts) {
  for (int i = 0; i < 1200 && said("wrong baud rate?").empty(); ++i, rest(5)) {
    auto bytes = attitude();
    for (auto& b : bytes) b = static_cast<std::uint8_t>(b << 3 | b >> 6);  // no bit stands where it stood
    line_->write(bytes);
  }
  const std::string text = said("wrong baud rate?");
  EXPECT_NE(text.find(" bytes but no frame (0 before)"), std::string::npos) << text;
  for (int i = 0; i < 100; ++i, rest(2)) line_->write(noise(40));
  EXPECT_EQ(times_said("wrong baud rate?"), 1);
  EXPECT_EQ(attitude_.newest(), 0u);
  line_->write(noise(300));
  EXPECT_TRUE(soon([&] {
    line_->write(attitude());
    return attitude_.newest() > 0;
  })) << "it is set right";
}

TEST_F(BadInput, AGarbageFloodDoesNotKeepTheGoodFramesOut) {
  std::uint64_t flood = 0;
  for (int i = 0; i < 150; ++i, rest(2)) {
    const auto garbage = noise(600);
    line_->write(garbage);
    line_->write(attitude());
    flood += garbage.size();
  }
  // A frame's first bytes may fall to a claim that noise made before it; the next one is found.
  EXPECT_TRUE(soon([&] {
    line_->write(attitude());
    return attitude_.newest() >= 140;
  })) << attitude_.newest();
  EXPECT_GT(link_.wire_counts().skipped_bytes, flood / 2);
  EXPECT_LT(watch_.misses_unreported.load(), 50u);
}

TEST_F(BadInput, HalfFramesCostThemselvesAndNoOther) {
  for (int i = 0; i < 50; ++i, rest(2)) {
    const auto whole = attitude();
    line_->write(std::span(whole).first(whole.size() / 2));
    line_->write(attitude());
  }
  EXPECT_TRUE(soon([&] {
    line_->write(attitude());
    return attitude_.newest() >= 50;
  })) << attitude_.newest();
  EXPECT_GE(link_.wire_counts().bad_crc + link_.wire_counts().bad_header, 40u);
}

TEST_F(BadInput, RepeatedSequenceNumbersAreCountedAndNoLoss) {
  const auto beat = frame(mavlink::Heartbeat{});
  for (int i = 0; i < 21; ++i) line_->write(beat);
  ASSERT_TRUE(soon([&] { return link_.wire_counts().good >= 21; }));
  EXPECT_EQ(link_.sources()[0].repeated, 20u);
  EXPECT_EQ(link_.wire_counts().sequence_lost, 0u);
}

TEST_F(BadInput, AWrongSystemIdIsNamed) {
  encoder_ = mavlink::Encoder(42, 1);
  EXPECT_TRUE(soon([&] {
    line_->write(frame(mavlink::Heartbeat{}));
    return !said("another system speaks, id 42: [autopilot] system_id?").empty();
  }));
  line_->write(attitude());
  rest(50);
  EXPECT_EQ(attitude_.newest(), 0u);
}

TEST_F(BadInput, ADeviceThatVanishesMidReadIsSaidAndTheThreadGoesOn) {
  std::atomic<bool> over{false};
  std::thread chatter([&] {
    while (!over) {
      if (line_ != nullptr) line_->write(attitude());
      rest(1);
      if (attitudes_ == 40) break;
    }
  });
  ASSERT_TRUE(soon([&] { return attitude_.newest() > 5; }));
  over = true;
  chatter.join();
  const auto last = attitude();
  line_->write(std::span(last).first(9));  // in the middle of a frame
  line_.reset();
  EXPECT_TRUE(soon([&] { return !said("serial line gone: ").empty(); }));
  rest(300);  // it looks for the device again and again; no thread hangs on it
  control_.stop = true;
  thread_.join();
  thread_ = std::thread([] {});
}

TEST_F(BadInput, APositionThatIsNotFiniteIsNotPublished) {
  shm::RingReader position(flight_, shm::kPosition, "Position");
  mavlink::LocalPositionNed m;
  m.x = std::numeric_limits<float>::quiet_NaN();
  line_->write(frame(m));
  m.x = 3;
  line_->write(frame(m));
  ASSERT_TRUE(soon([&] { return position.newest() == 1; }));
  PositionSample sample;
  ASSERT_TRUE(position.read(sample));
  EXPECT_EQ(sample.position_ned_m[0], 3.f);
}

}  // namespace
}  // namespace wasp::scheduling
