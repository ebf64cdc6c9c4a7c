// What the log says of counters that rise: at once, the total when it is over, never a flood.
#include "scheduling/burst_report.h"

#include <gtest/gtest.h>

namespace wasp::scheduling {
namespace {

struct BurstReportTest : ::testing::Test {
  std::atomic<std::uint64_t> duplicate{5}, misdated{0};
  BurstReport report{"frames refused", {{&duplicate, "duplicate"}, {&misdated, "misdated"}}};
  std::vector<std::string> lines;
  TimeNs now_ns = 100 * kSecond;
  void look(DurationNs later_ns = 50 * kMillisecond) {
    report.look(now_ns += later_ns, [this](const std::string& line) { lines.push_back(line); });
  }
};

TEST_F(BurstReportTest, ABurstIsToldAtOnceAndItsTotalWhenItIsOver) {
  look();
  EXPECT_TRUE(lines.empty());  // what was counted before is nobody's news
  duplicate += 2;
  look();
  EXPECT_EQ(lines, std::vector<std::string>{"frames refused: 2 duplicate"});
  for (int i = 0; i < 100; ++i) {
    ++duplicate;
    if (i % 10 == 0) ++misdated;
    look();
  }
  EXPECT_EQ(lines.size(), 1u);
  look(BurstReport::kQuiet);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[1], "frames refused: 102 duplicate, 10 misdated in 5.0 s, over now");
  look(BurstReport::kQuiet);
  EXPECT_EQ(lines.size(), 2u);
  ++misdated;
  look();
  EXPECT_EQ(lines.back(), "frames refused: 1 misdated");  // a new burst
  look(BurstReport::kQuiet);
  EXPECT_EQ(lines.size(), 3u);  // nothing more to say of it
}

TEST_F(BurstReportTest, AWordThatFellSaysNothing) {
  duplicate = 0;
  look();
  look(BurstReport::kQuiet);
  EXPECT_TRUE(lines.empty());
}

}  // namespace
}  // namespace wasp::scheduling
