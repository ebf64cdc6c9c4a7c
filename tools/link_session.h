// One conversation with an autopilot, for a look at it: who speaks, which messages come how often, what its parameters
// say. An ordinary thread; nothing here is real-time.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/autopilot_link.h"
#include "drivers/autopilot_setup.h"
#include "drivers/line_port.h"
#include "scheduling/autopilot_config.h"
#include "tools/bench_flight.h"

namespace wasp::tools {

class LinkSession {
 public:
  /// Opens the line; throws std::runtime_error naming it.
  explicit LinkSession(const scheduling::AutopilotConfig& config);

  /// Listens and asks for `seconds`, or until `flight` is over.
  void run(double seconds, BenchFlight* flight);
  /// Prints what was found; true if nothing bars a flight.
  bool report() const;

  // What the link hands on.
  void on_imu(const ImuSample& sample) noexcept { force_up_mps2_ = -sample.accel_body_mps2[2]; }
  void on_attitude(const AttitudeSample& sample) noexcept;
  void on_heartbeat(const drivers::AutopilotStatus& status) noexcept;
  void on_ack(std::uint16_t command, std::uint8_t result);
  void on_statustext(std::uint8_t severity, std::string_view text);
  void on_frame(const mavlink::Frame& frame);
  void reply(std::span<const std::uint8_t> bytes) noexcept { port_.write(bytes); }

 private:
  void listen(TimeNs until_ns);
  void ask(TimeNs now_ns);
  [[nodiscard]] bool barred() const;
  void fly(TimeNs now_ns, BenchFlight& flight);
  void say(const std::string& text) const;

  scheduling::AutopilotConfig config_;
  drivers::LinePort port_;
  std::unique_ptr<drivers::LinkSigning> signing_;  ///< of a signed line
  drivers::AutopilotLink link_;
  drivers::AutopilotSetup setup_;
  mavlink::Parser counter_;                                               ///< sees every message, from whomever
  std::map<std::pair<unsigned, std::uint32_t>, std::uint64_t> messages_;  ///< by sender (system, component) and id
  TimeNs started_ns_, heartbeat_due_ns_ = 0, timesync_due_ns_ = 0, setpoint_due_ns_ = 0;
  bool heard_ = false;
  BenchSight sight_;
  float force_up_mps2_ = 0;
};

}  // namespace wasp::tools
