// Copies trivially copyable values word by word with relaxed atomics, so that a seqlock-protected copy that races with
// the writer is a value to be discarded, not undefined behaviour.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "rt/contract.h"

namespace wasp::rt {

template <class T>
concept WordCopyable = std::is_trivially_copyable_v<T> && sizeof(T) % 8 == 0 && alignof(T) <= 8;

/// Realtime-safe: yes. `to` is shared, `from` is private to this thread.
template <WordCopyable T>
void store_words(T* to, const T& from) WASP_REALTIME {
  std::uint64_t words[sizeof(T) / 8];
  __builtin_memcpy(words, &from, sizeof(T));
  auto* out = reinterpret_cast<std::uint64_t*>(to);
  for (std::size_t i = 0; i < sizeof(T) / 8; ++i) __atomic_store_n(out + i, words[i], __ATOMIC_RELAXED);
}

/// Realtime-safe: yes. `from` is shared, the result private.
template <WordCopyable T>
void load_words(T& to, const T* from) WASP_REALTIME {
  std::uint64_t words[sizeof(T) / 8];
  const auto* in = reinterpret_cast<const std::uint64_t*>(from);
  for (std::size_t i = 0; i < sizeof(T) / 8; ++i) words[i] = __atomic_load_n(in + i, __ATOMIC_RELAXED);
  __builtin_memcpy(&to, words, sizeof(T));
}

}  // namespace wasp::rt
