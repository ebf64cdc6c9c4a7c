// The avoid command (5.4.3): a straight line through the last few (frame, time-to-contact) pairs by ordinary least
// squares; avoid when the line is trustworthy (two-sided p-value of its slope) and meets zero soon. Student's t for
// whole degrees of freedom is a finite sum (Abramowitz & Stegun 26.7.3, 26.7.4), so the arithmetic is bounded.
#pragma once

#include <array>
#include <cstdint>

#include "types/realtime.h"

namespace wasp::vision {

inline constexpr int kMaxAvoidPairs = 16;

struct AvoidParams {
  int pairs = 5;              ///< 3 ... kMaxAvoidPairs
  float frames_ahead = 30.f;  ///< F_max
  float max_p_value = 0.05f;
};

struct Regression {
  bool valid = false;   ///< enough pairs, not all at one frame, all finite
  float slope = 0;      ///< frames per frame; -1 at constant speed
  float intercept = 0;  ///< time-to-contact on the line at the last frame [frames]
  float p_value = 1;    ///< two-sided, of slope = 0; exactly 0 for a perfect sloping line
};

struct AvoidDecision {
  bool avoid = false;
  bool ready = false;  ///< the history is full
  Regression line;
  float contact_in_frames = 0;  ///< x-intercept relative to the last frame; meaningful when line.slope < 0
};

/// Two-sided p-value of Student's t with `freedom` degrees of freedom (1 ... 30; others give 1). Realtime-safe: yes.
double student_t_two_sided(double t, int freedom) WASP_REALTIME;

/// The running history. Plain data.
class AvoidMonitor {
 public:
  explicit AvoidMonitor(const AvoidParams& params = {}) WASP_REALTIME;

  /// Adds one pair and decides. A time-to-contact that is not finite, or a frame number not above the last one, is not
  /// added and cannot give avoid. Realtime-safe: yes.
  AvoidDecision add(std::int64_t frame, float time_to_contact_frames) WASP_REALTIME;
  /// Forgets everything: the approach was interrupted. Realtime-safe: yes.
  void reset() WASP_REALTIME { count_ = 0; }

 private:
  struct Pair {
    std::int64_t frame = 0;
    float time_to_contact = 0;
  };
  [[nodiscard]] Regression regress() const WASP_REALTIME;

  AvoidParams params_;
  std::array<Pair, kMaxAvoidPairs> pairs_{};  // oldest first
  int count_ = 0;
};

}  // namespace wasp::vision
