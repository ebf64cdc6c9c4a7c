#include "tools/doctor_plan.h"

#include <sched.h>

#include <algorithm>
#include <filesystem>

#include "drivers/line_port.h"
#include "rt/thread.h"
#include "tools/flight_config.h"
#include "tools/program_paths.h"
#include "tools/record_attachment.h"

namespace wasp::tools {
namespace {

std::set<int> cores_of_this_process() {
  cpu_set_t set;
  CPU_ZERO(&set);
  std::set<int> cores;
  if (sched_getaffinity(0, sizeof set, &set) == 0)
    for (int c = 0; c < CPU_SETSIZE; ++c)
      if (CPU_ISSET(c, &set)) cores.insert(c);
  return cores;
}

/// Name of a region that a living flight writes, "" if there is none.
std::string flight_under_way() {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/shm", ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("wasp.") && name.ends_with(".flight") && is_written(name)) return name;
  }
  return {};
}

}  // namespace

std::set<int> DoctorPlan::other_cores() const {
  std::set<int> others;
  std::set_difference(usable_cores.begin(), usable_cores.end(), flight_cores.begin(), flight_cores.end(),
                      std::inserter(others, others.end()));
  return others;
}

DoctorPlan plan_doctor(const std::string& config, int core, double seconds) {
  const scheduling::Config c = read_flight_config(config);
  DoctorPlan plan;
  plan.usable_cores = cores_of_this_process();
  plan.seconds = seconds;
  plan.heap_mib = c.heap_mib;
  plan.control_deadline_ns = c.control_deadline_ns;
  plan.control_budget_ns = c.control_thread.budget_ns;
  if (const auto line = drivers::Endpoint::parse(c.autopilot.endpoint); line.kind == drivers::EndpointKind::kSerial)
    plan.tty = line.path;
  plan.core = rt::nearest_usable_core(core >= 0 ? core : c.control_thread.core);
  std::vector<scheduling::ThreadRow> rows{c.control_thread, c.link_thread};
  for (const auto& row : c.behaviours)
    if (row.enabled) rows.push_back(row);
  for (const auto& row : rows) {
    plan.priorities.insert(row.priority);
    plan.flight_cores.insert(rt::nearest_usable_core(core >= 0 ? core : row.core));
  }
  plan.flight_under_way = flight_under_way();
  return plan;
}

std::string setcap_command() { return "sudo setcap cap_sys_nice,cap_ipc_lock=ep " + program("wasp"); }
std::string as_root_command() { return "sudo " + program("wasp") + " doctor"; }

}  // namespace wasp::tools
