#include "scheduling/arming.h"

#include <algorithm>
#include <stdexcept>

namespace wasp::scheduling {

void admit(const Plan& plan, AdmissionMode mode, bool real_time, const LogLine& log) {
  if (mode == AdmissionMode::kOff || plan.schedulable) return;
  std::string reasons;
  for (const auto& r : plan.reasons) reasons += "\n  " + r;
  const std::string what = "the thread table is not schedulable (see `wasp plan`):" + reasons;
  if (mode == AdmissionMode::kEnforce && real_time)
    throw std::runtime_error("refusing to arm ([run] admission = \"enforce\"): " + what);
  log("warning: " + what);
}

int highest_priority(const Config& c) {
  int highest = std::max({c.control_thread.priority, c.link_thread.priority, c.camera_thread.priority});
  for (const auto& b : c.behaviours) highest = std::max(highest, b.priority);
  return highest;
}

std::unique_ptr<rt::CpuLatencyHold> prepare_real_time(const Config& config, bool real_time, const LogLine& log) {
  if (!real_time && config.enforce_real_time)
    throw std::runtime_error(
        "refusing to arm: --no-rt was given, but the configuration says [run] enforce_real_time = true");
  if (!real_time) return nullptr;
  std::string refusal;
  for (const auto& m : rt::missing_rights(highest_priority(config)))
    refusal += "\n  missing right: " + m.right + "; grant it with: " + m.remedy;
  if (!refusal.empty()) throw std::runtime_error("refusing to arm without real time (or say --no-rt):" + refusal);
  auto hold = std::make_unique<rt::CpuLatencyHold>();
  if (!hold->held()) log("note: /dev/cpu_dma_latency is not available; the processor may sleep deeply");
  if (const std::string why = rt::lock_memory(static_cast<std::size_t>(config.heap_mib) << 20); !why.empty())
    throw std::runtime_error("refusing to arm: " + why);
  return hold;
}

}  // namespace wasp::scheduling
