// Faults of what the autopilot says, between the link and the rings: attitude.* and imu.*.
#pragma once

#include "scheduling/fault_points.h"
#include "scheduling/fault_random.h"
#include "types/messages.h"

namespace wasp::scheduling {

/// Link thread only. Without a board nothing happens, at the cost of one branch.
class SampleFaults {
 public:
  /// Before the loop begins; may be null.
  void use(const FaultBoard* board) noexcept { board_ = board; }

  /// What becomes of a sample received at `now_ns`; false: it is not to be written. Realtime-safe: yes.
  bool pass(AttitudeSample& sample, TimeNs now_ns) WASP_REALTIME {
    return __builtin_expect(board_ == nullptr, 1) || corrupt(sample, now_ns);
  }
  bool pass(ImuSample& sample, TimeNs now_ns) WASP_REALTIME {
    return __builtin_expect(board_ == nullptr, 1) || corrupt(sample, now_ns);
  }

 private:
  /// The points that any stream of samples has.
  struct StreamPoints {
    FaultPoint stop, freeze, slow;
  };
  template <class Sample>
  struct Memory {
    Sample frozen;  ///< the first sample of a freeze
    bool is_frozen = false;
    TimeNs shown_at_ns = 0;  ///< the last sample that passed
  };
  template <class Sample>
  bool pass_stream(const StreamPoints& points, Memory<Sample>& memory, Sample& sample, TimeNs now_ns) WASP_REALTIME;
  bool corrupt(AttitudeSample& sample, TimeNs now_ns) WASP_REALTIME;
  bool corrupt(ImuSample& sample, TimeNs now_ns) WASP_REALTIME;
  [[nodiscard]] bool on(FaultPoint point, TimeNs now_ns) const WASP_REALTIME { return board_->on(point, now_ns); }

  const FaultBoard* board_ = nullptr;
  Memory<AttitudeSample> attitude_;
  Memory<ImuSample> imu_;
  FaultRandom random_;
};

}  // namespace wasp::scheduling
