// Shared by the shm tests: messages that show when they are torn, and regions that vanish with the test.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "rt/word_copy.h"
#include "shm/broadcast_ring.h"
#include "tests/support/child.h"

namespace wasp::shm {

/// Every word follows from the first: a mixture of two messages is seen.
struct Message {
  static constexpr std::size_t kWords = 256;
  std::array<std::uint64_t, kWords> words{};

  static Message of(std::uint64_t n) {
    Message m;
    for (std::size_t i = 0; i < kWords; ++i) m.words[i] = word(n, i);
    return m;
  }
  static std::uint64_t word(std::uint64_t n, std::size_t i) { return n * 0x9E3779B97F4A7C15ull + i; }
  [[nodiscard]] bool is(std::uint64_t n) const {
    for (std::size_t i = 0; i < kWords; ++i)
      if (words[i] != word(n, i)) return false;
    return true;
  }
};

inline std::vector<TopicSpec> one_ring(std::uint32_t slots, std::uint64_t payload_bytes = sizeof(Message)) {
  return {{"data", "Message", TopicKind::kRing, slots, payload_bytes}};
}

/// Fills a loan word by word with relaxed atomic stores: the in-place payload is validated after use, which
/// ThreadSanitizer cannot know, so the test's payload is made of words that may race.
inline void fill(std::byte* loan, std::uint64_t n) {
  auto* words = reinterpret_cast<std::uint64_t*>(loan);
  for (std::size_t i = 0; i < Message::kWords; ++i) __atomic_store_n(words + i, Message::word(n, i), __ATOMIC_RELAXED);
}
/// True if the words in place are message `n`. Now and then lets others run in mid-look, so that one core is enough to
/// be overtaken by the writer.
inline bool holds(const std::byte* data, std::uint64_t n) {
  const auto* words = reinterpret_cast<const std::uint64_t*>(data);
  bool whole = true;
  for (std::size_t i = 0; i < Message::kWords; ++i) {
    if (i == Message::kWords / 2 && n % 61 == 0) std::this_thread::yield();
    whole &= __atomic_load_n(words + i, __ATOMIC_RELAXED) == Message::word(n, i);
  }
  return whole;
}

/// Gives out one region name, and removes what lies under it.
class NamedRegion : public ::testing::Test {
 protected:
  ~NamedRegion() override { Region::remove(name_); }
  const std::string name_ = test::unique_name("region");
};

/// The text of what `call` throws; empty if nothing.
template <class Call>
std::string error_of(Call&& call) {
  try {
    call();
  } catch (const std::exception& e) {
    return e.what();
  }
  return {};
}

}  // namespace wasp::shm
