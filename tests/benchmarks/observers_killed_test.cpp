// A few hundred of the kills that `wasp bench observers` does by the ten thousand. How fast the writer was is no
// matter here.
#include "benchmarks/observers_killed.h"

#include <gtest/gtest.h>

namespace wasp::bench {
namespace {

TEST(ObserversKilled, NothingTornIsAcceptedAndNoSlotIsLeaked) {
  const KillResult result = torment_observers({.kills = 300, .kills_a_block = 100});
  ASSERT_EQ(result.trouble, "");
  EXPECT_GE(result.deaths, 300u);
  EXPECT_GT(result.freezes, 0u);
  EXPECT_GT(result.accepted, 1000u);
  EXPECT_EQ(result.torn, 0u);
  EXPECT_EQ(result.backwards, 0u);
  EXPECT_EQ(result.slots_leaked, 0u);
  EXPECT_FALSE(result.spared.message_ns.empty());
  EXPECT_FALSE(result.tormented.frame_ns.empty());
}

TEST(ObserversKilled, TheSameCheckCatchesObserversThatDoNotLookAgain) {
  std::uint64_t torn = 0;
  for (int round = 0; round < 20 && torn == 0; ++round) torn = torment_observers({.kills = 120, .careful = false}).torn;
  EXPECT_GT(torn, 0u);
}

}  // namespace
}  // namespace wasp::bench
