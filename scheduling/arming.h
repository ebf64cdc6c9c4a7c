// What stands between a configuration and real-time threads: admission of the thread table, rights, locked memory.
// Whatever is missing is refused by name, with the remedy.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "rt/process.h"
#include "scheduling/admission.h"

namespace wasp::scheduling {

using LogLine = std::function<void(const std::string&)>;

/// Throws std::runtime_error with the reasons when the plan is not schedulable, `mode` enforces and the table is in
/// force (`real_time`); says them otherwise.
void admit(const Plan& plan, AdmissionMode mode, bool real_time, const LogLine& log);

/// Highest SCHED_FIFO priority of the thread table.
int highest_priority(const Config& config);

/// Checks rights and locks memory; keeps the processor awake while the result lives. Throws std::runtime_error naming
/// what is missing and how to grant it. Null without `real_time`.
std::unique_ptr<rt::CpuLatencyHold> prepare_real_time(const Config& config, bool real_time, const LogLine& log);

}  // namespace wasp::scheduling
