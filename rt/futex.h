// Sleep and wake on a 32-bit word that may lie in memory shared between processes.
#pragma once

#include <linux/futex.h>
#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdint>
#include <span>

#include "rt/clock.h"

namespace wasp::rt {

/// Sleeps while `*word == expected`, until woken, interrupted, or `deadline_ns` (CLOCK_MONOTONIC) has passed.
/// Spurious returns are allowed: the caller looks again. Realtime-safe: yes (futex).
inline void futex_wait_until(const std::atomic<std::uint32_t>* word, std::uint32_t expected,
                             TimeNs deadline_ns) WASP_REALTIME {
  const timespec ts = to_timespec(deadline_ns);
  syscall(SYS_futex, word, FUTEX_WAIT_BITSET, expected, &ts, nullptr, FUTEX_BITSET_MATCH_ANY);
}

/// One of the words a thread waits on, and what it was.
struct FutexWord {
  const std::atomic<std::uint32_t>* word = nullptr;
  std::uint32_t expected = 0;
};

/// As futex_wait_until on up to kMostFutexWords words at once, whichever changes first. A kernel before 5.16 cannot:
/// there the thread looks every millisecond. Realtime-safe: yes (futex_waitv).
inline constexpr std::size_t kMostFutexWords = 4;
inline void futex_wait_any_until(std::span<const FutexWord> words, TimeNs deadline_ns) WASP_REALTIME {
  std::array<futex_waitv, kMostFutexWords> waiters{};
  const std::size_t count = std::min(words.size(), waiters.size());
  for (std::size_t i = 0; i < count; ++i)
    waiters[i] = {words[i].expected, reinterpret_cast<std::uintptr_t>(words[i].word), FUTEX_32, 0};
  const timespec ts = to_timespec(deadline_ns);
  if (count == 0 || (syscall(SYS_futex_waitv, waiters.data(), count, 0, &ts, CLOCK_MONOTONIC) < 0 && errno == ENOSYS))
    sleep_until(std::min(deadline_ns, now() + kMillisecond));
}

/// Wakes every sleeper. Realtime-safe: yes (futex).
inline void futex_wake_all(std::atomic<std::uint32_t>* word) WASP_REALTIME {
  syscall(SYS_futex, word, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
}

/// A doorbell: `ring` after publishing, `wait` for a change. A ring costs a system call only if somebody has gone to
/// sleep since the last one: a sleeper that died, or was stopped, costs the writer one needless call and no more.
struct alignas(64) Bell {
  std::atomic<std::uint32_t> word{0};
  std::atomic<std::uint32_t> arrivals{0};      ///< counts who lies down to sleep; written by sleepers
  std::atomic<std::uint32_t> served{0};        ///< arrivals already woken; written by the ringer
  std::atomic<std::uint32_t> announced_on{0};  ///< core of the last announce() + 1; 0: never

  /// How long a sleeper woken by announce() stays awake for the ring to follow.
  static constexpr DurationNs kAnnounceSpin = 50 * kMicrosecond;

  /// True if somebody lay down since the last ring.
  [[nodiscard]] bool awaited() const WASP_REALTIME {
    return arrivals.load(std::memory_order_seq_cst) != served.load(std::memory_order_relaxed);
  }
  /// One thread at a time. Either a sleeper sees the new word and stays awake, or this sees its arrival. Served are
  /// those who came before the word changed: whoever comes after may have seen the new word and lie down behind the
  /// wake, for the next ring. `served` follows the wake: a writer that dies between the two leaves a needless call to
  /// its successor, never a sleeper. Model-checked: tests/models/bell.pml. Realtime-safe: yes.
  void ring() WASP_REALTIME {
    const std::uint32_t came_before = arrivals.load(std::memory_order_acquire);
    word.fetch_add(1, std::memory_order_seq_cst);
    if (arrivals.load(std::memory_order_seq_cst) == served.load(std::memory_order_relaxed)) return;
    futex_wake_all(&word);
    served.store(came_before, std::memory_order_relaxed);
  }
  /// Wakes the sleepers ahead of a ring that follows within kAnnounceSpin, so that they wake up while the writer is
  /// still at work. A sleeper on the writer's own core goes back to sleep at once: it would only be in the way.
  /// Realtime-safe: yes.
  void announce() WASP_REALTIME {
    announced_on.store(static_cast<std::uint32_t>(sched_getcpu()) + 1, std::memory_order_relaxed);
    ring();
  }
  /// Sleeps until `ready()` or the deadline; returns the last `ready()`. Realtime-safe: yes if `ready` is.
  template <class Ready>
  bool wait(Ready&& ready, TimeNs deadline_ns) WASP_REALTIME {
    for (;;) {
      const std::uint32_t seen = word.load(std::memory_order_seq_cst);
      if (ready()) return true;
      if (now() >= deadline_ns) return false;
      arrivals.fetch_add(1, std::memory_order_seq_cst);
      if (word.load(std::memory_order_seq_cst) == seen) futex_wait_until(&word, seen, deadline_ns);
      if (announced_elsewhere()) await_announced(ready, deadline_ns);
    }
  }
  /// The same at several bells at once, woken by whichever rings; at most kMostFutexWords. Realtime-safe: yes if
  /// `ready` is.
  template <class Ready>
  static bool wait_any(std::span<Bell* const> bells, Ready&& ready, TimeNs deadline_ns) WASP_REALTIME {
    std::array<FutexWord, kMostFutexWords> seen{};
    const std::size_t count = std::min(bells.size(), seen.size());
    for (;;) {
      for (std::size_t i = 0; i < count; ++i)
        seen[i] = {&bells[i]->word, bells[i]->word.load(std::memory_order_seq_cst)};
      if (ready()) return true;
      if (now() >= deadline_ns) return false;
      for (std::size_t i = 0; i < count; ++i) bells[i]->arrivals.fetch_add(1, std::memory_order_seq_cst);
      futex_wait_any_until(std::span<const FutexWord>(seen.data(), count), deadline_ns);
    }
  }

 private:
  [[nodiscard]] bool announced_elsewhere() const WASP_REALTIME {
    const std::uint32_t core = announced_on.load(std::memory_order_relaxed);
    return core != 0 && core != static_cast<std::uint32_t>(sched_getcpu()) + 1;
  }
  template <class Ready>
  static void await_announced(Ready& ready, TimeNs deadline_ns) WASP_REALTIME {
    const TimeNs spin_until = now() + kAnnounceSpin;
    const TimeNs until = deadline_ns < spin_until ? deadline_ns : spin_until;
    while (!ready() && now() < until) {
    }
  }
};
static_assert(sizeof(Bell) == 64);

}  // namespace wasp::rt
