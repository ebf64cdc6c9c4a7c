#include "tools/fly_monitor.h"

#include <fmt/format.h>

#include <algorithm>

#include "control/mission.h"
#include "rt/clock.h"
#include "shm/broadcast_ring.h"
#include "shm/topics.h"
#include "tools/latency_summary.h"
#include "types/messages.h"

namespace wasp::tools {
namespace {

void try_attach(std::unique_ptr<shm::Region>& region, const std::string& name) {
  if (region) return;
  try {
    region = std::make_unique<shm::Region>(shm::Region::attach(name));
  } catch (const std::exception&) {
    // not there yet: look again next time
  }
}

}  // namespace

FlightGlance FlyMonitor::look() {
  FlightGlance glance;
  try_attach(flight_, shm::flight_region(instance_));
  try_attach(truth_, shm::truth_region(instance_));
  if (truth_) {
    Truth truth;
    glance.truth_known = shm::RingReader(*truth_, shm::kTruth, "Truth").copy_newest(truth);
    glance.truth_m = static_cast<double>(truth.height_m);
  }
  if (!flight_) return glance;
  glance.attached = true;
  Command command;
  if (shm::RingReader(*flight_, shm::kCommand, "Command").copy_newest(command)) {
    glance.commanding = true;
    glance.mission_phase = command.mission_phase;
    glance.height_m = static_cast<double>(command.height_m);
    glance.setpoint_m = static_cast<double>(command.height_setpoint_m);
    if (phase_ != command.mission_phase) {
      phase_ = command.mission_phase;
      phase_since_ns_ = command.due_at_ns;
    }
    glance.in_phase_s = to_seconds(command.due_at_ns - phase_since_ns_);
  }
  const RunSummary run = read_run(*flight_);
  glance.ticks = run.ticks;
  glance.misses = run.deadline_misses + run.skipped;
  if (const auto* stages = find_block<scheduling::StageTable>(*flight_, shm::kStages, "StageTable"))
    for (std::uint32_t i = 0; i < std::min<std::uint32_t>(stages->count.load(), scheduling::StageTable::kMaxStages);
         ++i)
      if (stages->stages[i].stage_view() == "end to end")
        glance.worst_ns = std::max<long long>(glance.worst_ns, stages->stages[i].histogram.max_ns());
  return glance;
}

std::string progress_line(const FlightGlance& g, double elapsed_s, double expected_s) {
  if (!g.commanding) return fmt::format("{:5.1f} s  starting", elapsed_s);
  const auto phase = static_cast<control::MissionPhase>(g.mission_phase);
  const double part = expected_s > 0 ? std::clamp(elapsed_s / expected_s, 0.0, 1.0) : 0.0;
  const int bars = static_cast<int>(part * 20 + 0.5);
  std::string truth = g.truth_known ? fmt::format(" (truth {:.3f})", g.truth_m) : "";
  return fmt::format("[{:<20}] {:5.1f} s  {:<8.8} set {:.2f} m  height {:.3f} m{}  worst {}  missed {}",
                     std::string(static_cast<std::size_t>(bars), '#'), elapsed_s, control::name_of(phase), g.setpoint_m,
                     g.height_m, truth, duration_text(g.worst_ns), g.misses);
}

}  // namespace wasp::tools
