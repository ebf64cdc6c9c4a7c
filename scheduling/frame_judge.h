// At the behaviours' door: is this frame a new image of now, as the camera promised it? What is late, repeated, from
// the future or of another shape is refused and counted; it never becomes a step, so it never becomes a command.
//
// The exposure time decides what is new. Sequence numbers only tell a repeated frame: they wrap, and a camera process
// that was started again counts from 0, so an older number with a newer exposure is taken.
#pragma once

#include <array>
#include <cstdint>

#include "rt/contract.h"
#include "types/time.h"

namespace wasp::scheduling {

enum class FrameFault : std::uint8_t {
  kNone = 0,
  kDuplicate,   ///< the sequence, the exposure or the image of the last one used
  kDisordered,  ///< exposed before the last one used
  kMalformed,   ///< another size, format or stride than promised
  kMisdated,    ///< exposed in the future, or too old to be of use
  kCount
};

/// What a behaviour holds against its frames. The default holds nothing but a believable header: a replay gives what
/// was recorded.
struct FrameRules {
  bool live = false;                          ///< sequence, exposure and order count
  std::uint32_t width_px = 0, height_px = 0;  ///< promised; 0: any
  DurationNs age_limit_ns = 0;                ///< older is of no use; 0: any
  int stuck_frames = 0;  ///< equal images in a row after which the camera counts as frozen; 0: not compared
};

/// What identifies a frame.
struct FrameMark {
  std::uint32_t sequence = 0;
  TimeNs exposed_at_ns = 0;
  std::uint64_t image = 0;  ///< image_hash; 0: not compared
};

/// Counts since construction.
struct FrameCounts {
  std::array<std::uint64_t, static_cast<std::size_t>(FrameFault::kCount)> refused{};
  std::uint64_t frozen = 0;  ///< times the camera came to count as frozen

  [[nodiscard]] std::uint64_t of(FrameFault fault) const noexcept { return refused[static_cast<std::size_t>(fault)]; }
};

/// Pure; one thread. Realtime-safe: yes, all of it.
class FrameJudge {
 public:
  /// Exposures of a right clock are never ahead; this forgives rounding.
  static constexpr DurationNs kAhead = 1 * kMillisecond;

  explicit FrameJudge(const FrameRules& rules = {}) noexcept : rules_(rules) {}
  [[nodiscard]] const FrameRules& rules() const noexcept { return rules_; }
  [[nodiscard]] const FrameCounts& counts() const noexcept { return counts_; }

  /// kNone: to be used, and remembered as the last one used.
  FrameFault judge(const FrameMark& mark, TimeNs now_ns) WASP_REALTIME {
    const FrameFault fault = look(mark, now_ns);
    note(fault);
    if (fault == FrameFault::kDuplicate) {
      if (++same_in_row_ == rules_.stuck_frames) ++counts_.frozen;
    } else if (fault == FrameFault::kNone) {
      same_in_row_ = 0;
      last_ = mark;
      used_ = true;
    }
    return fault;
  }
  /// A header that is not what was promised.
  void note_malformed() WASP_REALTIME { note(FrameFault::kMalformed); }
  /// The depth image that belongs to a frame: false if it is the last one's once more.
  bool depth_is_new(std::uint64_t image) WASP_REALTIME {
    const bool repeated = rules_.stuck_frames > 0 && image != 0 && image == last_depth_;
    last_depth_ = image;
    if (!repeated) {
      same_depth_in_row_ = 0;
      return true;
    }
    note(FrameFault::kDuplicate);
    if (++same_depth_in_row_ == rules_.stuck_frames) ++counts_.frozen;
    return false;
  }

 private:
  [[nodiscard]] FrameFault look(const FrameMark& mark, TimeNs now_ns) const WASP_REALTIME {
    if (!rules_.live) return FrameFault::kNone;
    if (used_ && (mark.sequence == last_.sequence || mark.exposed_at_ns == last_.exposed_at_ns))
      return FrameFault::kDuplicate;
    if (mark.exposed_at_ns > now_ns + kAhead) return FrameFault::kMisdated;
    if (rules_.age_limit_ns > 0 && mark.exposed_at_ns < now_ns - rules_.age_limit_ns) return FrameFault::kMisdated;
    if (used_ && mark.exposed_at_ns < last_.exposed_at_ns) return FrameFault::kDisordered;
    const bool same_image = used_ && rules_.stuck_frames > 0 && mark.image != 0 && mark.image == last_.image;
    return same_image ? FrameFault::kDuplicate : FrameFault::kNone;
  }
  void note(FrameFault fault) WASP_REALTIME {
    if (fault != FrameFault::kNone) ++counts_.refused[static_cast<std::size_t>(fault)];
  }

  FrameRules rules_;
  FrameMark last_;  ///< used
  bool used_ = false;
  int same_in_row_ = 0, same_depth_in_row_ = 0;
  std::uint64_t last_depth_ = 0;
  FrameCounts counts_;
};

}  // namespace wasp::scheduling
