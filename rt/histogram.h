// Log-linear latency histogram: 32 buckets an octave (3 % resolution) from 1 ns to 18 minutes, fixed size, one writer,
// wait-free, and any number of readers while it is written. Count, sum, minimum and maximum are exact: no outlier is
// ever clamped away. Lies in shared memory as it is: all bytes zero is an empty histogram.
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstdint>

#include "rt/contract.h"
#include "types/time.h"

namespace wasp::rt {

class Histogram {
 public:
  static constexpr int kSubBits = 5;
  static constexpr int kOctaves = 36;
  static constexpr std::size_t kBuckets = static_cast<std::size_t>(kOctaves) << kSubBits;

  /// Adds one duration; negative ones count as zero. One writer only. Realtime-safe: yes.
  void record(DurationNs duration_ns) WASP_REALTIME {
    const auto v = static_cast<std::uint64_t>(duration_ns < 0 ? 0 : duration_ns);
    add(buckets_[bucket_of(v)], 1);
    add(sum_ns_, v);
    if (v > max_ns_.load(std::memory_order_relaxed)) max_ns_.store(v, std::memory_order_relaxed);
    if (~v > not_min_ns_.load(std::memory_order_relaxed)) not_min_ns_.store(~v, std::memory_order_relaxed);
    add(count_, 1, std::memory_order_release);
  }

  [[nodiscard]] std::uint64_t count() const noexcept { return count_.load(std::memory_order_acquire); }
  [[nodiscard]] DurationNs max_ns() const noexcept {
    return static_cast<DurationNs>(max_ns_.load(std::memory_order_relaxed));
  }
  [[nodiscard]] DurationNs min_ns() const noexcept {
    return count() == 0 ? 0 : static_cast<DurationNs>(~not_min_ns_.load(std::memory_order_relaxed));
  }
  [[nodiscard]] double mean_ns() const noexcept {
    const auto n = count();
    return n == 0 ? 0.0 : static_cast<double>(sum_ns_.load(std::memory_order_relaxed)) / static_cast<double>(n);
  }
  [[nodiscard]] std::uint64_t bucket(std::size_t index) const noexcept {
    return buckets_[index].load(std::memory_order_relaxed);
  }

  /// Smallest upper bucket edge below which a share `q` in (0, 1] of all samples lies, never above the exact maximum.
  /// 0 when empty.
  [[nodiscard]] DurationNs quantile_ns(double q) const noexcept {
    std::uint64_t total = 0;
    for (const auto& b : buckets_) total += b.load(std::memory_order_relaxed);
    if (total == 0) return 0;
    const double wanted = q * static_cast<double>(total);
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < kBuckets; ++i) {
      seen += buckets_[i].load(std::memory_order_relaxed);
      if (static_cast<double>(seen) >= wanted && seen > 0) {
        if (i + 1 == kBuckets) break;  // the last bucket has no upper edge
        const auto upper = static_cast<DurationNs>(bucket_low(i + 1) - 1);
        return upper < max_ns() ? upper : max_ns();
      }
    }
    return max_ns();
  }

  /// Index of the bucket that holds `v` [ns]; values past the last octave share the last bucket.
  static constexpr std::size_t bucket_of(std::uint64_t v) noexcept {
    constexpr std::uint64_t kLinear = 1u << kSubBits;
    if (v < kLinear) return static_cast<std::size_t>(v);
    const auto shift = static_cast<int>(std::bit_width(v)) - 1 - kSubBits;
    const std::size_t index = (static_cast<std::size_t>(shift + 1) << kSubBits) + ((v >> shift) - kLinear);
    return index < kBuckets ? index : kBuckets - 1;
  }
  /// Least value of bucket `index` [ns].
  static constexpr std::uint64_t bucket_low(std::size_t index) noexcept {
    constexpr std::uint64_t kLinear = 1u << kSubBits;
    if (index < kLinear) return index;
    const std::size_t shift = (index >> kSubBits) - 1;
    return (kLinear + (index & (kLinear - 1))) << shift;
  }

 private:
  using Word = std::atomic<std::uint64_t>;
  static void add(Word& w, std::uint64_t n, std::memory_order order = std::memory_order_relaxed) noexcept {
    w.store(w.load(std::memory_order_relaxed) + n, order);  // one writer: no read-modify-write needed
  }
  Word count_{0}, sum_ns_{0}, max_ns_{0};
  Word not_min_ns_{0};  ///< complement of the minimum, so that zeroed memory means "none yet"
  std::array<Word, kBuckets> buckets_{};
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

}  // namespace wasp::rt
