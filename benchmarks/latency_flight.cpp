#include "benchmarks/latency_flight.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "benchmarks/child.h"
#include "control/mission.h"
#include "rt/clock.h"
#include "shm/topics.h"

namespace wasp::bench {
namespace {

namespace fs = std::filesystem;

constexpr DurationNs kPatience = 90 * kSecond;
constexpr double kReserve_s = 300;  // hovers on while loads settle and references start

fs::path make_folder() {
  std::string pattern = (fs::temp_directory_path() / "wasp_bench_XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("cannot make a folder like " + pattern);
  return pattern;
}

tools::FlyOptions fly_options(const fs::path& folder, double seconds, const std::string& config, bool no_rt) {
  tools::FlyOptions o;
  o.out = folder;
  o.name = fmt::format("bench-{}-{}", getpid(), rt::now() / kMillisecond);
  o.config = config;
  o.seconds = seconds + kReserve_s;
  o.no_rt = no_rt;
  return o;
}

}  // namespace

BenchFlight::BenchFlight(double seconds, const std::string& config, bool no_rt, const std::string& preload)
    : folder_(make_folder()),
      run_(tools::plan_run(fly_options(folder_, seconds, config, no_rt))),
      observer_(run_.instance) {
  try {
    tools::check_rights(run_);
    tools::write_configuration(run_);
    start(preload);
    wait_until_hovering();
  } catch (const std::exception& e) {
    const std::string why = e.what() + last_words();
    land(0.5);
    fs::remove_all(folder_);
    throw std::runtime_error(why);
  }
}

BenchFlight::~BenchFlight() {
  land(2.0);
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

void BenchFlight::start(const std::string& preload) {
  sim_ = std::make_unique<tools::ChildProcess>(tools::sim_arguments(run_), (run_.folder / "log/sim.txt").string());
  const TimeNs give_up = rt::now() + kPatience;
  while (!fs::exists(run_.folder / "tty")) {
    if (sim_->poll() || rt::now() > give_up || interrupted()) throw std::runtime_error("the simulator did not come up");
    rt::sleep_until(rt::now() + 10 * kMillisecond);
  }
  if (!preload.empty()) setenv("LD_PRELOAD", preload.c_str(), 1);
  flight_ =
      std::make_unique<tools::ChildProcess>(tools::flight_arguments(run_), (run_.folder / "log/flight.txt").string());
  unsetenv("LD_PRELOAD");
}

void BenchFlight::wait_until_hovering() {
  const TimeNs give_up = rt::now() + kPatience;
  for (;;) {
    observer_.look();
    const Tick* t = observer_.newest();
    if (t != nullptr && control::leg_of(static_cast<control::MissionPhase>(t->value.mission_phase)) >= 0) return;
    expect_alive();
    if (interrupted()) throw std::runtime_error("interrupted");
    if (rt::now() > give_up) throw std::runtime_error("the flight did not come to hover");
    rt::sleep_until(rt::now() + 50 * kMillisecond);
  }
}

void BenchFlight::expect_alive() {
  if (flight_ && flight_->poll()) throw std::runtime_error("the flight process ended early");
  if (sim_ && sim_->poll()) throw std::runtime_error("the simulator ended early");
}

std::string BenchFlight::last_words() const {
  std::string words;
  for (const char* log : {"log/flight.txt", "log/sim.txt"}) {
    std::ifstream in(run_.folder / log);
    words.append("\n").append(std::istreambuf_iterator<char>(in), {});
  }
  return words;
}

int BenchFlight::land(double patience_s) {
  int code = 1;
  if (flight_) {
    const TimeNs give_up = rt::now() + from_seconds(patience_s);
    flight_->signal(SIGINT);  // land in order; the second one stops at once
    while (!flight_->poll() && rt::now() < give_up) rt::sleep_until(rt::now() + 10 * kMillisecond);
    code = flight_->end(SIGINT, 5.0);
  }
  if (sim_) sim_->end(SIGTERM, 5.0);
  for (const auto& region :
       {shm::flight_region(run_.instance), shm::camera_region(run_.instance), shm::truth_region(run_.instance)})
    shm::Region::remove(region);
  flight_.reset();
  sim_.reset();
  return code;
}

}  // namespace wasp::bench
