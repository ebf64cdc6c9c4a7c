#include "benchmarks/latency_pair.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <stdexcept>

#include "benchmarks/child.h"
#include "benchmarks/latency_flight.h"
#include "benchmarks/latency_foreign.h"
#include "benchmarks/latency_load.h"
#include "rt/clock.h"
#include "rt/thread.h"
#include "tools/cyclictest.h"
#include "tools/piped_child.h"
#include "tools/wakeup_loop.h"

namespace wasp::bench {
namespace {

constexpr DurationNs kLead = 250 * kMicrosecond;  // several times what a control tick takes
constexpr DurationNs kSettle = kSecond;

/// The reference: cyclictest, or where it cannot run a loop of our own in its place.
class Reference {
 public:
  Reference(PairSetup& setup, DurationNs period_ns, double seconds, TimeNs grid_ns) {
    const auto program = tools::find_cyclictest();
    setup.cyclictest = program.has_value() && setup.real_time;
    const TimeNs next_second = (rt::now() / kSecond + 1) * kSecond;
    DurationNs phase = (grid_ns - next_second) % period_ns;
    if (phase < 0) phase += period_ns;
    if (!setup.cyclictest) {
      const auto room = static_cast<std::size_t>(seconds * 1e9 / static_cast<double>(period_ns)) + 1;
      loop_ = std::make_unique<tools::WakeupLoop>(tools::WakeupSpec{
          setup.core, setup.real_time ? setup.reference_priority : 0, period_ns, next_second + phase, room});
      end_ns_ = next_second + from_seconds(seconds);
      return;
    }
    spec_ = {{setup.core}, rt::nearest_usable_core(0),          setup.reference_priority,
             period_ns,    phase / kMicrosecond * kMicrosecond, seconds};
    reader_ = std::make_unique<tools::CyclictestReader>(spec_);
    child_ = std::make_unique<tools::PipedChild>(tools::cyclictest_arguments(*program, spec_));
  }

  /// Listens for a moment; false when it has ended.
  bool listen() {
    if (child_) return child_->read(*reader_, 20 * kMillisecond);
    rt::sleep_until(rt::now() + 20 * kMillisecond);
    return rt::now() < end_ns_;
  }

  std::vector<tools::Wakeup> finish() {
    if (loop_) return loop_->finish();
    const auto all = reader_->wakeups();
    if (all.empty()) throw std::runtime_error("cyclictest gave no figures:\n" + reader_->complaints());
    return all.begin()->second;
  }

 private:
  tools::CyclictestSpec spec_;
  std::unique_ptr<tools::CyclictestReader> reader_;
  std::unique_ptr<tools::PipedChild> child_;
  std::unique_ptr<tools::WakeupLoop> loop_;
  TimeNs end_ns_ = 0;
};

/// In the middle of control's deadline.
std::unique_ptr<tools::WakeupLoop> start_witness(const PairSetup& setup, const FlightTimes& times, double seconds,
                                                 TimeNs due_ns) {
  const auto room = static_cast<std::size_t>((seconds + 30) * 1e9 / static_cast<double>(times.period_ns));
  return std::make_unique<tools::WakeupLoop>(tools::WakeupSpec{setup.core, setup.real_time ? setup.witness_priority : 0,
                                                               times.period_ns, due_ns + times.deadline_ns / 2, room});
}

/// The newest tick; waits for one.
Tick newest_tick(BenchFlight& flight) {
  const TimeNs give_up = rt::now() + 30 * kSecond;
  for (;;) {
    flight.observer().look();
    if (const Tick* t = flight.observer().newest()) return *t;
    flight.expect_alive();
    if (rt::now() > give_up) throw std::runtime_error("control does not tick");
    rt::sleep_until(rt::now() + 10 * kMillisecond);
  }
}

}  // namespace

PairSetup setup_of(const std::string& load, int index, const scheduling::Config& config) {
  PairSetup s;
  s.load = load;
  s.index = index;
  s.core = rt::nearest_usable_core(config.control_thread.core);
  s.control_priority = config.control_thread.priority;
  s.reference_priority = s.control_priority + (index % 2 == 0 ? 1 : -1);
  s.witness_priority = std::min(98, s.control_priority + 10);
  s.reference_lead_ns = kLead;
  return s;
}

namespace {

/// One half of a pair: the reference beside control until it ends.
std::vector<tools::Wakeup> run_half(PairSetup& setup, BenchFlight& flight, Load& load, DurationNs period_ns,
                                    double seconds, TimeNs grid_ns, const std::function<void()>& tell) {
  Reference reference(setup, period_ns, seconds, grid_ns);
  while (reference.listen()) {
    flight.observer().look();
    flight.expect_alive();
    if (!load.running()) throw std::runtime_error("stress-ng ended early (load " + setup.load + ")");
    if (interrupted()) throw std::runtime_error("interrupted");
    tell();
  }
  return reference.finish();
}

}  // namespace

PairData run_pair(PairSetup setup, const LatencyOptions& options, const scheduling::Config& config,
                  const PairProgress& progress) {
  PairData data;
  data.times = {config.control_period_ns, config.control_deadline_ns, config.control_thread.budget_ns};
  BenchFlight flight(options.seconds, options.config, options.no_rt);
  setup.real_time = flight.real_time();
  Load load(setup.load);
  rt::sleep_until(rt::now() + kSettle);
  flight.observer().forget();
  const TimeNs due = newest_tick(flight).value.due_at_ns;
  const auto witness = start_witness(setup, data.times, options.seconds, due);
  const TimeNs start = rt::now();
  TimeNs told = start;
  const auto tell = [&] {
    if (rt::now() - told < kSecond / 2) return;
    told = rt::now();
    data.foreign.merge(foreign_real_time(setup.core, setup.control_priority));
    const Tick* t = flight.observer().newest();
    progress(to_seconds(told - start), t == nullptr ? 0 : t->value.released_at_ns - t->value.due_at_ns);
  };
  for (const DurationNs lead : {setup.reference_lead_ns, -setup.reference_lead_ns})
    data.reference.push_back(
        run_half(setup, flight, load, data.times.period_ns, options.seconds / 2, due + lead, tell));
  rt::sleep_until(rt::now() + 2 * data.times.period_ns);  // the ticks around the reference's last wake-up
  data.witness = witness->finish();
  flight.observer().hand_over(data);
  data.setup = setup;
  return data;
}

}  // namespace wasp::bench
