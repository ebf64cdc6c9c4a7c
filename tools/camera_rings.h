// Where a real camera's frames go: the rings of the camera region, as wasp-sim writes them, and the account of them.
#pragma once

#include <optional>
#include <vector>

#include "drivers/camera_driver.h"
#include "drivers/camera_status.h"
#include "shm/broadcast_ring.h"
#include "types/messages.h"

namespace wasp::tools {

/// The topics of one camera.
struct CameraTopics {
  const char* gray;
  const char* depth;   ///< nullptr: none
  const char* status;  ///< block

  [[nodiscard]] std::vector<shm::TopicSpec> specs(int width_px, int height_px) const;
};
CameraTopics front_topics(bool depth);
CameraTopics down_topics();

/// One thread. Realtime-safe after construction: yes.
class CameraRings final : public drivers::FrameSink {
 public:
  /// Throws if a topic is absent or of another type.
  CameraRings(const shm::Region& region, const CameraTopics& topics, int width_px, int height_px);

  drivers::FrameSlot slot() override;
  void announce() override;
  void publish(const drivers::FrameStamp& stamp) override;

  /// The device was opened: its count begins anew, ours goes on.
  void opened() { first_ = true; }
  /// The device gave a frame, and its number, that was damaged.
  void note_corrupt();
  [[nodiscard]] drivers::CameraStatus& status() { return *status_; }

 private:
  void begin(const drivers::FrameStamp& stamp);
  [[nodiscard]] std::uint32_t place(std::uint32_t device_sequence);
  void write_header(std::byte* slot, PixelFormat format, std::uint32_t pixel_bytes, TimeNs exposed_at_ns) const;

  std::uint32_t width_px_, height_px_;
  shm::RingWriter gray_;
  std::optional<shm::RingWriter> depth_;
  drivers::CameraStatus* status_;
  std::byte* gray_slot_ = nullptr;  ///< lent
  std::byte* depth_slot_ = nullptr;
  bool first_ = true;
  bool depth_alone_ = false;  ///< the last publication was half an exposure
  std::uint32_t device_sequence_ = 0, sequence_ = 0;
  std::uint32_t corrupt_since_ = 0;
  TimeNs last_exposed_ns_ = kNever;
};

}  // namespace wasp::tools
