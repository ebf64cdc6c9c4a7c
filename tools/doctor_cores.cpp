// Who else may use the flight's cores: the scheduler, interrupts, the sibling of a core, timers, the watchdog.
#include <fmt/format.h>

#include "tools/doctor_checks.h"

namespace wasp::tools {
namespace {

bool only_core(const DoctorPlan& plan) { return plan.usable_cores.size() == 1; }

bool holds_all(const std::set<int>& some, const std::set<int>& wanted) {
  for (const int c : wanted)
    if (!some.contains(c)) return false;
  return true;
}

std::set<int> cut(const std::set<int>& a, const std::set<int>& b) {
  std::set<int> both;
  for (const int c : a)
    if (b.contains(c)) both.insert(c);
  return both;
}

/// Adds kernel parameters the way this machine's boot loader wants it.
std::vector<std::string> add_kernel_parameters(const SystemTree& tree, const std::string& parameters) {
  if (tree.exists("/boot/firmware/cmdline.txt"))
    return {fmt::format("sudo sed -i 's/$/ {}/' /boot/firmware/cmdline.txt  # then reboot", parameters)};
  return {
      fmt::format("echo 'GRUB_CMDLINE_LINUX_DEFAULT=\"$GRUB_CMDLINE_LINUX_DEFAULT {}\"' | "
                  "sudo tee /etc/default/grub.d/wasp.cfg && sudo update-grub  # then reboot",
                  parameters)};
}

struct Interrupt {
  std::string number, name;
  std::set<int> allowed, effective;
};

std::vector<Interrupt> interrupts_of(const SystemTree& tree) {
  std::vector<Interrupt> all;
  for (const auto& number : tree.names("/proc/irq")) {
    const std::string folder = "/proc/irq/" + number;
    const auto allowed = tree.text(folder + "/smp_affinity_list");
    if (!allowed) continue;
    Interrupt irq{number, {}, parse_cores(*allowed), {}};
    irq.effective = parse_cores(tree.text(folder + "/effective_affinity_list").value_or(*allowed));
    for (const auto& name : tree.names(folder))
      if (tree.exists(folder + "/" + name + "/.") && name != "." && irq.name.empty()) irq.name = name;
    all.push_back(std::move(irq));
  }
  return all;
}

}  // namespace

Check check_isolation(const DoctorPlan& plan) {
  Check c{"core isolation", State::kOk, "",
          "other programs on the flight's core evict its caches and delay its threads"};
  const std::string line = plan.tree.text("/proc/cmdline").value_or("");
  const auto isolated = parse_cores(plan.tree.text("/sys/devices/system/cpu/isolated").value_or(""));
  const auto tickless = parse_cores(plan.tree.text("/sys/devices/system/cpu/nohz_full").value_or(""));
  c.measured = fmt::format("flight cores {}; isolated {}, nohz_full {}", core_text(plan.flight_cores),
                           core_text(isolated), core_text(tickless));
  for (const char* key : {"isolcpus", "nohz_full", "rcu_nocbs", "irqaffinity"})
    if (const auto value = kernel_argument(line, key)) c.measured += fmt::format(", {}={}", key, *value);
  c.figures = {{"isolated", isolated}, {"nohz_full", tickless}, {"flight_cores", plan.flight_cores}};
  if (only_core(plan)) {
    c.measured += "; one core: nothing to isolate";
    return c;
  }
  if (holds_all(isolated, plan.flight_cores)) return c;
  c.state = State::kWarn;
  const std::string cores = core_text(plan.flight_cores);
  c.commands = add_kernel_parameters(
      plan.tree, fmt::format("isolcpus=managed_irq,domain,{0} nohz_full={0} rcu_nocbs={0} irqaffinity={1}", cores,
                             core_text(plan.other_cores())));
  return c;
}

Check check_interrupts(const DoctorPlan& plan) {
  Check c{"interrupt affinity", State::kOk, "",
          "an interrupt on the flight's core runs before any thread of the flight"};
  const auto all = interrupts_of(plan.tree);
  std::string landing;
  int on_core = 0;
  for (const auto& irq : all) {
    if (cut(irq.effective, plan.flight_cores).empty()) continue;
    ++on_core;
    landing += (landing.empty() ? "" : ", ") + irq.number + (irq.name.empty() ? "" : " " + irq.name);
    c.commands.push_back(
        fmt::format("echo {} | sudo tee /proc/irq/{}/smp_affinity_list", core_text(plan.other_cores()), irq.number));
  }
  c.figures = {{"interrupts", all.size()}, {"on_flight_cores", on_core}};
  if (all.empty()) {
    c.state = State::kUnknown;
    c.measured = "/proc/irq holds no readable affinities";
    return c;
  }
  c.measured = fmt::format("{} of {} land on core {}{}{}", on_core, all.size(), core_text(plan.flight_cores),
                           landing.empty() ? "" : ": ", landing);
  if (only_core(plan)) {
    c.commands.clear();
    c.measured += "; one core: no other place for them";
  } else if (on_core > 0) {
    c.state = State::kWarn;
  }
  return c;
}

Check check_siblings(const DoctorPlan& plan) {
  Check c{"SMT siblings", State::kOk, "", "a sibling shares the core's pipelines: its load slows the flight's steps"};
  for (const int core : plan.flight_cores) {
    const auto siblings =
        plan.tree.text(fmt::format("/sys/devices/system/cpu/cpu{}/topology/thread_siblings_list", core));
    if (siblings && parse_cores(*siblings).size() > 1) c.state = State::kWarn;
    c.measured +=
        fmt::format("{}core {} shares with {}", c.measured.empty() ? "" : "; ", core, siblings.value_or("(not told)"));
  }
  if (c.state == State::kWarn) c.commands = {"echo off | sudo tee /sys/devices/system/cpu/smt/control"};
  return c;
}

Check check_timer_migration(const DoctorPlan& plan) {
  Check c{"timer migration", State::kOk, "", "timers of idle cores move to a busy one and interrupt it"};
  const auto on = plan.tree.number("/proc/sys/kernel/timer_migration");
  c.measured = on ? fmt::format("kernel.timer_migration = {}", *on) : "the kernel has no kernel.timer_migration";
  if (on.value_or(0) == 0 || only_core(plan)) return c;
  c.state = State::kWarn;
  c.commands = {"sudo sysctl -w kernel.timer_migration=0"};
  return c;
}

Check check_watchdog(const DoctorPlan& plan) {
  Check c{"lock-up watchdogs", State::kOk, "",
          "they run above SCHED_FIFO, or as non-maskable interrupts, every few seconds"};
  const long long soft = plan.tree.number("/proc/sys/kernel/watchdog").value_or(0);
  const long long nmi = plan.tree.number("/proc/sys/kernel/nmi_watchdog").value_or(0);
  const auto mask = plan.tree.text("/proc/sys/kernel/watchdog_cpumask");
  const bool here = soft + nmi > 0 && (!mask || !cut(parse_cores(*mask), plan.flight_cores).empty());
  c.measured = fmt::format("soft {}, NMI {}, on cores {}", soft != 0 ? "on" : "off", nmi != 0 ? "on" : "off",
                           mask.value_or("(not told)"));
  if (!here || only_core(plan)) return c;
  c.state = State::kWarn;
  c.commands = {"sudo sysctl -w kernel.watchdog_cpumask=" + core_text(plan.other_cores())};
  return c;
}

}  // namespace wasp::tools
