// Producer and consumer at full tilt: all items, whole, in order. Beside it a queue that shows an item before writing
// it.
#include "rt/spsc_queue.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <memory>
#include <thread>

#include "rt/clock.h"
#include "rt/word_copy.h"

namespace wasp::rt {
namespace {

struct Item {
  std::array<std::uint64_t, 64> words{};
};
Item item_of(std::uint64_t n) {
  Item item;
  item.words.fill(n);
  return item;
}

/// Deliberately broken: the tail moves before the item is there. Words are atomic, so this is wrong but not undefined.
class HastyQueue {
 public:
  bool push(const Item& item) {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_.load(std::memory_order_acquire) == 4) return false;
    tail_.store(tail + 1, std::memory_order_release);
    if (tail % 64 == 0) std::this_thread::yield();  // opens the window on one core too
    store_words(&items_[tail % 4], item);
    return true;
  }
  bool pop(Item& item) {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_acquire)) return false;
    load_words(item, &items_[head % 4]);
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

 private:
  std::atomic<std::size_t> head_{0}, tail_{0};
  std::array<Item, 4> items_{};
};

/// Passes items through until `count` went through, one was wrong, or four seconds are over. Returns wrong items.
template <class Queue>
std::uint64_t pass(std::uint64_t count, std::uint64_t& passed) {
  const auto queue = std::make_unique<Queue>();
  std::atomic<bool> stop{false};
  std::thread producer([&] {
    for (std::uint64_t n = 1; n <= count && !stop.load(std::memory_order_relaxed);)
      if (queue->push(item_of(n)))
        ++n;
      else
        std::this_thread::yield();
  });
  std::uint64_t wrong = 0;
  const TimeNs deadline = now() + 4 * kSecond;
  Item item;
  passed = 0;
  while (passed < count && wrong == 0 && now() < deadline) {
    if (!queue->pop(item)) {
      std::this_thread::yield();
      continue;
    }
    ++passed;
    for (const auto w : item.words) wrong += w != passed ? 1 : 0;
  }
  stop = true;
  producer.join();
  return wrong;
}

TEST(SpscQueue, EveryItemOnceWholeAndInOrder) {
  std::uint64_t passed = 0;
  EXPECT_EQ((pass<SpscQueue<Item, 4>>(300'000, passed)), 0u);
  EXPECT_GT(passed, 0u);
}

TEST(SpscQueue, TheSameCheckCatchesAQueueThatShowsItemsTooEarly) {
  std::uint64_t passed = 0;
  EXPECT_GT(pass<HastyQueue>(UINT64_MAX, passed), 0u);
}

TEST(SpscQueue, FullAndEmpty) {
  SpscQueue<int, 4> queue;
  int value = 0;
  EXPECT_FALSE(queue.pop(value));
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(queue.push(round * 10 + i));
    EXPECT_FALSE(queue.push(99));
    for (int i = 0; i < 4; ++i) {
      ASSERT_TRUE(queue.pop(value));
      EXPECT_EQ(value, round * 10 + i);
    }
    EXPECT_FALSE(queue.pop(value));
  }
}

}  // namespace
}  // namespace wasp::rt
