// A flight in the simulator for a benchmark: starts simulator and flight process, waits until it hovers, ends both and
// takes everything away again.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "benchmarks/latency_observer.h"
#include "tools/child_process.h"
#include "tools/fly_run.h"

namespace wasp::bench {

class BenchFlight {
 public:
  /// `seconds` it must be able to hover. `preload`: a library the flight process is started with, "" for none.
  /// Throws std::runtime_error if it does not come to hover, with the flight's own words.
  BenchFlight(double seconds, const std::string& config, bool no_rt, const std::string& preload = {});
  ~BenchFlight();
  BenchFlight(const BenchFlight&) = delete;
  BenchFlight& operator=(const BenchFlight&) = delete;

  [[nodiscard]] bool real_time() const { return run_.real_time; }
  FlightObserver& observer() { return observer_; }
  /// Throws if flight or simulator have ended.
  void expect_alive();
  /// Asks it to land and waits for the end; exit code of the flight process.
  int land(double patience_s);

 private:
  void start(const std::string& preload);
  void wait_until_hovering();
  [[nodiscard]] std::string last_words() const;

  std::filesystem::path folder_;
  tools::Run run_;
  FlightObserver observer_;
  std::unique_ptr<tools::ChildProcess> sim_, flight_;
};

}  // namespace wasp::bench
