// wasp's own messages on the autopilot's line (messages/wasp.xml), for ground stations that read their description:
// what each behaviour last said, how late each thread was, what the last control tick made of it, flow fields in parts.
// Only for those who ask, or as [telemetry] says: an autopilot hands unknown messages on to its radio.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/autopilot_link.h"
#include "rt/contract.h"
#include "scheduling/config.h"
#include "scheduling/stage_table.h"
#include "shm/broadcast_ring.h"
#include "types/flow_field.h"

namespace wasp::scheduling {

/// Autopilot's time where the clocks are matched, else ours: the magnitude tells.
TimeNs told_time(const drivers::AutopilotLink& link, TimeNs local_ns) WASP_REALTIME;
/// The same in whole microseconds, as messages have it.
std::uint64_t told_us(const drivers::AutopilotLink& link, TimeNs local_ns) WASP_REALTIME;

/// Each function makes one whole frame in `out` and gives its size, 0 where there is nothing new to be said. One
/// thread.
class OwnMessages {
 public:
  /// `flight`: the region with the rings of cues, commands and flow, and the table of stages. Before the start.
  OwnMessages(const Config& config, const shm::Region& flight, drivers::AutopilotLink& link);

  /// WASP_CUE: of the next behaviour, in turn, that has said something since.
  std::size_t cue(std::span<std::uint8_t> out) WASP_REALTIME;
  /// WASP_LATENCY: of the next thread, in turn, that has run; control after the behaviours.
  std::size_t latency(TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME;
  /// WASP_STATE: of the newest control tick.
  std::size_t state(std::span<std::uint8_t> out) WASP_REALTIME;
  /// WASP_FLOW: the next part of the field begun within the last second, or the first of the newest one.
  std::size_t flow(TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME;
  /// A field is told in part.
  [[nodiscard]] bool field_begun() const WASP_REALTIME { return first_ < cells_; }

 private:
  static constexpr std::size_t kMostCells = FlowField::kMaxColumns * FlowField::kMaxRows;
  struct Voice {
    std::size_t behaviour = 0;
    std::array<char, 20> name{};
    shm::RingReader ring;
    std::uint32_t told = 0;  ///< Cue::step_index + 1 of what was told last
  };
  struct Stages {
    const Stage *wake = nullptr, *compute = nullptr, *end_to_end = nullptr;
  };

  bool begin_field() WASP_REALTIME;
  [[nodiscard]] Stages stages_of(std::string_view owner, std::string_view last) const WASP_REALTIME;

  drivers::AutopilotLink& link_;
  const StageTable& stages_;
  std::vector<Voice> voices_;
  std::size_t next_voice_ = 0, next_thread_ = 0;
  shm::RingReader commands_;
  std::uint64_t tick_told_ = 0;
  std::optional<shm::RingReader> fields_;
  std::uint64_t field_told_ = 0;
  mavlink::WaspFlow part_;  ///< what the parts of a field have in common
  std::array<std::int16_t, kMostCells> u_{}, v_{};
  std::size_t first_ = 0, cells_ = 0;
  TimeNs begun_at_ns_ = 0;
};

}  // namespace wasp::scheduling
