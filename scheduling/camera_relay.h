// The camera relay of a flight with fault points: a real-time thread between the camera process and the behaviours. It
// copies every frame from the camera's rings to the same rings of a region of its own (wasp.INSTANCE.relay), depth
// before the grey frame of the same exposure, and does to it on the way what the points say. Without --faults it does
// not exist, and the behaviours read the camera's own frames.
#pragma once

#include <deque>
#include <vector>

#include "scheduling/camera_fate.h"
#include "scheduling/events.h"
#include "scheduling/pixel_faults.h"
#include "scheduling/realtime_loop.h"
#include "shm/broadcast_ring.h"

namespace wasp::scheduling {

class CameraRelay {
 public:
  /// `source` with its bells; `relay`: created with topics(source).
  CameraRelay(const shm::Region& source, const shm::Region& relay, StageTable& stages, EventQueue& events,
              ThreadWatch& watch);
  /// The rings of frames that `source` has, for Region::create.
  static std::vector<shm::TopicSpec> topics(const shm::Region& source);

  /// Runs until the stop flag. Real-time loop.
  void run(LoopControl& control);

 private:
  static constexpr std::size_t kFramesKept = 18;  ///< of each ring: late or out of order; 400 ms at 40 Hz and a pair
  static constexpr std::size_t kChannels = 3;

  /// A frame under way.
  struct Kept {
    std::vector<std::byte> bytes;
    bool used = false;
    std::uint32_t copies = 1;
  };
  struct Channel {
    Channel(const shm::Region& source, const shm::Region& relay, const shm::TopicEntry& entry);
    shm::RingReader in;
    shm::RingWriter out;
    bool depth, down;
    PixelFaults faults;
    std::vector<Kept> kept;
    std::size_t held = kFramesKept;  ///< frame that waits for its successor to pass; kFramesKept: none
    std::uint64_t lost_reported = 0;
  };
  struct Waiting {
    Channel* channel;
    std::size_t frame;
    TimeNs due_ns;
  };

  void cycle(LoopControl& control) WASP_REALTIME;
  [[nodiscard]] TimeNs next_due(TimeNs now_ns) const WASP_REALTIME;
  [[nodiscard]] bool unread() const WASP_REALTIME;
  void take_all(Channel& channel) WASP_REALTIME;
  void take(Channel& channel, const shm::Sample& sample) WASP_REALTIME;
  bool comes_through(const Channel& channel, const Fate& fate, TimeNs now_ns) WASP_REALTIME;
  void pass_on(Channel& channel, const shm::Sample& sample, const Fate& fate, TimeNs now_ns) WASP_REALTIME;
  void change(Channel& channel, const shm::Sample& sample, const Fate& fate, std::byte* frame) WASP_REALTIME;
  bool read_fails(const Fate& fate, TimeNs now_ns) WASP_REALTIME;
  void forward(Channel& channel, const shm::Sample& sample, const Fate& fate) WASP_REALTIME;
  void keep(Channel& channel, const shm::Sample& sample, const Fate& fate, TimeNs now_ns) WASP_REALTIME;
  void line_up(Channel& channel, std::size_t frame, const Fate& fate, TimeNs now_ns) WASP_REALTIME;
  void release_due(TimeNs now_ns) WASP_REALTIME;
  void count_lost(Channel& channel, LoopControl& control) WASP_REALTIME;
  void watch_the_line(TimeNs now_ns) WASP_REALTIME;

  std::deque<Channel> channels_;  ///< depth first
  Channel* depth_ = nullptr;
  std::vector<rt::Bell*> bells_;
  CameraFates front_, down_;
  const FaultBoard* board_ = nullptr;
  std::array<Waiting, kChannels * kFramesKept> queue_{};  ///< in the order in which frames came
  std::size_t first_ = 0, waiting_ = 0;
  TimeNs last_due_ns_ = 0;
  TimeNs closed_until_ns_ = 0;  ///< after a read error
  bool closed_ = false;
  FaultRandom random_;
  EventQueue& events_;
  ThreadWatch& watch_;
  Stage* relay_;  ///< published by the camera to dealt with here, also of frames that go no further
};

}  // namespace wasp::scheduling
