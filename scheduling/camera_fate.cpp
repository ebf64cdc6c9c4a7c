#include "scheduling/camera_fate.h"

namespace wasp::scheduling {

const Fate& CameraFates::of(const FrameHeader& header, const FaultBoard* board, TimeNs now_ns) WASP_REALTIME {
  for (const Fate& fate : kept_)
    if (fate.exposed_at_ns == header.exposed_at_ns && fate.sequence == header.sequence) return fate;
  Fate& fate = kept_[next_];
  next_ = (next_ + 1) % kept_.size();
  fate = {};
  fate.sequence = fate.sequence_shown = header.sequence;
  fate.exposed_at_ns = fate.exposed_shown_ns = header.exposed_at_ns;
  if (board != nullptr) decide(fate, *board, now_ns);
  last_ = fate;
  return fate;
}

void CameraFates::decide(Fate& fate, const FaultBoard& board, TimeNs now_ns) WASP_REALTIME {
  using enum FaultPoint;
  for (unsigned i = 0; i <= static_cast<unsigned>(kDepthDrop); ++i)
    if (board.on(static_cast<FaultPoint>(i), now_ns)) fate.points |= std::uint64_t{1} << i;
  if (fate.points == 0) return;
  const double since_passed = static_cast<double>(now_ns) - static_cast<double>(passed_at_ns_);
  fate.lost = (fate.has(kCameraDrop) && random_.chance(board.value(kCameraDrop))) ||
              (fate.has(kCameraSlow) && since_passed * static_cast<double>(board.value(kCameraSlow)) < kSecond);
  if (!fate.lost) passed_at_ns_ = now_ns;
  fate.held = fate.has(kCameraReorder) && !last_.held;
  stamp(fate, board);
  count(fate, board);
}

void CameraFates::stamp(Fate& fate, const FaultBoard& board) WASP_REALTIME {
  using enum FaultPoint;
  if (fate.has(kCameraStampAhead)) fate.exposed_shown_ns += milliseconds_of(board, kCameraStampAhead);
  if (fate.has(kCameraStampBack)) fate.exposed_shown_ns -= milliseconds_of(board, kCameraStampBack);
  if (!fate.has(kCameraStampStuck)) return;
  if (!last_.has(kCameraStampStuck)) stuck_ns_ = fate.exposed_at_ns;
  fate.exposed_shown_ns = stuck_ns_;
}

void CameraFates::count(Fate& fate, const FaultBoard& board) WASP_REALTIME {
  using enum FaultPoint;
  for (const FaultPoint point : {kCameraSequenceWrap, kCameraSequenceRestart}) {
    if (!fate.has(point)) continue;
    if (!last_.has(point)) counted_from_ = fate.sequence;
    fate.sequence_shown = fate.sequence - counted_from_;
    if (point == kCameraSequenceWrap) fate.sequence_shown -= static_cast<std::uint32_t>(board.value(point));
  }
}

}  // namespace wasp::scheduling
