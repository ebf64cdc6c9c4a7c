// The tap between a real pseudo-terminal and a real serial port.
#include "faults/wire_tap.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "rt/clock.h"
#include "tests/support/child.h"

namespace wasp::faults {
namespace {

struct Line {
  std::string folder = testing::TempDir() + "wasp_tap_" + std::to_string(getpid());
  sim::Pty autopilot{folder + ".autopilot"};
  WireTap tap{folder + ".autopilot", folder + ".flight"};
  std::unique_ptr<drivers::LinePort> flight =
      std::make_unique<drivers::LinePort>(drivers::Endpoint{folder + ".flight", 921600});

  /// What the flight hears until `n` bytes, or ten seconds, have passed.
  std::vector<std::uint8_t> flight_hears(std::size_t n) {
    std::vector<std::uint8_t> heard;
    const TimeNs end_ns = rt::now() + 10 * kSecond;
    while (heard.size() < n && rt::now() < end_ns) {
      std::array<std::uint8_t, 256> buffer;
      if (!flight->wait_readable(rt::now() + 20 * kMillisecond)) continue;
      const auto got = flight->read(buffer);
      heard.insert(heard.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(got.bytes));
    }
    return heard;
  }
  std::vector<std::uint8_t> autopilot_hears(std::size_t n) {
    std::vector<std::uint8_t> heard;
    const TimeNs end_ns = rt::now() + 10 * kSecond;
    while (heard.size() < n && rt::now() < end_ns) {
      if (!autopilot.wait(rt::now() + 20 * kMillisecond)) continue;
      const auto got = autopilot.read();
      heard.insert(heard.end(), got.begin(), got.end());
    }
    return heard;
  }
};

const std::vector<std::uint8_t> kWord = {1, 2, 3, 4, 250, 251, 252, 253};

TEST(WireTap, PassesBothWaysAndLogsWithTimes) {
  Line line;
  const TimeNs before_ns = rt::now();
  line.flight->write(kWord);
  EXPECT_EQ(line.autopilot_hears(kWord.size()), kWord);
  line.autopilot.write(kWord);
  EXPECT_EQ(line.flight_hears(kWord.size()), kWord);
  std::array<std::vector<std::uint8_t>, 2> logged;
  for (std::size_t i = 0; i < line.tap.log().size(); ++i) {
    const WireChunk& chunk = line.tap.log().at(i);
    EXPECT_GE(chunk.at_ns, before_ns);
    EXPECT_LE(chunk.at_ns, rt::now());
    auto& bytes = logged[static_cast<std::size_t>(chunk.direction)];
    bytes.insert(bytes.end(), chunk.bytes.begin(), chunk.bytes.end());
  }
  EXPECT_EQ(logged[0], kWord);
  EXPECT_EQ(logged[1], kWord);
}

TEST(WireTap, AFaultWorksInItsDirectionUntilItIsTakenAway) {
  Line line;
  const int number = line.tap.add({WireFaultKind::kSilence, Direction::kToFlight});
  line.autopilot.write(kWord);
  line.flight->write(kWord);
  EXPECT_EQ(line.autopilot_hears(kWord.size()), kWord) << "the other direction is untouched";
  EXPECT_TRUE(wasp::test::eventually([&] { return line.tap.log().size() >= 2; }));
  line.tap.remove(number);
  line.autopilot.write({kWord.begin(), kWord.begin() + 1});
  EXPECT_EQ(line.flight_hears(1), (std::vector<std::uint8_t>{1})) << "what was silenced is lost, not late";
}

TEST(WireTap, HangsUpForWhoeverHasItOpenAndComesBackUnderTheSameName) {
  Line line;
  line.tap.hang_up();
  std::array<std::uint8_t, 16> buffer;
  EXPECT_TRUE(line.flight->wait_readable(rt::now() + 10 * kSecond));
  EXPECT_EQ(line.flight->read(buffer).status, drivers::IoStatus::kGone);
  EXPECT_FALSE(line.flight->try_reopen());
  line.tap.come_back();
  ASSERT_TRUE(line.flight->try_reopen());
  line.flight->write(kWord);
  EXPECT_EQ(line.autopilot_hears(kWord.size()), kWord);
}

TEST(WireTap, WritesInBetween) {
  Line line;
  line.tap.inject(Direction::kToFlight, kWord);
  EXPECT_EQ(line.flight_hears(kWord.size()), kWord);
}

}  // namespace
}  // namespace wasp::faults
