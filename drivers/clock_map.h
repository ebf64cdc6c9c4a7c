// Autopilot clock to ours by TIMESYNC exchanges. An exchange with a round trip near the least seen lately measures the
// offset, longer ones are set aside; a second-order tracker follows the offset and its slow drift; measurements far off
// are outliers until three agree with each other, which means that the other clock jumped (reboot), and the map starts
// anew. Pure arithmetic: instants come in as arguments.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "rt/contract.h"
#include "types/time.h"

namespace wasp::drivers {

/// One question and its answer.
struct ClockExchange {
  TimeNs sent_at_ns = 0;      ///< our clock, question
  TimeNs remote_ns = 0;       ///< their clock, in the answer
  TimeNs received_at_ns = 0;  ///< our clock, answer
};

enum class ClockOutcome : std::uint8_t { kMalformed, kTooSlow, kOutlier, kAccepted, kRestarted };

/// Realtime-safe: yes, all of it. One thread.
class ClockMap {
 public:
  static constexpr DurationNs kMaxRoundTripNs = kSecond;
  static constexpr DurationNs kOutlierNs = 10 * kMillisecond;
  static constexpr double kMaxDrift = 500e-6;  ///< crystals are within 100 ppm, resonators within 500 when new
  static constexpr int kSyncedAfter = 3;       ///< accepted exchanges
  static constexpr int kJumpAfter = 3;         ///< outliers that agree
  static constexpr int kUnsteadyAfter = 8;     ///< outliers in a row that do not

  ClockOutcome add(const ClockExchange& exchange) WASP_REALTIME {
    const DurationNs round_trip = exchange.received_at_ns - exchange.sent_at_ns;
    constexpr TimeNs kSane = INT64_MAX / 4;
    if (round_trip < 0 || round_trip > kMaxRoundTripNs || exchange.remote_ns < 0 || exchange.remote_ns > kSane)
      return ClockOutcome::kMalformed;
    const DurationNs least = note_round_trip(round_trip);
    if (round_trip > least + std::max(least / 2, kRoundTripSlackNs)) return ClockOutcome::kTooSlow;
    const TimeNs middle_ns = exchange.sent_at_ns + round_trip / 2;
    const DurationNs offset_ns = exchange.remote_ns - middle_ns;
    if (accepted_ == 0) return start(middle_ns, offset_ns, ClockOutcome::kAccepted);
    const DurationNs error_ns = offset_ns - offset_at(middle_ns);
    if (std::abs(error_ns) > kOutlierNs) return doubt(middle_ns, offset_ns);
    doubts_ = outliers_ = 0;
    track(middle_ns, error_ns);
    return ClockOutcome::kAccepted;
  }

  /// Forgets everything: their clock is known to have jumped.
  void restart() WASP_REALTIME { *this = ClockMap{}; }

  [[nodiscard]] bool synced() const noexcept { return accepted_ >= kSyncedAfter; }
  /// Our clock at their `remote_ns`. Meaningful once an exchange was accepted.
  [[nodiscard]] TimeNs to_local(TimeNs remote_ns) const WASP_REALTIME {
    const TimeNs roughly = remote_ns - offset_ns_;
    return remote_ns - offset_at(roughly);
  }
  /// Their clock at our `local_ns`.
  [[nodiscard]] TimeNs to_remote(TimeNs local_ns) const WASP_REALTIME { return local_ns + offset_at(local_ns); }
  /// Their clock minus ours at our `local_ns`.
  [[nodiscard]] DurationNs offset_at(TimeNs local_ns) const WASP_REALTIME {
    return offset_ns_ + static_cast<DurationNs>(drift_ * static_cast<double>(local_ns - measured_at_ns_));
  }
  [[nodiscard]] double drift() const noexcept { return drift_; }  ///< seconds per second, theirs faster: positive
  [[nodiscard]] DurationNs least_round_trip_ns() const noexcept {
    return filled_ == 0 ? 0 : *std::min_element(round_trips_.begin(), round_trips_.begin() + filled_);
  }

 private:
  static constexpr DurationNs kRoundTripSlackNs = 100 * kMicrosecond;
  static constexpr double kOffsetGain = 0.1, kDriftGain = 0.005;

  /// Least round trip of the last 32 exchanges, this one included.
  DurationNs note_round_trip(DurationNs round_trip) noexcept {
    round_trips_[newest_] = round_trip;
    newest_ = (newest_ + 1) % round_trips_.size();
    filled_ = std::min(filled_ + 1, round_trips_.size());
    return least_round_trip_ns();
  }

  ClockOutcome start(TimeNs local_ns, DurationNs offset_ns, ClockOutcome outcome) noexcept {
    measured_at_ns_ = local_ns;
    offset_ns_ = offset_ns;
    drift_ = 0;
    accepted_ = 1;
    doubts_ = outliers_ = 0;
    return outcome;
  }

  /// An outlier: the third in a row that agrees with the first of them is a jump. Many that agree with nothing are a
  /// clock that does not run as ours does (a simulator that is not in real time): what was known of it is void.
  ClockOutcome doubt(TimeNs local_ns, DurationNs offset_ns) noexcept {
    if (++outliers_ >= kUnsteadyAfter) {
      restart();
      return ClockOutcome::kOutlier;
    }
    if (doubts_ == 0 || std::abs(offset_ns - doubted_offset_ns_) > kOutlierNs) {
      doubts_ = 0;
      doubted_offset_ns_ = offset_ns;
    }
    if (++doubts_ < kJumpAfter) return ClockOutcome::kOutlier;
    return start(local_ns, offset_ns, ClockOutcome::kRestarted);
  }

  /// Moves offset and drift towards the measurement; the first ones are averaged.
  void track(TimeNs local_ns, DurationNs error_ns) noexcept {
    ++accepted_;
    const double gain = std::max(kOffsetGain, 1.0 / accepted_);
    const auto elapsed_ns = static_cast<double>(local_ns - measured_at_ns_);
    offset_ns_ = offset_at(local_ns) + static_cast<DurationNs>(gain * static_cast<double>(error_ns));
    measured_at_ns_ = local_ns;
    if (accepted_ > 10 && elapsed_ns > 0)
      drift_ = std::clamp(drift_ + kDriftGain * static_cast<double>(error_ns) / elapsed_ns, -kMaxDrift, kMaxDrift);
  }

  std::array<DurationNs, 32> round_trips_{};
  std::size_t newest_ = 0, filled_ = 0;
  TimeNs measured_at_ns_ = 0;
  DurationNs offset_ns_ = 0;
  double drift_ = 0;
  int accepted_ = 0;
  int doubts_ = 0, outliers_ = 0;
  DurationNs doubted_offset_ns_ = 0;
};

}  // namespace wasp::drivers
