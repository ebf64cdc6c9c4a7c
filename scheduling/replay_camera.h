// The replay camera: an ordinary thread decodes ahead, a real-time thread loans ring slots and publishes each frame at
// its recorded time, so that behaviours see a camera: depth first, then the grey frame of the same exposure. Should a
// behaviour fall several frames or flow fields behind (a stalled host), the camera holds the next frame back and counts
// it: with the overrun policy catch_up a replay loses nothing. Under skip a frame that is more than one frame period
// late is dropped, as a camera would drop it.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/recording.h"
#include "rt/periodic.h"
#include "scheduling/frame_pool.h"
#include "scheduling/realtime_loop.h"
#include "shm/broadcast_ring.h"

namespace wasp::scheduling {

class ReplayCamera {
 public:
  /// `camera` is the region this process writes; it has a topic for each stream the recording has.
  ReplayCamera(drivers::Recording recording, const shm::Region& camera, DurationNs length_ns, StageTable& stages,
               ThreadWatch& watch, rt::OverrunPolicy overrun);

  /// Rings a recording needs, for Region::create.
  static std::vector<shm::TopicSpec> topics(const drivers::Recording& recording);

  /// Length of one pass over the recording.
  static DurationNs lap_ns(const drivers::Recording& recording);

  /// Frame sequence at which the second pass starts.
  static std::uint32_t lap_sequence(const drivers::Recording& recording) {
    return recording.entries().back().sequence + 1;
  }

  /// A behaviour that must not lose messages of `ring`: a ring of the camera's region, or one of flow fields, which
  /// fills as fast as its source steps. Returns where the behaviour says the number of the newest one it is done with.
  std::atomic<std::uint64_t>* add_reader(shm::RingReader ring);

  /// Decodes every frame once, before arming, and keeps it: for processors too slow to decode at the frame rate.
  void preload();

  /// Decodes ahead until the stop flag or the end. Ordinary thread.
  void decode(LoopControl& control);
  /// Publishes until the stop flag or the end. Real-time loop.
  void run(LoopControl& control);

  [[nodiscard]] bool finished() const noexcept { return finished_.load(); }
  [[nodiscard]] std::uint64_t published() const noexcept { return published_.load(); }
  [[nodiscard]] std::uint64_t held_back() const noexcept { return held_back_.load(); }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_.load(); }
  [[nodiscard]] std::uint64_t decode_errors() const noexcept { return decode_errors_.load(); }

 private:
  struct Reader {
    shm::RingReader ring;
    std::atomic<std::uint64_t> done;
    explicit Reader(shm::RingReader r) : ring(std::move(r)), done(ring.newest()) {}
  };
  bool load(std::size_t index, DecodedFrame& frame);
  bool decode_one(std::size_t index, DurationNs offset_ns, std::uint32_t sequence, DecodedFrame& frame);
  void publish_all(RealtimeLoop& loop, LoopControl& control) WASP_REALTIME;
  void publish(const DecodedFrame& frame, TimeNs exposed_at_ns) WASP_REALTIME;
  [[nodiscard]] bool readers_keep_up() const noexcept;
  void wait_for_readers(RealtimeLoop& loop) WASP_REALTIME;
  bool drop_late(DurationNs late_ns, LoopControl& control) WASP_REALTIME;
  void serve(const DecodedFrame& frame, TimeNs due_ns, RealtimeLoop& loop, LoopControl& control) WASP_REALTIME;

  drivers::Recording recording_;
  DurationNs length_ns_;
  std::unique_ptr<shm::RingWriter> depth_, gray_;  ///< nullptr: the recording has no such stream
  FramePool pool_;
  std::vector<DecodedFrame> preloaded_;  ///< by entry; empty without preload()
  std::vector<std::unique_ptr<Reader>> readers_;
  Stage *release_, *compute_;
  ThreadWatch& watch_;
  rt::OverrunPolicy overrun_;
  DurationNs frame_period_ns_;
  std::atomic<bool> all_decoded_{false}, finished_{false};
  std::atomic<std::uint64_t> published_{0}, held_back_{0}, decode_errors_{0}, dropped_{0};
};

}  // namespace wasp::scheduling
