// Every check of `wasp doctor`, in the order they are made. Those that only read work on a canned tree too; those that
// act do so with threads and child processes of their own, which take everything they changed with them.
#pragma once

#include <vector>

#include "tools/doctor_check.h"
#include "tools/doctor_plan.h"

namespace wasp::tools {

// Rights, by using them (doctor_rights.cpp).
Check check_fifo(const DoctorPlan& plan);
Check check_deadline_policy(const DoctorPlan& plan);
Check check_locked_memory(const DoctorPlan& plan);
Check check_idle_hold(const DoctorPlan& plan);

// By measuring (doctor_wakeup.cpp, doctor_spin.cpp, doctor_preemption.cpp).
std::vector<Check> check_wakeups(const DoctorPlan& plan);
Check check_throttling(const DoctorPlan& plan);
Check check_fair_server(const DoctorPlan& plan);
Check check_preemption(const DoctorPlan& plan);

// By reading (doctor_kernel.cpp, doctor_cores.cpp, doctor_power.cpp, doctor_devices.cpp).
Check check_isolation(const DoctorPlan& plan);
Check check_interrupts(const DoctorPlan& plan);
Check check_siblings(const DoctorPlan& plan);
Check check_timer_migration(const DoctorPlan& plan);
Check check_watchdog(const DoctorPlan& plan);
Check check_swap(const DoctorPlan& plan);
Check check_huge_pages(const DoctorPlan& plan);
Check check_clocksource(const DoctorPlan& plan);
Check check_virtual_machine(const DoctorPlan& plan);
Check check_governor(const DoctorPlan& plan);
Check check_turbo(const DoctorPlan& plan);
Check check_idle_states(const DoctorPlan& plan);
Check check_tty(const DoctorPlan& plan);
Check check_usb(const DoctorPlan& plan);

/// What the files alone say of kernel preemption.
struct PreemptionClaims {
  std::string sysfs, version, config, debugfs, log, command_line;  ///< what each source says, "" if it says nothing
  bool rt = false;             ///< at least one source says PREEMPT_RT and none speaks against it
  bool contradiction = false;  ///< one says PREEMPT_RT, another denies it
  bool full = false;           ///< in-kernel preemption expected (PREEMPT_RT included)
};
/// `log` is the kernel's ring buffer, "" if it may not be read.
PreemptionClaims read_preemption_claims(const SystemTree& tree, const std::string& log);

}  // namespace wasp::tools
