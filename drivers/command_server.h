// Commands to this companion: each one addressed to us is acknowledged, in whatever form it came (COMMAND_LONG or
// COMMAND_INT); who serves one says how it went. Acknowledgements wait here until the line has room; a repeat of a
// command whose answer still waits waits with it. One addressed to component 0 is for everybody: it is obeyed if we
// can, and answered only then. Realtime-safe: yes.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "drivers/autopilot_link.h"

namespace wasp::drivers {

struct ServiceCommand {
  std::uint16_t command = 0;
  std::array<float, 7> param{};  ///< of COMMAND_INT, 5 and 6 are x and y as numbers
  std::uint8_t sender_system = 0, sender_component = 0;
  bool by_name = false;  ///< addressed to our own component
};

/// A command for us, or nullopt.
inline std::optional<ServiceCommand> command_for(const LinkIdentity& self, const mavlink::Frame& frame) WASP_REALTIME {
  ServiceCommand c;
  std::uint8_t system = 0, component = 0;
  if (frame.is<mavlink::CommandLong>()) {
    const auto m = frame.as<mavlink::CommandLong>();
    c.param = {m.param1, m.param2, m.param3, m.param4, m.param5, m.param6, m.param7};
    c.command = m.command, system = m.target_system, component = m.target_component;
  } else if (frame.is<mavlink::CommandInt>()) {
    const auto m = frame.as<mavlink::CommandInt>();
    c.param = {m.param1, m.param2, m.param3, m.param4, static_cast<float>(m.x), static_cast<float>(m.y), m.z};
    c.command = m.command, system = m.target_system, component = m.target_component;
  } else {
    return std::nullopt;
  }
  c.by_name = component == self.component_id;
  const bool ours = (system == 0 || system == self.system_id) && (component == 0 || c.by_name);
  if (!ours) return std::nullopt;
  c.sender_system = frame.system_id;
  c.sender_component = frame.component_id;
  return c;
}

/// Answers that wait for room on the line.
class AckQueue {
 public:
  static constexpr std::size_t kMost = 16;

  /// Full: dropped, the sender will repeat.
  void add(const ServiceCommand& command, std::uint8_t result) WASP_REALTIME {
    mavlink::CommandAck ack;
    ack.command = command.command;
    ack.result = result;
    ack.target_system = command.sender_system;
    ack.target_component = command.sender_component;
    if (count_ < kMost) acks_[(head_ + count_++) % kMost] = ack;
  }
  [[nodiscard]] bool waiting() const WASP_REALTIME { return count_ > 0; }
  mavlink::CommandAck take() WASP_REALTIME {
    const mavlink::CommandAck ack = acks_[head_];
    head_ = (head_ + 1) % kMost;
    --count_;
    return ack;
  }

 private:
  std::array<mavlink::CommandAck, kMost> acks_{};
  std::size_t head_ = 0, count_ = 0;
};

}  // namespace wasp::drivers
