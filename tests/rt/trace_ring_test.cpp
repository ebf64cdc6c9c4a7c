// The trace ring keeps the last events, stands still when frozen, and never shows a torn one.
#include "rt/trace_ring.h"

#include <gtest/gtest.h>

#include <thread>

namespace wasp::rt {
namespace {

TEST(TraceRing, KeepsTheLastEventsInOrder) {
  std::atomic<std::uint32_t> frozen{0};
  TraceRing ring(frozen);
  EXPECT_TRUE(ring.copy().empty());
  const std::uint64_t n = TraceRing::kEvents + 10;
  for (std::uint64_t i = 0; i < n; ++i)
    ring.record(static_cast<TimeNs>(i), TraceKind::kRelease, i, static_cast<DurationNs>(2 * i));
  const auto events = ring.copy();
  ASSERT_EQ(events.size(), TraceRing::kEvents - 1);  // the oldest slot may be under the writer's pen
  for (std::size_t k = 0; k < events.size(); ++k) {
    const auto i = static_cast<TimeNs>(n - events.size() + k);
    EXPECT_EQ(events[k].at_ns, i);
    EXPECT_EQ(events[k].value_ns, 2 * i);
    EXPECT_EQ(events[k].kind, TraceKind::kRelease);
  }
}

TEST(TraceRing, StandsStillWhileFrozen) {
  std::atomic<std::uint32_t> frozen{0};
  TraceRing ring(frozen);
  ring.record(1, TraceKind::kRelease, 1, 0);
  frozen = 1;
  ring.record(2, TraceKind::kRelease, 2, 0);
  EXPECT_EQ(ring.copy().size(), 1u);
  frozen = 0;
  ring.record(3, TraceKind::kRelease, 3, 0);
  EXPECT_EQ(ring.copy().back().at_ns, 3);
}

TEST(TraceRing, ACopyTakenWhileItIsWrittenHoldsNoTornEvent) {
  std::atomic<std::uint32_t> frozen{0};
  TraceRing ring(frozen);
  std::atomic<bool> stop{false};
  std::thread writer([&] {
    for (std::int64_t i = 1; !stop; ++i) ring.record(i, TraceKind::kCue, static_cast<std::uint64_t>(i), -i);
  });
  for (int i = 0; i < 2000; ++i) {
    TimeNs before = 0;
    for (const auto& e : ring.copy()) {
      ASSERT_EQ(e.value_ns, -e.at_ns);
      ASSERT_EQ(e.number, static_cast<std::uint32_t>(e.at_ns));
      ASSERT_TRUE(before == 0 || e.at_ns == before + 1);
      before = e.at_ns;
    }
  }
  stop = true;
  writer.join();
}

}  // namespace
}  // namespace wasp::rt
