// The doctor's readers on canned trees of /proc and /sys, its verdicts, and the program itself as root and as nobody.
#include <gtest/gtest.h>

#include <set>

#include "tests/tools/program.h"
#include "tools/doctor_checks.h"

namespace wasp::tools {
namespace {

using test::TemporaryFolder;
namespace fs = std::filesystem;

/// A machine that says of itself what the test writes.
struct Canned {
  TemporaryFolder folder;
  DoctorPlan plan;
  Canned() {
    plan.tree = SystemTree(folder.path);
    plan.usable_cores = {0, 1, 2, 3};
    plan.flight_cores = {3};
    plan.core = 3;
    plan.tty = "/dev/ttyUSB0";
  }
  Canned& says(const std::string& path, const std::string& text) {
    const fs::path at = folder.path / fs::path(path).relative_path();
    fs::create_directories(at.parent_path());
    std::ofstream(at) << text << "\n";
    return *this;
  }
};

bool contains(const std::vector<std::string>& commands, const std::string& part) {
  for (const auto& c : commands)
    if (c.find(part) != std::string::npos) return true;
  return false;
}

TEST(DoctorSystem, CoreListsGoBothWays) {
  EXPECT_EQ(parse_cores("0-2,5\n"), (std::set<int>{0, 1, 2, 5}));
  EXPECT_EQ(parse_cores("managed_irq,domain,1"), (std::set<int>{1}));
  EXPECT_TRUE(parse_cores("").empty());
  EXPECT_TRUE(parse_cores("x-y,3-,99999999999").empty());
  EXPECT_EQ(core_text({0, 1, 2, 5}), "0-2,5");
  EXPECT_EQ(core_text({}), "none");
}

TEST(DoctorSystem, KernelArgumentsEndWhereInitBegins) {
  const std::string line = "quiet isolcpus=1 nohz isolcpus=2,3 preempt=full -- nohz_full=1";
  EXPECT_EQ(kernel_argument(line, "isolcpus"), "2,3");
  EXPECT_EQ(kernel_argument(line, "nohz"), "");
  EXPECT_EQ(kernel_argument(line, "nohz_full"), std::nullopt);
  EXPECT_EQ(kernel_argument(line, "preempt"), "full");
}

TEST(DoctorSystem, ChoicesAreFoundInBrackets) {
  EXPECT_EQ(chosen("always [madvise] never"), "madvise");
  EXPECT_EQ(chosen("none voluntary (full) lazy"), "full");
  EXPECT_EQ(chosen("nothing"), "");
}

TEST(DoctorCores, IsolationNeedsTheFlightsCore) {
  Canned machine;
  machine.says("/proc/cmdline", "isolcpus=2").says("/sys/devices/system/cpu/isolated", "2");
  const Check without = check_isolation(machine.plan);
  EXPECT_EQ(without.state, State::kWarn);
  EXPECT_TRUE(contains(without.commands, "isolcpus=managed_irq,domain,3 nohz_full=3 rcu_nocbs=3 irqaffinity=0-2"));
  machine.says("/sys/devices/system/cpu/isolated", "2-3");
  EXPECT_EQ(check_isolation(machine.plan).state, State::kOk);
  machine.says("/sys/devices/system/cpu/isolated", "").says("/boot/firmware/cmdline.txt", "console=tty1");
  EXPECT_TRUE(contains(check_isolation(machine.plan).commands, "/boot/firmware/cmdline.txt"));
  machine.plan.usable_cores = machine.plan.flight_cores = {0};
  EXPECT_EQ(check_isolation(machine.plan).state, State::kOk);
}

TEST(DoctorCores, InterruptsOnTheFlightsCoreAreNamedWithTheirCommand) {
  Canned machine;
  EXPECT_EQ(check_interrupts(machine.plan).state, State::kUnknown);
  machine.says("/proc/irq/24/smp_affinity_list", "0-2").says("/proc/irq/30/smp_affinity_list", "0-3");
  machine.says("/proc/irq/30/effective_affinity_list", "3").says("/proc/irq/30/eth0/.keep", "");
  machine.says("/proc/irq/31/smp_affinity_list", "0-3").says("/proc/irq/31/effective_affinity_list", "1");
  const Check c = check_interrupts(machine.plan);
  EXPECT_EQ(c.state, State::kWarn);
  EXPECT_NE(c.measured.find("1 of 3 land on core 3: 30 eth0"), std::string::npos) << c.measured;
  EXPECT_EQ(c.commands, std::vector<std::string>{"echo 0-2 | sudo tee /proc/irq/30/smp_affinity_list"});
}

TEST(DoctorCores, SiblingsTimersAndWatchdogs) {
  Canned machine;
  machine.says("/sys/devices/system/cpu/cpu3/topology/thread_siblings_list", "1,3");
  EXPECT_EQ(check_siblings(machine.plan).state, State::kWarn);
  machine.says("/sys/devices/system/cpu/cpu3/topology/thread_siblings_list", "3");
  EXPECT_EQ(check_siblings(machine.plan).state, State::kOk);
  machine.says("/proc/sys/kernel/timer_migration", "1");
  EXPECT_EQ(check_timer_migration(machine.plan).state, State::kWarn);
  machine.says("/proc/sys/kernel/watchdog", "1").says("/proc/sys/kernel/watchdog_cpumask", "0-3");
  EXPECT_TRUE(contains(check_watchdog(machine.plan).commands, "kernel.watchdog_cpumask=0-2"));
  machine.says("/proc/sys/kernel/watchdog_cpumask", "0-2");
  EXPECT_EQ(check_watchdog(machine.plan).state, State::kOk);
}

TEST(DoctorPower, GovernorTurboAndSleepStates) {
  Canned machine;
  EXPECT_EQ(check_governor(machine.plan).state, State::kOk);  // nothing visible: nothing to change
  machine.says("/sys/devices/system/cpu/cpu3/cpufreq/scaling_governor", "schedutil");
  EXPECT_TRUE(contains(check_governor(machine.plan).commands, "cpu3/cpufreq/scaling_governor"));
  machine.says("/sys/devices/system/cpu/cpu3/cpufreq/scaling_governor", "performance");
  EXPECT_EQ(check_governor(machine.plan).state, State::kOk);
  machine.says("/sys/devices/system/cpu/intel_pstate/no_turbo", "0");
  EXPECT_EQ(check_turbo(machine.plan).state, State::kWarn);
  machine.says("/sys/devices/system/cpu/intel_pstate/no_turbo", "1");
  EXPECT_EQ(check_turbo(machine.plan).state, State::kOk);
  const std::string idle = "/sys/devices/system/cpu/cpu3/cpuidle/";
  machine.says(idle + "state0/latency", "2").says(idle + "state1/latency", "400").says(idle + "state1/disable", "0");
  EXPECT_EQ(check_idle_states(machine.plan).state, State::kWarn);
  machine.says(idle + "state1/disable", "1");
  EXPECT_EQ(check_idle_states(machine.plan).state, State::kOk);
  machine.says(idle + "state1/disable", "0").says("/dev/cpu_dma_latency", "");
  EXPECT_EQ(check_idle_states(machine.plan).state, State::kOk);
}

TEST(DoctorKernel, SwapHugePagesClockAndHypervisor) {
  Canned machine;
  machine.says("/proc/swaps", "Filename Type Size Used Priority");
  EXPECT_EQ(check_swap(machine.plan).state, State::kOk);
  machine.says("/proc/swaps", "Filename Type Size Used Priority\n/dev/sda2 partition 1 0 -2");
  EXPECT_EQ(check_swap(machine.plan).state, State::kWarn);
  machine.says("/sys/kernel/mm/transparent_hugepage/enabled", "[always] madvise never");
  EXPECT_EQ(check_huge_pages(machine.plan).state, State::kWarn);
  const std::string clock = "/sys/devices/system/clocksource/clocksource0/";
  machine.says(clock + "current_clocksource", "hpet").says(clock + "available_clocksource", "tsc hpet acpi_pm");
  EXPECT_TRUE(contains(check_clocksource(machine.plan).commands, "echo tsc"));
  machine.says("/proc/cpuinfo", "processor : 0\nflags : fpu hypervisor sse\nbogomips : 1");
  machine.says("/proc/stat", "cpu 1 1 1 1 1 1 1 1\ncpu3 10 0 10 60 0 0 0 20 0 0");
  const Check vm = check_virtual_machine(machine.plan);
  EXPECT_EQ(vm.state, State::kWarn);
  EXPECT_DOUBLE_EQ(vm.figures["steal_percent"].get<double>(), 20.0);
  machine.says("/proc/cpuinfo", "processor : 0\nflags : fpu sse");
  EXPECT_EQ(check_virtual_machine(machine.plan).state, State::kOk);
}

TEST(DoctorDevices, SerialLineAndUsb) {
  Canned machine;
  EXPECT_EQ(check_tty(machine.plan).state, State::kUnknown);
  machine.says("/sys/class/tty/ttyUSB0/dev", "188:0").says("/sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "16");
  EXPECT_TRUE(contains(check_tty(machine.plan).commands, "echo 1 | sudo tee"));
  machine.says("/sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "1");
  EXPECT_EQ(check_tty(machine.plan).state, State::kOk);
  machine.plan.tty = "/dev/ttyS1";
  machine.says("/sys/class/tty/ttyS1/flags", "0x10000040");
  EXPECT_TRUE(contains(check_tty(machine.plan).commands, "setserial /dev/ttyS1 low_latency"));
  machine.says("/sys/class/tty/ttyS1/flags", "0x10002040");
  EXPECT_EQ(check_tty(machine.plan).state, State::kOk);
  machine.says("/sys/bus/usb/devices/1-1/power/control", "auto").says("/sys/bus/usb/devices/1-1/product", "Kinect");
  machine.says("/sys/bus/usb/devices/usb1/power/control", "on");
  const Check usb = check_usb(machine.plan);
  EXPECT_EQ(usb.commands.size(), 1u);
  EXPECT_NE(usb.measured.find("1-1 Kinect"), std::string::npos);
}

TEST(DoctorPreemption, NoSourceIsTrustedAlone) {
  Canned machine;
  const std::string rt = "Linux version 6.1.0-9-rt-amd64 (x) #1 SMP PREEMPT_RT Debian";
  machine.says("/sys/kernel/realtime", "1").says("/proc/version", rt);
  machine.says("/boot/config-6.1.0-9-rt-amd64", "CONFIG_HZ=250\nCONFIG_PREEMPT_RT=y");
  EXPECT_TRUE(read_preemption_claims(machine.plan.tree, "").rt);
  machine.says("/boot/config-6.1.0-9-rt-amd64", "CONFIG_PREEMPT=y");
  const auto claims = read_preemption_claims(machine.plan.tree, "");
  EXPECT_TRUE(claims.contradiction);
  EXPECT_FALSE(claims.rt);
}

TEST(DoctorPreemption, WhatIsInForceBeatsWhatWasBuiltIn) {
  Canned machine;
  machine.says("/proc/version", "Linux version 6.12.1 (x) #1 SMP PREEMPT_DYNAMIC");
  machine.says("/boot/config-6.12.1", "CONFIG_PREEMPT=y\nCONFIG_PREEMPT_DYNAMIC=y");
  EXPECT_TRUE(read_preemption_claims(machine.plan.tree, "").full);
  EXPECT_FALSE(read_preemption_claims(machine.plan.tree, "[0.1] Dynamic Preempt: none\n[0.2] x").full);
  machine.says("/sys/kernel/debug/sched/preempt", "none voluntary (full) lazy");
  EXPECT_TRUE(read_preemption_claims(machine.plan.tree, "[0.1] Dynamic Preempt: none\n").full);
  EXPECT_FALSE(read_preemption_claims(machine.plan.tree, "").rt);
}

TEST(DoctorVerdict, ExitCodesAndCommands) {
  const Check good{"a", State::kOk, "", "", {"never shown"}};
  const Check doubt{"b", State::kUnknown, "", "", {"look"}};
  const Check warn{"c", State::kWarn, "m", "because", {"mend", "look"}};
  const Check bad{"d", State::kFail, "", "", {}};
  EXPECT_EQ(exit_code_of({good}), 0);
  EXPECT_EQ(exit_code_of({good, doubt}), 1);
  EXPECT_EQ(exit_code_of({good, warn}), 1);
  EXPECT_EQ(exit_code_of({bad, warn}), 2);
  EXPECT_EQ(commands_of({good, doubt, warn}), (std::vector<std::string>{"look", "mend"}));
  EXPECT_EQ(doctor_json({warn, bad})["exit_code"], 2);
  EXPECT_NE(fix_script({good, warn}).find("# c: because\nmend\n"), std::string::npos);
  EXPECT_EQ(fix_script({good}).find("never shown"), std::string::npos);
}

/// What the program prints must be one whole JSON object whose parts agree with each other and with the exit code.
void expect_sound(const std::string& text, int code) {
  const auto document = nlohmann::json::parse(text, nullptr, false);
  ASSERT_TRUE(document.is_object()) << text;
  EXPECT_EQ(document["exit_code"].get<int>(), code);
  EXPECT_FALSE(document["verdict"].get<std::string>().empty());
  std::set<std::string> names;
  int fails = 0;
  for (const auto& c : document["checks"]) {
    names.insert(c["name"].get<std::string>());
    fails += c["state"] == "fail" ? 1 : 0;
    EXPECT_FALSE(c["measured"].get<std::string>().empty()) << c;
    EXPECT_FALSE(c["why"].get<std::string>().empty()) << c;
  }
  for (const char* name : {"SCHED_FIFO", "locked memory", "kernel preemption", "real-time throttling",
                           "fair-server stall", "interrupt affinity", "serial line", "USB autosuspend"})
    EXPECT_TRUE(names.contains(name)) << name;
  EXPECT_EQ(fails > 0, code == 2);
}

std::string doctor_command(const std::string& options) {
  return test::program_path("wasp") + " doctor " + options + " 2>/dev/null";
}

TEST(DoctorProgram, ExaminesThisMachine) {
  const auto [text, code] = test::run_shell(doctor_command("--json --seconds 0.5"));
  EXPECT_LE(code, 2);
  expect_sound(text, code);
}

TEST(DoctorProgram, SaysAsAPlainUserWhatItCouldNotDo) {
  const std::string as_nobody = "setpriv --reuid=65534 --regid=65534 --clear-groups --bounding-set=-all ";
  if (getuid() != 0) GTEST_SKIP() << "only root can become nobody";
  if (test::run_shell(as_nobody + "test -x " + test::program_path("wasp-doctor")).second != 0)
    GTEST_SKIP() << "the build folder is closed to others";
  const auto [text, code] = test::run_shell(as_nobody + doctor_command("--json --seconds 0.5"));
  EXPECT_GE(code, 1);
  expect_sound(text, code);
  const auto document = nlohmann::json::parse(text, nullptr, false);
  ASSERT_TRUE(document.is_object());
  EXPECT_NE(document["commands"].dump().find("setcap"), std::string::npos) << document["commands"];
}

TEST(DoctorProgram, RefusesWhatIsNotThere) {
  EXPECT_EQ(test::run_shell(doctor_command("--core 1000")).second, 3);
  EXPECT_EQ(test::run_shell(doctor_command("--config /nowhere.toml")).second, 3);
}

}  // namespace
}  // namespace wasp::tools
