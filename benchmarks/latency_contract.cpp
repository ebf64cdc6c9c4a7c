// `wasp bench latency --contract`: the flight process hovers with every behaviour of the thread table while a preloaded
// allocator counts each call made inside a real-time section, and each real-time thread counts its page faults.
#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <iostream>

#include "benchmarks/child.h"
#include "benchmarks/latency_bench.h"
#include "benchmarks/latency_flight.h"
#include "rt/clock.h"
#include "tools/program_paths.h"
#include "tools/result.h"

namespace wasp::bench {
namespace {

namespace fs = std::filesystem;

struct Outcome {
  PairData data;
  std::string guard;  ///< its report, "" if it never spoke
  bool real_time = false;
  double seconds = 0;
};

Outcome fly_guarded(const LatencyOptions& options, const std::string& library) {
  Outcome o;
  const fs::path report = fs::temp_directory_path() / fmt::format("wasp_guard_{}.txt", getpid());
  setenv("WASP_MALLOC_GUARD_OUT", report.c_str(), 1);
  {
    BenchFlight flight(options.seconds, options.config, options.no_rt, library);
    o.real_time = flight.real_time();
    flight.observer().forget();
    const TimeNs start = rt::now(), end = start + from_seconds(options.seconds);
    for (TimeNs told = 0; rt::now() < end && !interrupted();) {
      flight.expect_alive();
      flight.observer().look();
      if (rt::now() - told > 5 * kSecond) {
        told = rt::now();
        std::cerr << fmt::format("flying guarded, {:.0f} s left\n", to_seconds(end - rt::now()));
      }
      rt::sleep_until(rt::now() + 100 * kMillisecond);
    }
    o.seconds = to_seconds(rt::now() - start);
    flight.land(30);
    flight.observer().hand_over(o.data);
  }
  std::ifstream in(report);
  o.guard.assign(std::istreambuf_iterator<char>(in), {});
  fs::remove(report);
  return o;
}

long long violations_of(const std::string& guard) {
  return guard.starts_with("violations ") ? std::stoll(guard.substr(11)) : -1;
}

}  // namespace

int run_contract(const LatencyOptions& options) {
  const std::string library = tools::program("lib/libwasp_malloc_guard.so");
  if (!fs::exists(library)) {
    std::cerr << "wasp bench latency --contract: " << library
              << " is missing; it is built with the tests: cmake --build build --target wasp_malloc_guard\n";
    return 2;
  }
  const Outcome o = fly_guarded(options, library);
  const long long violations = violations_of(o.guard);
  std::vector<tools::Result> results{
      {"seconds flown with every behaviour", o.seconds, "s", "", true},
      tools::at_most("allocator calls in real-time threads", static_cast<double>(violations), "", 0),
      {"control ticks", static_cast<double>(o.data.run.ticks), "", "", true}};
  results[1].ok = violations == 0;  // -1: the guard never spoke
  for (std::size_t i = 0; i < o.data.cues.size(); ++i)
    results.push_back({"steps of " + o.data.behaviours[i], static_cast<double>(o.data.cues[i].size()), "", ">= 1",
                       !o.data.cues[i].empty()});
  const auto faults = [&](const char* name, std::uint64_t n) {
    auto r = tools::at_most(name, static_cast<double>(n), "", 0);
    return o.real_time ? r : tools::Result{std::string(name) + " (memory not locked: no bar)", r.value, "", "", true};
  };
  results.push_back(faults("minor page faults in real-time threads", o.data.run.minor_faults));
  results.push_back(faults("major page faults in real-time threads", o.data.run.major_faults));
  bool ok = true;
  for (const auto& r : results) {
    ok = ok && r.ok;
    std::cout << fmt::format("{:<4} {:<48} {:>10.0f} {:<2}{}\n",
                             r.bar.empty() ? ""
                             : r.ok        ? "ok"
                                           : "MISS",
                             r.name, r.value, r.unit, r.bar.empty() ? "" : "bar " + r.bar);
  }
  if (violations != 0) std::cout << o.guard;
  if (!options.json.empty()) {
    auto document = nlohmann::json::array();
    for (const auto& r : results) document.push_back(tools::to_json(r));
    std::ofstream(options.json) << document.dump(1) << "\n";
  }
  return ok ? 0 : 1;
}

}  // namespace wasp::bench
