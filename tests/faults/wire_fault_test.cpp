// What each fault does to the bytes, and that it does nothing else.
#include "faults/wire_fault.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "faults/uart_line.h"
#include "messages/mavlink_frame.h"

namespace wasp::faults {
namespace {

std::vector<std::uint8_t> counting(std::size_t n) {
  std::vector<std::uint8_t> bytes(n);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  return bytes;
}

std::vector<std::uint8_t> through(const WireFault& fault, const std::vector<std::uint8_t>& bytes) {
  WireMangler mangler(fault);
  std::vector<std::uint8_t> out;
  mangler.feed(bytes, 0, out);
  return out;
}

/// Heartbeat, attitude, inertial sample, acknowledgement of an autopilot, `n` times.
std::vector<std::uint8_t> autopilot_stream(int n = 1) {
  mavlink::Encoder encoder(1, 1);
  std::vector<std::uint8_t> stream;
  const auto add = [&](const auto& message) {
    std::array<std::uint8_t, mavlink::kMaxFrame> bytes;
    const std::size_t size = encoder.encode(message, bytes);
    stream.insert(stream.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
  };
  for (int i = 0; i < n; ++i) {
    mavlink::Heartbeat beat{};
    beat.custom_mode = 1, beat.base_mode = 128 | 8, beat.system_status = 4;
    add(beat);
    mavlink::AttitudeQuaternion attitude{};
    attitude.q1 = 1, attitude.q2 = 0.01f * static_cast<float>(i),
    attitude.time_boot_ms = static_cast<std::uint32_t>(1000 + i);
    add(attitude);
    mavlink::HighresImu imu{};
    imu.zacc = -9.81f, imu.time_usec = 1'000'000;
    add(imu);
    mavlink::CommandAck ack{};
    ack.command = 400, ack.target_system = 1;
    add(ack);
  }
  return stream;
}

struct Heard {
  std::vector<mavlink::Heartbeat> beats;
  std::vector<mavlink::AttitudeQuaternion> attitudes;
  std::vector<mavlink::HighresImu> imus;
  std::vector<mavlink::CommandAck> acks;
  std::vector<int> systems;
  std::uint64_t bad = 0;
};

Heard hear(const std::vector<std::uint8_t>& bytes) {
  Heard heard;
  mavlink::Parser parser;
  parser.feed(bytes, [&](const mavlink::Frame& f) {
    heard.systems.push_back(f.system_id);
    if (f.is<mavlink::Heartbeat>()) heard.beats.push_back(f.as<mavlink::Heartbeat>());
    if (f.is<mavlink::AttitudeQuaternion>()) heard.attitudes.push_back(f.as<mavlink::AttitudeQuaternion>());
    if (f.is<mavlink::HighresImu>()) heard.imus.push_back(f.as<mavlink::HighresImu>());
    if (f.is<mavlink::CommandAck>()) heard.acks.push_back(f.as<mavlink::CommandAck>());
  });
  heard.bad = parser.counts().bad_crc;
  return heard;
}

Heard heard_through(WireFaultKind kind, double value = 0, int n = 1) {
  return hear(through({kind, Direction::kToFlight, value}, autopilot_stream(n)));
}

TEST(WireFault, SilenceLetsNothingPass) { EXPECT_TRUE(through({WireFaultKind::kSilence}, counting(1000)).empty()); }

TEST(WireFault, BytesFlipDropAndDoubleAtTheirRate) {
  const auto bytes = counting(100'000);
  const auto flipped = through({WireFaultKind::kFlip, Direction::kToFlight, 100}, bytes);
  ASSERT_EQ(flipped.size(), bytes.size());
  int changed = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (flipped[i] == bytes[i]) continue;
    ++changed;
    EXPECT_EQ(std::popcount(static_cast<unsigned>(flipped[i] ^ bytes[i])), 1);
  }
  EXPECT_NEAR(changed, 1000, 150);
  const auto dropped = through({WireFaultKind::kDrop, Direction::kToFlight, 100}, bytes).size();
  EXPECT_NEAR(static_cast<double>(dropped), 99'000, 150);
  const auto doubled = through({WireFaultKind::kDuplicate, Direction::kToFlight, 100}, bytes).size();
  EXPECT_NEAR(static_cast<double>(doubled), 101'000, 150);
}

TEST(WireFault, TheSameSeedDoesTheSame) {
  const auto bytes = counting(10'000);
  const auto with = [&](std::uint32_t seed) {
    return through({WireFaultKind::kFlip, Direction::kToFlight, 50, seed}, bytes);
  };
  EXPECT_EQ(with(7), with(7));
  EXPECT_NE(with(7), with(8));
}

TEST(WireFault, DelayHandsOnEverythingInOrderAndNotBefore) {
  WireMangler mangler({WireFaultKind::kDelay, Direction::kToFlight, 30});
  std::vector<std::uint8_t> out;
  mangler.feed(counting(10), 0, out);
  mangler.feed(counting(20), 10 * kMillisecond, out);
  EXPECT_TRUE(out.empty());
  mangler.due(29 * kMillisecond, out);
  EXPECT_TRUE(out.empty());
  mangler.due(30 * kMillisecond, out);
  EXPECT_EQ(out, counting(10));
  mangler.due(kSecond, out);
  EXPECT_EQ(out.size(), 30u);
}

TEST(WireFault, FloodComesAtItsRate) {
  WireMangler mangler({WireFaultKind::kFlood, Direction::kToFlight, 60'000});
  std::vector<std::uint8_t> out;
  for (int ms = 0; ms <= 1000; ms += 2) mangler.due(ms * kMillisecond, out);
  EXPECT_NEAR(static_cast<double>(out.size()), 60'000, 600);
}

TEST(WireFault, HalfOfEveryPieceIsLostAndNeighboursChangePlaces) {
  EXPECT_EQ(through({WireFaultKind::kHalf}, counting(100)), counting(50));
  WireMangler mangler({WireFaultKind::kReorder});
  std::vector<std::uint8_t> out;
  mangler.feed(std::vector<std::uint8_t>{1, 2}, 0, out);
  mangler.feed(std::vector<std::uint8_t>{3, 4}, 0, out);
  EXPECT_EQ(out, (std::vector<std::uint8_t>{3, 4, 1, 2}));
}

TEST(WireFault, RewrittenFramesHoldTheirChecksumAndOnlyTheirMessageChanges) {
  const Heard mode = heard_through(WireFaultKind::kMode, 9);
  EXPECT_EQ(mode.beats.at(0).custom_mode, 9u);
  EXPECT_EQ(mode.beats.at(0).base_mode, 128 | 8);
  EXPECT_EQ(heard_through(WireFaultKind::kDisarmed).beats.at(0).base_mode, 8);
  EXPECT_EQ(heard_through(WireFaultKind::kDenyCommand).acks.at(0).result, mavlink::mav_result::kDenied);
  const Heard nan = heard_through(WireFaultKind::kAttitudeNan);
  EXPECT_TRUE(std::isnan(nan.attitudes.at(0).q1));
  EXPECT_EQ(nan.imus.at(0).zacc, -9.81f);
  EXPECT_TRUE(std::isnan(heard_through(WireFaultKind::kImuNan).imus.at(0).zacc));
  EXPECT_EQ(heard_through(WireFaultKind::kImuHuge).imus.at(0).zacc, 1e30f);
  EXPECT_TRUE(heard_through(WireFaultKind::kImuLost).imus.empty());
  EXPECT_TRUE(heard_through(WireFaultKind::kAttitudeLost).attitudes.empty());
  for (const auto& heard : {mode, nan}) {
    EXPECT_EQ(heard.systems.size(), 4u);
    EXPECT_EQ(heard.bad, 0u);
  }
}

TEST(WireFault, AFrozenAttitudeKeepsItsNumbersAndItsTimeGoesOn) {
  const Heard heard = heard_through(WireFaultKind::kAttitudeFrozen, 0, 3);
  ASSERT_EQ(heard.attitudes.size(), 3u);
  EXPECT_EQ(heard.attitudes[2].q2, 0.f);
  EXPECT_EQ(heard.attitudes[2].time_boot_ms, 1002u);
}

TEST(WireFault, SlowSpikesAndClockSteps) {
  EXPECT_EQ(heard_through(WireFaultKind::kAttitudeSlow, 10, 100).attitudes.size(), 10u);
  const Heard spiked = heard_through(WireFaultKind::kAttitudeSpike, 10, 100);
  EXPECT_EQ(std::ranges::count_if(spiked.attitudes, [](const auto& m) { return m.q1 == 0; }), 10);
  const Heard stepped = heard_through(WireFaultKind::kClockStep, 7);
  EXPECT_EQ(stepped.attitudes.at(0).time_boot_ms, 8000u);
  EXPECT_EQ(stepped.imus.at(0).time_usec, 8'000'000u);
}

TEST(WireFault, AnotherSystemIdWithAChecksumThatHolds) {
  const Heard heard = heard_through(WireFaultKind::kSystemId, 7);
  EXPECT_EQ(heard.systems, (std::vector<int>{7, 7, 7, 7}));
  EXPECT_EQ(heard.bad, 0u);
}

TEST(UartLine, TheRightRateHearsEveryByteAndAFewPercentAreForgiven) {
  const auto bytes = counting(256);
  EXPECT_EQ(heard_at(bytes, 115200, 115200), bytes);
  EXPECT_EQ(heard_at(bytes, 115200, 115200 * 1.02), bytes);
  EXPECT_EQ(heard_at(bytes, 115200, 115200 * 0.98), bytes);
}

TEST(UartLine, AWrongRateHearsOtherBytesAndNoFrame) {
  const auto stream = autopilot_stream(20);
  for (const double rate : {0.5, 2.0, 1.06}) {
    const auto heard = heard_at(stream, 1, rate);
    EXPECT_NE(heard, stream) << rate;
    EXPECT_TRUE(hear(heard).systems.empty()) << rate;
  }
  EXPECT_FALSE(heard_at(stream, 1, 2.0).empty());
}

TEST(UartLine, HalfTheRateReadsPairsOfBits) {
  // 0x00: ten bits, nine low and a stop; at half the rate start and five low halves are one byte's beginning.
  const auto heard = heard_at(std::vector<std::uint8_t>{0x00, 0x00}, 1, 0.5);
  ASSERT_FALSE(heard.empty());
  EXPECT_NE(heard[0], 0x00) << "the stop bit in the middle is read as data";
}

}  // namespace
}  // namespace wasp::faults
