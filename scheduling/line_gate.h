// Whether a frame that is no setpoint may go onto the line now. The line is modelled as what it is, a pipe of so many
// bytes a second: everything written, by whichever thread, is added to the time it is busy until. A frame may go only
// if its last byte will have left before the next setpoint is due, so that the setpoint finds the line empty; and,
// telemetry, only within a budget of bytes. Pure: instants come as arguments. One thread.
#pragma once

#include <algorithm>
#include <cstdint>

#include "rt/contract.h"
#include "types/time.h"

namespace wasp::scheduling {

struct LineGateParams {
  double bytes_per_s = 0;              ///< of the line; 0: without limit (datagrams)
  double budget_Bps = 0;               ///< of telemetry
  DurationNs guard_ns = kMillisecond;  ///< before a setpoint: its writer wakes up, this thread may be late
};

class LineGate {
 public:
  explicit LineGate(const LineGateParams& params) noexcept : params_(params), tokens_(kBurst) {}

  /// `written_total` of the port: what others wrote since the last look left the line from now on, at the latest.
  void look(std::uint64_t written_total, TimeNs now_ns) WASP_REALTIME {
    if (written_total != seen_total_) occupy(written_total - seen_total_, now_ns);
    seen_total_ = written_total;
    if (last_ns_ != kNever && now_ns > last_ns_)
      tokens_ = std::min(kBurst, tokens_ + params_.budget_Bps * to_seconds(now_ns - last_ns_));
    last_ns_ = now_ns;
  }
  /// Of the control thread; kNever: none is due.
  void next_setpoint(TimeNs due_ns) WASP_REALTIME { setpoint_due_ns_ = due_ns; }

  /// An answer: it may go if the setpoint finds the line empty all the same. Realtime-safe: yes.
  [[nodiscard]] bool fits(std::size_t bytes, TimeNs now_ns) const WASP_REALTIME {
    if (setpoint_due_ns_ == kNever) return true;
    return std::max(now_ns, busy_until_ns_) + duration(bytes) + params_.guard_ns <= setpoint_due_ns_;
  }
  /// Telemetry: within the budget as well.
  [[nodiscard]] bool affords(std::size_t bytes, TimeNs now_ns) const WASP_REALTIME {
    return tokens_ >= static_cast<double>(bytes) && fits(bytes, now_ns);
  }
  /// It was written.
  void spend(std::size_t bytes) WASP_REALTIME { tokens_ -= static_cast<double>(bytes); }
  /// Whether `bytes` ever fit between two setpoints `period_ns` apart, behind one of `setpoint_bytes`.
  [[nodiscard]] bool ever_fits(std::size_t bytes, std::size_t setpoint_bytes,
                               DurationNs period_ns) const WASP_REALTIME {
    return duration(bytes + setpoint_bytes) + params_.guard_ns < period_ns;
  }
  [[nodiscard]] TimeNs busy_until_ns() const WASP_REALTIME { return busy_until_ns_; }

 private:
  static constexpr double kBurst = 600;  ///< bytes: any two frames
  [[nodiscard]] DurationNs duration(std::uint64_t bytes) const WASP_REALTIME {
    if (params_.bytes_per_s <= 0) return 0;
    return static_cast<DurationNs>(static_cast<double>(bytes) / params_.bytes_per_s * 1e9);
  }
  void occupy(std::uint64_t bytes, TimeNs now_ns) WASP_REALTIME {
    busy_until_ns_ = std::max(now_ns, busy_until_ns_) + duration(bytes);
  }

  LineGateParams params_;
  double tokens_;
  std::uint64_t seen_total_ = 0;
  TimeNs last_ns_ = kNever, busy_until_ns_ = 0, setpoint_due_ns_ = kNever;
};

}  // namespace wasp::scheduling
