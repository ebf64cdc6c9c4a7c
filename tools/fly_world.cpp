#include "tools/fly_world.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <iostream>

#include "shm/topics.h"
#include "tools/record_attachment.h"

namespace wasp::tools {
namespace {

namespace fs = std::filesystem;

constexpr DurationNs kPatience = 60 * kSecond;
constexpr DurationNs kRestartPeriod = kSecond;

std::string log_file(const Run& run) {
  return (run.folder / (on_hardware(run) ? "log/camera.txt" : "log/sim.txt")).string();
}
const char* name_of(const Run& run) { return on_hardware(run) ? "the camera process" : "the simulator"; }

}  // namespace

FlyWorld::FlyWorld(const Run& run) : run_(run) { start(); }

void FlyWorld::start() {
  auto arguments = on_hardware(run_) ? camera_arguments(run_) : sim_arguments(run_);
  std::string log = log_file(run_);
  if (starts_ > 0) {
    arguments.emplace_back("--wait");
    log += "." + std::to_string(starts_);
  }
  process_.emplace(std::move(arguments), log);
  started_at_ns_ = rt::now();
  ++starts_;
}

bool FlyWorld::there() const {
  if (flies_configured_autopilot(run_)) return is_written(shm::camera_region(run_.instance));
  return run_.options.udp_port > 0 || fs::exists(run_.folder / "tty");  // over UDP the simulator speaks first
}

void FlyWorld::wait_until_there(const std::function<bool()>& given_up) {
  while (!there()) {
    if (const auto code = process_->poll()) {
      std::ifstream said(log_file(run_));
      if (on_hardware(run_)) std::cerr << said.rdbuf();
      throw std::runtime_error(
          fmt::format("{} ended with code {} at start; see {}", name_of(run_), *code, log_file(run_)));
    }
    if (rt::now() > started_at_ns_ + kPatience || given_up())
      throw std::runtime_error(fmt::format("{} did not come up", name_of(run_)));
    rt::sleep_until(rt::now() + 10 * kMillisecond);
  }
}

bool FlyWorld::look_after() {
  const auto code = process_->poll();
  if (!code) return true;
  if (!on_hardware(run_)) {
    std::cerr << fmt::format("\n{} ended with code {}\n", name_of(run_), *code);
    return false;
  }
  if (rt::now() < started_at_ns_ + kRestartPeriod) return true;
  std::cerr << fmt::format("\n{} ended with code {}, started again\n", name_of(run_), *code);
  start();
  return true;
}

}  // namespace wasp::tools
