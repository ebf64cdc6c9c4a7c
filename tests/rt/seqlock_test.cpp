// One writer, three readers, a value whose words must agree; beside a seqlock without the second look, which the same
// check catches on any processor (it does not rest on memory order).
#include "rt/seqlock.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <new>
#include <thread>
#include <vector>

#include "rt/clock.h"

namespace wasp::rt {
namespace {

struct Value {
  std::array<std::uint64_t, 128> words{};
  static Value of(std::uint64_t n) {
    Value v;
    for (std::size_t i = 0; i < v.words.size(); ++i) v.words[i] = n + i;
    return v;
  }
  [[nodiscard]] bool whole() const {
    for (std::size_t i = 0; i < words.size(); ++i)
      if (words[i] != words[0] + i) return false;
    return true;
  }
};

/// Deliberately broken: never looks at the sequence again after the copy.
class TrustingSeqlock {
 public:
  void store(const Value& value) {
    sequence_.fetch_add(1, std::memory_order_acq_rel);
    store_words(&value_, value);
    sequence_.fetch_add(1, std::memory_order_release);
  }
  bool load(Value& value) const {
    const auto before = sequence_.load(std::memory_order_acquire);
    if (before == 0 || (before & 1) != 0) return false;
    load_words(value, &value_);
    if (before % 64 == 0) {  // opens the window on one core too: half old, half new
      std::this_thread::yield();
      Value later;
      load_words(later, &value_);
      std::copy_n(later.words.begin(), later.words.size() / 2, value.words.begin());
    }
    return true;
  }

 private:
  std::atomic<std::uint64_t> sequence_{0};
  Value value_{};
};

struct Outcome {
  std::uint64_t loads = 0, torn = 0, backwards = 0;
};

/// Hammers the lock until `enough(outcome)` or four seconds are over.
template <class Lock, class Enough>
Outcome hammer(Enough&& enough) {
  const auto lock = std::make_unique<Lock>();
  std::atomic<bool> stop{false};
  std::atomic<std::uint64_t> loads{0}, torn{0}, backwards{0};
  std::thread writer([&] {
    for (std::uint64_t n = 1; !stop.load(std::memory_order_relaxed); ++n) {
      lock->store(Value::of(n));
      if (n % 512 == 0) std::this_thread::yield();
    }
  });
  std::vector<std::thread> readers;
  for (int r = 0; r < 3; ++r)
    readers.emplace_back([&] {
      std::uint64_t last = 0;
      Value value;
      while (!stop.load(std::memory_order_relaxed)) {
        if (!lock->load(value)) continue;
        loads.fetch_add(1, std::memory_order_relaxed);
        if (!value.whole())
          torn.fetch_add(1, std::memory_order_relaxed);
        else if (value.words[0] < last)
          backwards.fetch_add(1, std::memory_order_relaxed);
        else
          last = value.words[0];
      }
    });
  const TimeNs deadline = now() + 4 * kSecond;
  Outcome outcome;
  do {
    sleep_until(now() + 5 * kMillisecond);
    outcome = {loads.load(), torn.load(), backwards.load()};
  } while (now() < deadline && !enough(outcome));
  stop = true;
  writer.join();
  for (auto& r : readers) r.join();
  return {loads.load(), torn.load(), backwards.load()};
}

TEST(Seqlock, NeverTornAndNeverBackwards) {
  const Outcome outcome = hammer<Seqlock<Value>>([](const Outcome& o) { return o.loads > 5'000'000; });
  EXPECT_GT(outcome.loads, 0u);
  EXPECT_EQ(outcome.torn, 0u);
  EXPECT_EQ(outcome.backwards, 0u);
}

TEST(Seqlock, TheSameCheckCatchesASeqlockWithoutTheSecondLook) {
  EXPECT_GT(hammer<TrustingSeqlock>([](const Outcome& o) { return o.torn > 0; }).torn, 0u);
}

TEST(Seqlock, EmptyUntilTheFirstStore) {
  Seqlock<Value> lock;
  Value value;
  EXPECT_FALSE(lock.load(value));
  lock.store(Value::of(7));
  ASSERT_TRUE(lock.load(value));
  EXPECT_EQ(value.words[0], 7u);
}

TEST(Seqlock, SurvivesAWriterThatDiedInMidStore) {
  auto lock = std::make_unique<Seqlock<Value>>();
  lock->store(Value::of(1));
  auto* sequence = reinterpret_cast<std::uint64_t*>(lock.get());
  ASSERT_EQ(*sequence, 2u);
  *sequence = 3;  // the state a SIGKILL leaves in shared memory between the two sequence stores
  Value value;
  EXPECT_FALSE(lock->load(value));
  lock->store(Value::of(2));  // the successor
  ASSERT_TRUE(lock->load(value));
  EXPECT_EQ(value.words[0], 2u);
  lock->store(Value::of(3));
  ASSERT_TRUE(lock->load(value));
  EXPECT_EQ(value.words[0], 3u);
}

}  // namespace
}  // namespace wasp::rt
