// The whole loop with a camera that only follows: one simulator is the vehicle and its autopilot, another the camera,
// which knows of the vehicle what the autopilot tells at its second port; the flight sees nothing else. Small pictures,
// for the host may be slow; no bound on accuracy here but that the ground was found where it is.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <fstream>
#include <thread>

#include "rt/clock.h"
#include "shm/broadcast_ring.h"
#include "shm/topics.h"
#include "tests/tools/program.h"
#include "types/messages.h"

namespace wasp::test {
namespace {

constexpr const char* kCamera =
    "[camera]\nwidth_px = 160\nheight_px = 120\nfx_px = 131.25\nfy_px = 131.25\ncx_px = 79.5\ncy_px = 59.5\n";

struct Hover {
  bool flown = false;
  double rms_m = 0, worst_m = 0;
  int samples = 0;
};

/// A hover at 0.6 m; the truth's camera height against it while the mission holds it.
Hover fly(const TemporaryFolder& out, int attempt) {
  const std::string vehicle = "vehicle-" + std::to_string(getpid()), eye = "eye-" + std::to_string(getpid());
  const std::string first = (out.path / ("a" + std::to_string(attempt))).string(), second = first + "2";
  const std::string sim_toml = first + ".sim.toml", flight_toml = first + ".flight.toml";
  std::ofstream(sim_toml) << kCamera;
  std::ofstream(flight_toml)
      << kCamera << "[run]\nenforce_real_time = false\nadmission = \"off\"\n[autopilot]\nendpoint = \"serial:" << first
      << ":921600\"\n[mission]\nheights_m = [0.6]\nseconds = [12.0]\n"
      << "[behaviour.edge_altitude]\nenabled = false\n";
  Program a(
      {program_path("wasp-sim"), "--instance", vehicle, "--no-camera", "--tty-link", first, "--second-link", second});
  Hover hover;
  if (!eventually([&] { return std::filesystem::exists(second); })) return hover;
  Program b(
      {program_path("wasp-sim"), "--instance", eye, "--config", sim_toml, "--follow", "serial:" + second + ":921600"});
  Program flight({program_path("wasp"), "flight", "--instance", eye, "--config", flight_toml, "--no-rt"});
  const auto truth_region = shm::Region::attach_with_bells(shm::truth_region(vehicle));
  shm::RingReader truth(truth_region, shm::kTruth, "Truth");
  std::vector<Truth> all;
  std::atomic<bool> over{false};
  std::thread watch([&] {
    while (!over) {
      truth.wait(rt::now() + 100 * kMillisecond);
      for (Truth t; truth.read(t);) all.push_back(t);
    }
  });
  const int code = flight.wait();
  over = true;
  watch.join();
  hover.flown = code == 0;
  double squares = 0;
  for (const Truth& t : all) {  // from 5 s after take-off until the landing begins
    if (t.flight_time_s < 6 || t.flight_time_s > 11 || t.armed == 0) continue;
    const double error = static_cast<double>(t.height_m) - 0.6;
    squares += error * error;
    hover.worst_m = std::max(hover.worst_m, std::abs(error));
    ++hover.samples;
  }
  hover.rms_m = hover.samples > 0 ? std::sqrt(squares / hover.samples) : 1;
  return hover;
}

TEST(FollowProgram, AFlightHoversByTheEyesOfACameraThatFollowsItsAutopilot) {
  TemporaryFolder out;
  Hover hover;
  for (int attempt = 0; attempt < 3 && !hover.flown; ++attempt) hover = fly(out, attempt);
  ASSERT_TRUE(hover.flown);
  std::printf("hover at 0.6 m by a camera that follows: RMS %.1f cm, worst %.1f cm, %d samples\n", 100 * hover.rms_m,
              100 * hover.worst_m, hover.samples);
  ASSERT_GT(hover.samples, 100);
  EXPECT_LT(hover.rms_m, 0.15);
}

}  // namespace
}  // namespace wasp::test
