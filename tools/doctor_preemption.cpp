// The kernel's preemption model: six sources that each may be wrong or missing, and behaviour. The behaviour: an
// ordinary thread makes one long system call after the other (poll over as many descriptors as it may have: a loop in
// the kernel without a scheduling point), while a SCHED_FIFO thread on the same core wakes every millisecond. A kernel
// that preempts itself wakes it at once; one that does not, up to a whole call later.
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/klog.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <system_error>

#include "rt/clock.h"
#include "rt/thread.h"
#include "tools/doctor_checks.h"
#include "tools/latency_summary.h"
#include "tools/quantiles.h"
#include "tools/wakeup_loop.h"

namespace wasp::tools {
namespace {

std::string kernel_log() {
  constexpr int kReadAll = 3;
  std::string text(std::size_t{1} << 20, '\0');
  const int n = klogctl(kReadAll, text.data(), static_cast<int>(text.size()));
  text.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  return text;
}

/// The preemption choices of a kernel configuration, e.g. "PREEMPT_RT", "PREEMPT_DYNAMIC, PREEMPT_NONE".
std::string config_claim(const std::string& config) {
  std::string claim;
  for (const char* option :
       {"PREEMPT_RT", "PREEMPT_DYNAMIC", "PREEMPT_NONE", "PREEMPT_VOLUNTARY", "PREEMPT_LAZY", "PREEMPT"})
    if (("\n" + config).find(fmt::format("\nCONFIG_{}=y\n", option)) != std::string::npos)
      claim += (claim.empty() ? "" : ", ") + std::string(option);
  return claim;
}

std::string version_claim(const std::string& version) {
  for (const char* word : {"PREEMPT_RT", "PREEMPT_DYNAMIC", "PREEMPT"})
    if (version.find(word) != std::string::npos) return word;
  return version.empty() ? "" : "no word of preemption";
}

/// "Dynamic Preempt: none" -> "none".
std::string log_claim(const std::string& log) {
  constexpr std::string_view kMark = "Dynamic Preempt: ";
  const std::size_t at = log.rfind(kMark);
  if (at == std::string::npos) return {};
  return log.substr(at + kMark.size(), log.find_first_of(" \n", at + kMark.size()) - at - kMark.size());
}

bool says_full(const PreemptionClaims& c) {
  if (c.rt) return true;
  for (const std::string& mode : {c.debugfs, c.command_line, c.log})  // what is in force beats what was built in
    if (!mode.empty()) return mode == "full" || mode == "lazy";
  const std::string list = ", " + c.config + ",";
  return list.find(", PREEMPT,") != std::string::npos || c.version == "PREEMPT";
}

struct Behaviour {
  std::string refused;
  DurationNs call_ns = 0;  ///< median length of one system call
  double wakeup_p90_ns = 0;
  std::size_t wakeups = 0;
};

/// As many descriptors as the hard limit allows for the moment; the limit is put back.
class ManyDescriptors {
 public:
  ManyDescriptors() {
    getrlimit(RLIMIT_NOFILE, &saved_);
    rlimit raised = saved_;
    raised.rlim_cur = raised.rlim_max;
    setrlimit(RLIMIT_NOFILE, &raised);
    getrlimit(RLIMIT_NOFILE, &raised);
    wanted_.resize(std::min<std::size_t>(raised.rlim_cur, 65'536), pollfd{null_, POLLIN, 0});
  }
  ~ManyDescriptors() {
    setrlimit(RLIMIT_NOFILE, &saved_);
    close(null_);
  }
  ManyDescriptors(const ManyDescriptors&) = delete;
  ManyDescriptors& operator=(const ManyDescriptors&) = delete;
  void call() { poll(wanted_.data(), wanted_.size(), 0); }

 private:
  rlimit saved_{};
  int null_ = open("/dev/null", O_RDONLY | O_CLOEXEC);
  std::vector<pollfd> wanted_;
};

Behaviour observe(int core) {
  Behaviour b;
  std::atomic<bool> stop{false};
  std::vector<std::int64_t> calls;
  calls.reserve(1 << 16);
  ManyDescriptors descriptors;
  try {
    WakeupLoop loop({core, 2, kMillisecond, rt::now() + 100 * kMillisecond, 900});
    rt::Thread caller({.name = "caller", .core = core}, [&] {
      const TimeNs end = rt::now() + kSecond;
      while (!stop && rt::now() < end && calls.size() < calls.capacity()) {
        const TimeNs before = rt::now();
        descriptors.call();
        calls.push_back(rt::now() - before);
      }
    });
    rt::sleep_until(rt::now() + kSecond);
    stop = true;
    caller.join();
    auto late_ns = whole_population(loop.finish(), kMillisecond).late_ns;
    std::sort(late_ns.begin(), late_ns.end());
    b.wakeups = late_ns.size();
    b.wakeup_p90_ns = late_ns.empty() ? 0 : static_cast<double>(late_ns[late_ns.size() * 9 / 10]);
  } catch (const std::system_error& e) {
    b.refused = std::generic_category().message(e.code().value());
  }
  b.call_ns = static_cast<DurationNs>(quantiles(calls).p50);
  return b;
}

std::string quoted(const char* source, const std::string& claim) {
  return fmt::format("{} {}; ", source, claim.empty() ? "(silent)" : claim);
}

}  // namespace

PreemptionClaims read_preemption_claims(const SystemTree& tree, const std::string& log) {
  PreemptionClaims c;
  c.sysfs = tree.text("/sys/kernel/realtime").value_or("");
  const std::string version = tree.text("/proc/version").value_or("");
  const std::string release = words(version).size() > 2 ? words(version)[2] : "";
  c.version = version_claim(version);
  auto config = tree.unzipped("/proc/config.gz");
  if (!config || config->empty()) config = tree.text("/boot/config-" + release);
  c.config = config_claim(config.value_or("") + "\n");
  c.debugfs = chosen(tree.text("/sys/kernel/debug/sched/preempt").value_or(""));
  c.command_line = kernel_argument(tree.text("/proc/cmdline").value_or(""), "preempt").value_or("");
  c.log = log_claim(log);
  const bool config_rt = c.config.find("PREEMPT_RT") != std::string::npos, version_rt = c.version == "PREEMPT_RT";
  const bool one_says_yes = c.sysfs == "1" || version_rt || config_rt;
  const bool one_says_no = c.sysfs == "0" || (!version.empty() && !version_rt) || (!c.config.empty() && !config_rt);
  c.contradiction = one_says_yes && one_says_no;
  c.rt = one_says_yes && !one_says_no;
  c.full = says_full(c);
  return c;
}

Check check_preemption(const DoctorPlan& plan) {
  Check c{"kernel preemption", State::kOk, "",
          "only PREEMPT_RT lets a real-time thread interrupt the kernel nearly everywhere"};
  const PreemptionClaims claims = read_preemption_claims(plan.tree, plan.tree.real() ? kernel_log() : "");
  c.measured = quoted("/sys/kernel/realtime", claims.sysfs) + quoted("version", claims.version) +
               quoted("config", claims.config) + quoted("debugfs", claims.debugfs) + quoted("log", claims.log);
  bool preempts = claims.full, observed = false;
  if (plan.tree.real() && plan.flight_under_way.empty()) {
    const Behaviour b = observe(plan.core);
    const auto call = static_cast<double>(b.call_ns);
    observed = b.refused.empty() && b.call_ns > 100 * kMicrosecond &&
               (b.wakeup_p90_ns < call / 10 || b.wakeup_p90_ns > call / 3);
    if (observed) preempts = b.wakeup_p90_ns < call / 10;
    c.measured += !b.refused.empty() ? "behaviour not observed: SCHED_FIFO " + b.refused
                                     : fmt::format("behaviour: wake-up p90 {} during system calls of {} (n {}): {}",
                                                   duration_text(static_cast<std::int64_t>(b.wakeup_p90_ns)),
                                                   duration_text(b.call_ns), b.wakeups,
                                                   !observed  ? "cannot tell"
                                                   : preempts ? "preempts itself"
                                                              : "does not preempt itself");
    c.figures = {{"call_ns", b.call_ns}, {"wakeup_p90_ns", b.wakeup_p90_ns}, {"wakeup_count", b.wakeups}};
  }
  c.figures["claims_rt"] = claims.rt;
  c.figures["claims_full"] = claims.full;
  c.figures["preempts"] = observed ? nlohmann::json(preempts) : nlohmann::json(nullptr);
  if (claims.contradiction) c.measured += "; THE SOURCES CONTRADICT EACH OTHER";
  if (observed && preempts != claims.full) c.measured += "; behaviour and claims disagree";
  if (claims.rt && (!observed || preempts)) return c;
  c.state = State::kWarn;
  c.commands = {"sudo apt-get install linux-image-rt-$(dpkg --print-architecture)  # then reboot into it"};
  return c;
}

}  // namespace wasp::tools
