// Settings of the kernel and the machine below it: swap, huge pages, clock source, virtual machine.
#include <fmt/format.h>

#include "rt/clock.h"
#include "tools/doctor_checks.h"

namespace wasp::tools {
namespace {

/// Mean time of one clock reading [ns]: tens in user space, hundreds through a system call.
long long clock_read_ns() {
  constexpr int kReads = 20'000;
  const TimeNs start = rt::now();
  for (int i = 1; i < kReads; ++i) static_cast<void>(rt::now());
  return (rt::now() - start) / kReads;
}

/// Share of its time that core `core` wanted to run and the host did not let it, since boot [%]; -1 if not told.
double steal_percent(const SystemTree& tree, int core) {
  const std::string stat = tree.text("/proc/stat").value_or("");
  const std::string label = fmt::format("cpu{} ", core);
  const std::size_t at = stat.find(label);
  if (at == std::string::npos) return -1;
  const auto fields = words(std::string_view(stat).substr(at + label.size(), stat.find('\n', at) - at - label.size()));
  double total = 0;
  for (std::size_t i = 0; i < fields.size() && i < 8; ++i) total += std::stod(fields[i]);
  return fields.size() < 8 || total <= 0 ? -1 : 100.0 * std::stod(fields[7]) / total;
}

std::string hypervisor(const SystemTree& tree) {
  if (const auto type = tree.text("/sys/hypervisor/type")) return *type;
  if (tree.exists("/proc/device-tree/hypervisor")) return "a hypervisor (device tree)";
  const std::string info = tree.text("/proc/cpuinfo").value_or("");
  const std::size_t flags = info.find("\nflags");
  if (flags == std::string::npos) return {};
  const std::string line = info.substr(flags, info.find('\n', flags + 1) - flags) + " ";
  if (line.find(" hypervisor ") == std::string::npos) return {};
  return tree.text("/sys/class/dmi/id/sys_vendor").value_or("a hypervisor (processor flag)");
}

}  // namespace

Check check_swap(const DoctorPlan& plan) {
  Check c{"swap", State::kOk, "",
          "programs beside the flight wait for the disk, and the kernel works for them on any core"};
  const auto table = plan.tree.text("/proc/swaps");
  std::size_t lines = 0;
  for (const char ch : table.value_or("")) lines += ch == '\n' ? 1 : 0;
  c.measured = lines == 0 ? "off" : fmt::format("{} areas in use", lines);
  c.figures = {{"areas", lines}};
  if (lines == 0) return c;
  c.state = State::kWarn;
  c.commands = {"sudo swapoff -a"};
  return c;
}

Check check_huge_pages(const DoctorPlan& plan) {
  Check c{"transparent huge pages", State::kOk, "",
          "khugepaged rewrites the page tables of any program under a lock while it runs"};
  const auto enabled = plan.tree.text("/sys/kernel/mm/transparent_hugepage/enabled");
  if (!enabled) {
    c.measured = "not in this kernel";
    return c;
  }
  c.measured = fmt::format("{}; khugepaged defragments: {}", chosen(*enabled),
                           plan.tree.text("/sys/kernel/mm/transparent_hugepage/khugepaged/defrag").value_or("?"));
  if (chosen(*enabled) != "always") return c;
  c.state = State::kWarn;
  c.commands = {"echo madvise | sudo tee /sys/kernel/mm/transparent_hugepage/enabled"};
  return c;
}

Check check_clocksource(const DoctorPlan& plan) {
  Check c{"clock source", State::kOk, "", "every latency is a difference of two readings of this clock"};
  const std::string folder = "/sys/devices/system/clocksource/clocksource0/";
  const std::string name = plan.tree.text(folder + "current_clocksource").value_or("unknown");
  const std::string available = plan.tree.text(folder + "available_clocksource").value_or("");
  const long long read_ns = plan.tree.real() ? clock_read_ns() : 0;
  c.measured = plan.tree.real() ? fmt::format("{}, {} ns a reading", name, read_ns) : name;
  c.figures = {{"clocksource", name}, {"read_ns", read_ns}};
  constexpr long long kSlow_ns = 400;
  const bool poor = name == "hpet" || name == "acpi_pm" || name == "jiffies" || name == "refined-jiffies";
  if (!poor && read_ns <= kSlow_ns) return c;
  c.state = State::kWarn;
  for (const auto& better : words(available))
    if (poor && (better == "tsc" || better == "arch_sys_counter" || better == "kvm-clock"))
      c.commands = {fmt::format("echo {} | sudo tee {}current_clocksource", better, folder)};
  return c;
}

Check check_virtual_machine(const DoctorPlan& plan) {
  Check c{"virtual machine", State::kOk, "",
          "the host may stop the whole machine for milliseconds; nothing in here can prevent it"};
  const std::string who = hypervisor(plan.tree);
  const double steal = steal_percent(plan.tree, plan.core);
  c.measured = who.empty() ? "no" : "yes: " + who;
  if (steal >= 0)
    c.measured += fmt::format("; {:.2f} % of core {}'s time taken by a host since boot", steal, plan.core);
  c.figures = {{"hypervisor", who}, {"steal_percent", steal}};
  if (!who.empty()) c.state = State::kWarn;
  return c;
}

}  // namespace wasp::tools
