// What wasp tells besides setpoints, on the autopilot's line: answers to commands and parameter requests, texts, the
// computer's state, and what the behaviours see - OBSTACLE_DISTANCE, OPTICAL_FLOW_RAD, height and time to contact, and
// wasp's own messages. The link thread speaks it, one frame at a time, when the line has room (scheduling/line_gate.h);
// what behaviours saw is put together at that moment from their newest words and never older than their age limits: a
// blind behaviour makes silence. Two inboxes are written by the main thread, which never waits for the link's and is
// never waited for.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>

#include "drivers/autopilot_link.h"
#include "drivers/command_server.h"
#include "drivers/parameter_server.h"
#include "drivers/text_sender.h"
#include "rt/seqlock.h"
#include "rt/spsc_queue.h"
#include "scheduling/config.h"
#include "scheduling/flow_integral.h"
#include "scheduling/gyro_integral.h"
#include "scheduling/line_gate.h"
#include "scheduling/own_messages.h"
#include "shm/broadcast_ring.h"
#include "vision/kernels/obstacle_bins.h"

namespace wasp::scheduling {

/// From the main thread to the link's.
class TelemetryInbox {
 public:
  struct Text {
    std::uint64_t size = 0;
    std::uint8_t severity = 6;
    std::array<char, drivers::TextSender::kLongest> bytes{};
  };
  /// Dropped when the queue is full. Main thread only.
  void tell(std::uint8_t severity, std::string_view text) noexcept;
  rt::SpscQueue<Text, 32> texts;
  rt::Seqlock<mavlink::OnboardComputerStatus> computer;
};

class Telemetry {
 public:
  /// `flight`: the region with the rings of flow and cues. Before the start.
  Telemetry(const Config& config, const shm::Region& flight, drivers::AutopilotLink& link);

  [[nodiscard]] TelemetryInbox& inbox() noexcept { return inbox_; }
  /// A frame that the link does not handle itself; false if it was no request.
  bool receive(const mavlink::Frame& frame, TimeNs now_ns) WASP_REALTIME;
  void note(const ImuSample& sample) WASP_REALTIME { gyro_.add(sample); }

  /// Says what is due and finds room; `send(std::span<const std::uint8_t>)` writes a whole frame. Link thread only.
  template <class Send>
  void serve(TimeNs now_ns, LineGate& gate, Send&& send) WASP_REALTIME {
    take_in(now_ns);
    std::array<std::uint8_t, mavlink::kMaxFrame> out;
    for (int i = 0; i < kFramesPerServe; ++i) {
      const std::size_t n = next(now_ns, gate, out);
      if (n == 0) return;
      send(std::span<const std::uint8_t>(out.data(), n));
      gate.spend(n);
    }
  }

 private:
  static constexpr int kFramesPerServe = 6;
  enum Kind : std::size_t {
    kComputer,
    kObstacles,
    kFlow,
    kHeight,
    kContact,
    kCues,
    kLatencies,
    kState,
    kField,
    kKinds
  };
  struct Stream {
    std::uint32_t id = 0;
    DurationNs usual_ns = 0, interval_ns = 0;  ///< 0: not sent
    TimeNs due_ns = 0;
    bool once = false;  ///< asked for by name
    [[nodiscard]] bool due(TimeNs now_ns) const WASP_REALTIME { return once || (interval_ns > 0 && now_ns >= due_ns); }
  };
  /// A behaviour's words and how long they count.
  struct Voice {
    std::optional<shm::RingReader> ring;
    DurationNs age_limit_ns = 0;
  };

  void take_in(TimeNs now_ns) WASP_REALTIME;
  std::size_t next(TimeNs now_ns, LineGate& gate, std::span<std::uint8_t> out) WASP_REALTIME;
  std::size_t answer(TimeNs now_ns, LineGate& gate, std::span<std::uint8_t> out) WASP_REALTIME;
  std::size_t stream(Kind kind, TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME;
  std::size_t computer(TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME;
  std::size_t obstacles(TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME;
  std::size_t flow(TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME;
  std::size_t named(const char* name, float value, TimeNs exposed_at_ns, std::span<std::uint8_t> out) WASP_REALTIME;
  std::size_t height(TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME;
  std::size_t contact(TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME;
  std::size_t version(std::span<std::uint8_t> out) WASP_REALTIME;
  std::uint8_t obey(const drivers::ServiceCommand& command, TimeNs now_ns) WASP_REALTIME;
  std::uint8_t request(std::uint32_t id) WASP_REALTIME;
  std::uint8_t set_interval(std::uint32_t id, float interval_us, TimeNs now_ns) WASP_REALTIME;
  void rate_changed(std::size_t row) WASP_REALTIME;
  [[nodiscard]] static bool fresh(const Voice& voice, TimeNs now_ns, Cue& cue) WASP_REALTIME;
  Voice voice(const Config& config, const shm::Region& flight, std::string_view behaviour) const;

  drivers::AutopilotLink& link_;
  TelemetryInbox inbox_;
  drivers::ParameterServer parameters_;
  drivers::TextSender texts_;
  drivers::AckQueue acks_;
  OwnMessages own_;
  bool tell_texts_, version_asked_ = false;
  std::int32_t interval_asked_ = -1;  ///< id of a MESSAGE_INTERVAL to be told
  std::array<Stream, kKinds> streams_;
  Voice ground_flow_, ground_, contact_;
  std::optional<shm::RingReader> flow_ring_;
  DurationNs flow_age_limit_ns_ = 0;
  std::uint64_t obstacles_sent_ = 0;  ///< number of the flow field they were of
  vision::ObstacleBinsParams bins_;
  FlowIntegral flow_sum_;
  GyroIntegral gyro_;
  float down_camera_below_m_ = 0, frame_s_ = 1.f / 30.f;
};

}  // namespace wasp::scheduling
