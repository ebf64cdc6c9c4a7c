// Flow fields on their way from the behaviour that makes them to those that read them: a ring in the flight region.
#pragma once

#include <cstring>

#include "shm/broadcast_ring.h"
#include "types/flow_field.h"

namespace wasp::scheduling {

/// A slot of a topic of type "Flow". The message carries the times the step was given, which in a replay are the
/// recording's; cues are aged by the time the frame was shown.
struct FlowSlot {
  FlowMessage message;
  TimeNs shown_at_ns = 0;  ///< exposure of the frame as its camera published it
};
static_assert(std::is_trivially_copyable_v<FlowSlot> && offsetof(FlowSlot, message) == 0);

/// True if a reader may index the field by its own counts. Realtime-safe: yes.
inline bool believable(const FlowField& field) WASP_REALTIME {
  return field.columns > 0 && field.rows > 0 && field.columns <= FlowField::kMaxColumns &&
         field.rows <= FlowField::kMaxRows;
}

/// The end of a flow source.
class FlowWriter {
 public:
  FlowWriter(const shm::Region& flight, const char* topic) : ring_(flight, topic, "Flow") {}

  /// Realtime-safe: yes.
  void publish(const FlowMessage& message, TimeNs shown_at_ns, TimeNs now_ns) WASP_REALTIME {
    std::byte* slot = ring_.loan();
    std::memcpy(slot + offsetof(FlowSlot, message), &message, sizeof message);
    std::memcpy(slot + offsetof(FlowSlot, shown_at_ns), &shown_at_ns, sizeof shown_at_ns);
    ring_.publish(now_ns);
  }

 private:
  shm::RingWriter ring_;
};

}  // namespace wasp::scheduling
