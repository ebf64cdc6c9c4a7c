// A second companion on an autopilot's telemetry port, which only wants to know where the vehicle is: sends a
// heartbeat, asks for attitude and position as often as it needs them (SET_MESSAGE_INTERVAL, and REQUEST_DATA_STREAM
// where that is not obeyed), keeps the clocks matched by TIMESYNC. The best message of each kind counts, a worse one
// after a second of silence: ATTITUDE_QUATERNION, ATTITUDE; LOCAL_POSITION_NED, GLOBAL_POSITION_INT, then heights
// alone: ALTITUDE, VFR_HUD. No clock, no device.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/autopilot_link.h"
#include "drivers/clock_map.h"
#include "messages/mavlink_frame.h"
#include "sim/followed_pose.h"
#include "sim/sample_dating.h"

namespace wasp::sim {

struct PoseLinkParams {
  std::uint8_t system_id = 1;       ///< of the vehicle; ours is the same
  std::uint8_t component_id = 194;  ///< ours: onboard computer 4
  double rate_hz = 50;              ///< asked for
};

class PoseLink {
 public:
  PoseLink(const PoseLinkParams& params, FollowedPose& pose)
      : params_(params), pose_(pose), encoder_(params.system_id, params.component_id) {}

  void receive(std::span<const std::uint8_t> bytes, TimeNs arrived_at_ns);
  /// Appends to `out` what is due to be said. Call some fifty times a second.
  void speak(TimeNs now_ns, std::vector<std::uint8_t>& out);
  /// The line was lost and is back, or leads to somebody else.
  void restart();

  [[nodiscard]] const mavlink::Counts& counts() const { return parser_.counts(); }
  [[nodiscard]] bool heard() const { return beat_at_ns_ != kNever; }
  [[nodiscard]] bool real_time() const { return dating_.real_time(); }

 private:
  struct Source {
    drivers::PreferredSource rank;
    int last_rank = -1;
  };
  void take(const mavlink::Frame& frame, TimeNs arrived_at_ns);
  void heartbeat(const mavlink::Heartbeat& m, TimeNs arrived_at_ns);
  void stranger(const mavlink::Frame& frame, TimeNs arrived_at_ns);
  template <class Message>
  void attitude(const Message& m, int rank, TimeNs arrived_at_ns);
  template <class Message>
  void position(const Message& m, int rank, const ReportedPosition& reported, TimeNs arrived_at_ns);
  void global_position(const mavlink::GlobalPositionInt& m, TimeNs arrived_at_ns);
  static ReportedPosition height_only(double up_m, float climb_mps);
  bool admit(Source& source, int rank, TimeNs now_ns);
  void timesync(const mavlink::Timesync& m, const mavlink::Frame& frame, TimeNs arrived_at_ns);
  TimeNs date(TimeNs remote_ns, TimeNs arrived_at_ns);
  void ask(TimeNs now_ns, std::vector<std::uint8_t>& out);
  template <class Message>
  void send(const Message& m, std::vector<std::uint8_t>& out);

  PoseLinkParams params_;
  FollowedPose& pose_;
  mavlink::Parser parser_;
  mavlink::Encoder encoder_;
  drivers::ClockMap clock_;
  SampleDating dating_;
  bool clock_doubted_ = false;
  std::array<TimeNs, 16> asked_at_ns_{};
  std::size_t next_question_ = 0;
  std::vector<std::uint8_t> answers_;
  Source attitude_, position_;
  bool has_zero_ = false;
  double zero_latitude_ = 0, zero_longitude_ = 0;  ///< where GLOBAL_POSITION_INT began [1e-7 degrees]
  TimeNs beat_at_ns_ = kNever, beat_due_ns_ = 0, sync_due_ns_ = 0, ask_due_ns_ = 0, stranger_due_ns_ = 0;
  int asked_ = 0;
};

}  // namespace wasp::sim
