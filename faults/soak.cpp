#include "faults/soak.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <map>

#include "faults/catalogue.h"
#include "faults/flight_under_test.h"
#include "faults/injector.h"
#include "rt/clock.h"
#include "sim/random.h"

namespace wasp::faults {
namespace {

constexpr DurationNs kSamplePeriod = 15 * kSecond;
constexpr double kSettle_s = 30;
constexpr double kWarmUp_s = 30;  // not compared: the recorder's and the log's buffers find their size

/// What a process holds, as the kernel says.
struct Holdings {
  double rss_kib = 0, descriptors = 0, threads = 0;
};

struct Sample {
  double at_s = 0;
  std::size_t faults = 0;
  Holdings flight, guardian;
  double p50_us = 0, p99_us = 0, max_us = 0;  ///< tick to byte, of ticks without a fault
};

Holdings holdings_of(pid_t pid) {
  Holdings h;
  std::ifstream status(fmt::format("/proc/{}/status", pid));
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmRSS:")) h.rss_kib = std::stod(line.substr(6));
    if (line.starts_with("Threads:")) h.threads = std::stod(line.substr(8));
  }
  std::error_code gone;
  for (const auto& entry : std::filesystem::directory_iterator(fmt::format("/proc/{}/fd", pid), gone))
    h.descriptors += entry.path().empty() ? 0 : 1;
  return h;
}

/// Faults that a flight in hover recovers from and that leave the machine alone.
std::vector<const Fault*> recoverable() {
  std::vector<const Fault*> rows;
  for (const Fault& f : catalogue()) {
    const bool ends =
        f.isolated || f.promise == Promise::kGuardian || f.promise == Promise::kEnds || f.promise == Promise::kRefused;
    const bool gentle = f.injector == Injector::kPoint || f.injector == Injector::kWire ||
                        f.injector == Injector::kHangUp || f.injector == Injector::kGround ||
                        (f.injector == Injector::kSignal && f.target == "camera");
    if (!ends && gentle && !f.noisy && (f.phases & kHover) != 0) rows.push_back(&f);
  }
  return rows;
}

double quantile(std::vector<double>& values, double q) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

class Soak {
 public:
  Soak(const SoakOptions& options, const FlightPlan& plan, const std::function<bool()>& interrupted)
      : options_(options), interrupted_(interrupted), random_(options.seed), flight_(plan) {}

  int run() {
    if (!flight_.wait_for(Phase::kHover, 120)) throw std::runtime_error("the flight never came so far");
    const std::vector<const Fault*> faults = recoverable();
    const TimeNs began_ns = rt::now(), end_ns = began_ns + from_seconds(options_.seconds);
    TimeNs sample_due_ns = began_ns + kSamplePeriod;
    while (rt::now() < end_ns && flight_.running() && !interrupted_()) {
      throw_fault(*faults[static_cast<std::size_t>(random_.uniform(0, static_cast<double>(faults.size())))]);
      if (rt::now() < sample_due_ns) continue;
      take(to_seconds(rt::now() - began_ns));
      sample_due_ns = rt::now() + kSamplePeriod;
    }
    const bool alive = flight_.running() && flight_.watch().counts().incarnation == 0;
    flight_.end(20);
    write_csv();
    return interrupted_() ? 4 : judge(alive) ? 0 : 1;
  }

 private:
  void throw_fault(const Fault& fault) {
    const TimeNs from_ns = rt::now();
    const Injected injected = inject(fault, flight_, random_.bits());
    rt::sleep_until(rt::now() + from_seconds(random_.uniform(0.1, fault.for_s)));
    if (injected.undo) injected.undo();
    if (!injected.error.empty()) std::cout << fmt::format("{}: {}\n", fault.id, injected.error);
    ++thrown_[std::string(fault.id)];
    const TimeNs patience_ns = rt::now() + from_seconds(kSettle_s);
    while (!flight_.settled(Phase::kHover) && flight_.running() && rt::now() < patience_ns && !interrupted_())
      rt::sleep_until(rt::now() + 20 * kMillisecond);
    if (!flight_.settled(Phase::kHover)) unsettled_.push_back(std::string(fault.id));
    disturbed_.push_back({from_ns, rt::now()});
    rt::sleep_until(rt::now() + from_seconds(random_.uniform(0.5, 2.0)));
  }

  void take(double at_s) {
    Sample s;
    s.at_s = at_s;
    for (const auto& [id, n] : thrown_) s.faults += n;
    s.flight = holdings_of(flight_.pid_of("flight"));
    s.guardian = holdings_of(flight_.pid_of("guardian"));
    std::vector<double> bytes_us;
    const std::vector<Command> commands = flight_.watch().commands();
    for (; next_command_ < commands.size(); ++next_command_) {
      const Command& c = commands[next_command_];
      if (c.written_at_ns != 0 && !within(disturbed_, c.due_at_ns))
        bytes_us.push_back(static_cast<double>(c.written_at_ns - c.due_at_ns) * 1e-3);
    }
    s.p50_us = quantile(bytes_us, 0.5), s.p99_us = quantile(bytes_us, 0.99), s.max_us = quantile(bytes_us, 1);
    samples_.push_back(s);
    std::cout << fmt::format(
                     "{:6.0f} s  {:5} faults  flight {:.0f} KiB, {} descriptors, {} threads  guardian {:.0f} KiB, {} "
                     "descriptors  tick to byte p50 {:.0f} us, p99 {:.0f} us, max {:.0f} us\n",
                     s.at_s, s.faults, s.flight.rss_kib, s.flight.descriptors, s.flight.threads, s.guardian.rss_kib,
                     s.guardian.descriptors, s.p50_us, s.p99_us, s.max_us)
              << std::flush;
  }

  void write_csv() const {
    std::ofstream file(options_.out / "soak.csv");
    file << "at_s,faults,flight_rss_kib,flight_descriptors,flight_threads,guardian_rss_kib,guardian_descriptors,"
            "tick_to_byte_p50_us,tick_to_byte_p99_us,tick_to_byte_max_us\n";
    for (const Sample& s : samples_)
      file << fmt::format("{:.1f},{},{},{},{},{},{},{:.1f},{:.1f},{:.1f}\n", s.at_s, s.faults, s.flight.rss_kib,
                          s.flight.descriptors, s.flight.threads, s.guardian.rss_kib, s.guardian.descriptors, s.p50_us,
                          s.p99_us, s.max_us);
    if (!file.flush()) std::cerr << "cannot write " << (options_.out / "soak.csv").string() << "\n";
  }

  /// Medians of the first and the last quarter, without the warm-up.
  bool judge(bool alive) {
    std::vector<Sample> warm;
    std::ranges::copy_if(samples_, std::back_inserter(warm), [](const Sample& s) { return s.at_s > kWarmUp_s; });
    const std::size_t quarter = std::max<std::size_t>(warm.size() / 4, 1);
    bool ok = alive && warm.size() >= 4;
    const auto row = [&](const char* name, auto value, double grows_at_most, double share_at_most) {
      std::vector<double> first, last;
      for (std::size_t i = 0; i < quarter && i < warm.size(); ++i)
        first.push_back(value(warm[i])), last.push_back(value(warm[warm.size() - 1 - i]));
      const double a = quantile(first, 0.5), b = quantile(last, 0.5);
      const bool flat = b - a <= std::max(grows_at_most, share_at_most * a);
      ok = ok && flat;
      std::cout << fmt::format("{:<4} {:<28} first quarter {:>10.1f}  last {:>10.1f}\n", flat ? "ok" : "MISS", name, a,
                               b);
    };
    row(
        "flight resident KiB", [](const Sample& s) { return s.flight.rss_kib; }, 256, 0.005);
    row(
        "flight descriptors", [](const Sample& s) { return s.flight.descriptors; }, 0, 0);
    row(
        "flight threads", [](const Sample& s) { return s.flight.threads; }, 0, 0);
    row(
        "guardian resident KiB", [](const Sample& s) { return s.guardian.rss_kib; }, 64, 0.01);
    row(
        "guardian descriptors", [](const Sample& s) { return s.guardian.descriptors; }, 0, 0);
    row(
        "tick to byte p50 us", [](const Sample& s) { return s.p50_us; }, 10, 0.25);
    row(
        "tick to byte p99 us", [](const Sample& s) { return s.p99_us; }, 50, 0.5);
    std::size_t faults = 0;
    for (const auto& [id, n] : thrown_) faults += n;
    std::cout << fmt::format("{:<4} the flight goes on after {} faults of {} kinds\n", alive ? "ok" : "MISS", faults,
                             thrown_.size());
    for (const std::string& id : unsettled_) std::cout << "not settled within 30 s after " << id << "\n";
    return ok;
  }

  const SoakOptions& options_;
  const std::function<bool()>& interrupted_;
  sim::Random random_;
  FlightUnderTest flight_;
  std::map<std::string, std::size_t> thrown_;
  std::vector<std::string> unsettled_;
  std::vector<Stretch> disturbed_;
  std::vector<Sample> samples_;
  std::size_t next_command_ = 0;
};

}  // namespace

int run_soak(const SoakOptions& options, const Abilities& abilities, const std::function<bool()>& interrupted) {
  FlightPlan plan;
  plan.phase = Phase::kHover, plan.seed = options.seed;
  plan.abilities = abilities;
  plan.observers = {"recorder"};
  plan.instance = fmt::format("faults-{}-soak", getpid());
  plan.folder = options.out / plan.instance;
  return Soak(options, plan, interrupted).run();
}

}  // namespace wasp::faults
