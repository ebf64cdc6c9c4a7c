#include "scheduling/switch_trace.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>

namespace wasp::scheduling {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPrefix = "wasp-";
constexpr const char* kBufferKib = "512";  // some 6000 switches: more than the supervisor's look apart

template <class T>
bool number_after(std::string_view line, std::string_view key, T& out) {
  const auto at = line.find(key);
  if (at == std::string_view::npos) return false;
  const char* first = line.data() + at + key.size();
  return std::from_chars(first, line.data() + line.size(), out).ec == std::errc{};
}

std::string_view between(std::string_view line, std::string_view before, std::string_view after) {
  const auto a = line.find(before);
  if (a == std::string_view::npos) return {};
  const auto from = a + before.size();
  const auto b = after.empty() ? line.size() : line.find(after, from);
  return b == std::string_view::npos ? std::string_view{} : line.substr(from, b - from);
}

/// "   task-12   [001] d..2.  1234.567890: event: ..." -> core, time.
bool parse_head(std::string_view line, std::size_t event_at, KernelEvent& e) {
  const std::string_view head = line.substr(0, event_at);
  const auto open = head.rfind(" [");
  if (open == std::string_view::npos || !number_after(head.substr(open), " [", e.core)) return false;
  const auto space = head.rfind(' ');
  long seconds = 0, micros = 0;
  const std::string_view clock = head.substr(space + 1);
  if (!number_after(clock, "", seconds) || !number_after(clock, ".", micros)) return false;
  e.at_ns = seconds * kSecond + micros * kMicrosecond;
  return true;
}

bool parse_line(std::string_view line, KernelEvent& e) {
  if (const auto at = line.find(": sched_switch: "); at != std::string_view::npos) {
    const auto arrow = line.rfind("==> ");
    if (arrow == std::string_view::npos || !parse_head(line, at, e)) return false;
    const std::string_view next = line.substr(arrow);
    const auto left = line.rfind(" prev_prio=", arrow);
    if (left == std::string_view::npos || !number_after(line.substr(left), " prev_prio=", e.left_priority))
      return false;
    e.task = between(next, "next_comm=", " next_pid=");
    return number_after(next, "next_pid=", e.pid) && number_after(next, "next_prio=", e.priority);
  }
  if (const auto at = line.find(": irq_handler_entry: "); at != std::string_view::npos && parse_head(line, at, e)) {
    e.interrupt = true;
    e.task = fmt::format("irq {} {}", between(line, "irq=", " "), between(line, "name=", ""));
    return true;
  }
  if (const auto at = line.find(": softirq_entry: "); at != std::string_view::npos && parse_head(line, at, e)) {
    e.interrupt = true;
    e.task = fmt::format("softirq {}", between(line, "[action=", "]"));
    return true;
  }
  return false;
}

fs::path mounted(const std::string& tracefs) {
  std::error_code ignored;
  const std::vector<std::string> places =
      tracefs.empty() ? std::vector<std::string>{"/sys/kernel/tracing", "/sys/kernel/debug/tracing"}
                      : std::vector<std::string>{tracefs};
  for (const auto& p : places)
    if (fs::is_directory(p + "/instances", ignored)) return p;
  return {};
}

/// Instances of flights that were killed.
void remove_orphans(const fs::path& instances) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(instances, ignored)) {
    const std::string name = entry.path().filename();
    int pid = 0;
    if (name.starts_with(kPrefix) && number_after(name, kPrefix, pid) && kill(pid, 0) != 0 && errno == ESRCH)
      rmdir(entry.path().c_str());
  }
}

/// A core mask as tracefs takes it: hexadecimal, groups of 32 bits.
std::string mask_of(int core) {
  std::string mask = fmt::format("{:x}", 1u << (core % 32));
  for (int group = core / 32; group > 0; --group) mask += ",00000000";
  return mask;
}

}  // namespace

std::vector<KernelEvent> parse_trace(std::string_view text) {
  std::vector<KernelEvent> events;
  while (!text.empty()) {
    const auto end = text.find('\n');
    KernelEvent e;
    if (parse_line(text.substr(0, end), e)) events.push_back(e);
    if (end == std::string_view::npos) break;
    text.remove_prefix(end + 1);
  }
  return events;
}

std::vector<CoreShare> shares_of(const std::vector<KernelEvent>& events, int core, TimeNs from_ns, TimeNs to_ns) {
  std::map<std::pair<std::string, int>, CoreShare> shares;
  const KernelEvent* running = nullptr;
  const auto give = [&](TimeNs until_ns, int priority) {
    if (running == nullptr) return;
    const DurationNs ran_ns = std::min(until_ns, to_ns) - std::max(running->at_ns, from_ns);
    if (ran_ns <= 0) return;
    CoreShare& s = shares[{running->task, running->pid}];
    s.name = running->task;
    s.pid = running->pid;
    s.priority = priority;
    s.ran_ns += ran_ns;
  };
  for (const auto& e : events) {
    if (e.core != core) continue;
    if (e.interrupt) {
      if (e.at_ns < from_ns || e.at_ns > to_ns) continue;
      CoreShare& s = shares[{e.task, -1}];
      s.name = e.task;
      s.pid = -1;
      ++s.interrupts;
    } else {
      give(e.at_ns, e.left_priority);
      running = &e;
    }
  }
  if (running != nullptr) give(to_ns, running->priority);
  std::vector<CoreShare> list;
  for (auto& [key, share] : shares) list.push_back(share);
  std::stable_sort(list.begin(), list.end(), [](const auto& a, const auto& b) {
    return a.ran_ns != b.ran_ns ? a.ran_ns > b.ran_ns : a.interrupts > b.interrupts;
  });
  return list;
}

SwitchTrace::SwitchTrace(const std::string& tracefs, int core) : core_(core) {
  const fs::path root = mounted(tracefs);
  if (core < 0) {
    why_not_ = "the control thread is bound to no core";
  } else if (root.empty()) {
    why_not_ = "tracefs is not mounted (mount -t tracefs nodev /sys/kernel/tracing) or not readable for this user";
  } else {
    remove_orphans(root / "instances");
    make_instance(root / "instances" / (kPrefix + std::to_string(getpid())));
  }
}

void SwitchTrace::make_instance(const fs::path& instance) {
  std::error_code error;
  fs::create_directory(instance, error);
  if (error) {
    why_not_ = "cannot make " + instance.string() + ": " + error.message();
    return;
  }
  instance_ = instance;
  if (!write("trace_clock", "mono") || !write("buffer_size_kb", kBufferKib) ||
      !write("tracing_cpumask", mask_of(core_)) || !write("events/sched/sched_switch/enable", "1"))
    return;
  std::error_code ignored;  // not every kernel has every interrupt event
  for (const char* event : {"irq/irq_handler_entry", "irq/softirq_entry"})
    if (fs::exists(instance_ / "events" / event, ignored)) write(std::string("events/") + event + "/enable", "1");
  write("tracing_on", "1");
}

SwitchTrace::~SwitchTrace() {
  if (!instance_.empty()) rmdir(instance_.c_str());
}

bool SwitchTrace::write(const std::string& file, const std::string& text) {
  std::ofstream out(instance_ / file);
  out << text << std::flush;
  if (!out && why_not_.empty()) why_not_ = "cannot write " + (instance_ / file).string() + ": " + std::strerror(errno);
  return static_cast<bool>(out);
}

std::vector<KernelEvent> SwitchTrace::take() {
  write("tracing_on", "0");
  std::ifstream file(instance_ / "trace");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  write("trace", "");
  write("tracing_on", "1");
  return parse_trace(text);
}

}  // namespace wasp::scheduling
