// wasp-camera: real cameras into shared memory. It reads the configuration of the flight and writes the region that
// wasp-sim writes in a simulation, so the flight cannot tell them apart.
#include <fmt/format.h>

#include <array>
#include <atomic>
#include <csignal>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "rt/clock.h"
#include "rt/thread.h"
#include "scheduling/arming.h"
#include "shm/topics.h"
#include "sim/owned_region.h"
#include "tools/camera_bringup.h"
#include "tools/camera_capture.h"
#include "tools/camera_figures.h"
#include "tools/camera_options.h"

namespace {

using namespace wasp;
using namespace wasp::tools;

void log(const std::string& line) {
  fmt::print(stderr, "wasp-camera: {}\n", line);
  std::fflush(stderr);
}

/// One camera of the configuration.
struct Plan {
  std::string name;
  const drivers::CameraDriverRow* row;
  drivers::CameraRequest request;
  CameraTopics topics;
};

std::vector<Plan> plan_cameras(const scheduling::Config& c) {
  if (!scheduling::is_device(c.camera_driver))
    throw std::runtime_error("[camera] driver = \"" + c.camera_driver +
                             "\" is no real camera; say v4l2, dc1394 or kinect, here or with --driver");
  const auto& row = drivers::camera_driver(c.camera_driver);
  std::vector<Plan> plans{{"camera", &row, front_request(c), front_topics(row.depth)}};
  if (!c.camera_down.enabled) return plans;
  if (!scheduling::is_device(c.camera_down.driver))
    throw std::runtime_error("[camera_down] is enabled beside a real [camera], but its driver is \"" +
                             c.camera_down.driver + "\"; say v4l2, dc1394 or kinect, or enabled = false");
  plans.push_back({"camera.down", &drivers::camera_driver(c.camera_down.driver), down_request(c), down_topics()});
  return plans;
}

sim::OwnedRegion make_region(const std::string& instance, const std::vector<Plan>& plans, bool real_time) {
  std::vector<shm::TopicSpec> specs;
  for (const auto& plan : plans)
    for (auto& spec : plan.topics.specs(plan.request.width_px, plan.request.height_px)) specs.push_back(spec);
  return {shm::camera_region(instance), specs, real_time ? "real camera" : "real camera, NOT REAL TIME"};
}

/// One camera while it runs.
struct Eye {
  Eye(const Plan& plan, const shm::Region& region)
      : topic(plan.topics.status),
        rings(region, plan.topics, plan.request.width_px, plan.request.height_px),
        capture(plan.name, *plan.row, plan.request, rings, events) {}

  void open(const CameraOptions& options) {
    rings.status().real_time = options.no_rt ? 0 : 1;
    try {
      open();
    } catch (const drivers::CameraError& error) {
      if (!options.wait) throw;
      log(fmt::format("{}; waiting for it", error.what()));
      capture.wait_for_it();
    }
  }
  void open() {
    const drivers::CameraFormat f = capture.open();
    log(fmt::format("{}: {} at {}, {} x {} {}, {}", topic, f.identity, f.node, f.width_px, f.height_px, f.pixels,
                    f.settings));
  }
  [[nodiscard]] CameraFigures figures() { return figures_of(topic, rings.status()); }

  std::string topic;
  scheduling::EventQueue events;
  CameraRings rings;
  CameraCapture capture;
  rt::Thread thread;  // joined first
};

class CameraProcess {
 public:
  CameraProcess(const CameraOptions& options, const scheduling::Config& config)
      : options_(options),
        config_(config),
        plans_(plan_cameras(config)),
        region_(make_region(options.instance, plans_, !options.no_rt)) {}
  ~CameraProcess() { stop_ = true; }

  void run(const sigset_t& signals) {
    for (const auto& plan : plans_) eyes_.push_back(std::make_unique<Eye>(plan, region_.region));
    for (auto& eye : eyes_) eye->open(options_);
    latency_hold_ = options_.no_rt ? nullptr : scheduling::prepare_real_time(config_, true, log);
    for (auto& eye : eyes_) start(*eye);
    supervise(signals);
    stop_ = true;
    for (auto& eye : eyes_) eye->thread.join();
    say_events();
    report();
  }

 private:
  void start(Eye& eye) {
    const scheduling::ThreadRow& row = config_.camera_thread;
    rt::ThreadSpec spec{.name = eye.topic, .core = row.core < 0 ? -1 : rt::nearest_usable_core(row.core)};
    if (!options_.no_rt) spec.policy = rt::Policy::kFifo, spec.priority = row.priority;
    eye.thread = rt::Thread(spec, [this, &eye] { eye.capture.run(stop_); });
  }

  void supervise(const sigset_t& signals) {
    const TimeNs end_ns = options_.seconds > 0 ? rt::now() + from_seconds(options_.seconds) : kForever;
    for (TimeNs next_figures_ns = rt::now() + kSecond; rt::now() < end_ns;) {
      const timespec look = rt::to_timespec(std::min<DurationNs>(100 * kMillisecond, end_ns - rt::now()));
      if (sigtimedwait(&signals, nullptr, &look) > 0) return;
      say_events();
      if (!options_.stats || rt::now() < next_figures_ns) continue;
      next_figures_ns += kSecond;
      for (auto& eye : eyes_) log(counts_text(eye->figures()) + "; " + times_text(eye->figures()));
    }
  }

  void say_events() {
    scheduling::Event event;
    for (auto& eye : eyes_)
      while (eye->events.take(event)) log(event.text.data());
  }

  void report() {
    nlohmann::json all = nlohmann::json::array();
    for (auto& eye : eyes_) {
      const CameraFigures figures = eye->figures();
      all.push_back(to_json(figures));
      log(counts_text(figures));
      log(eye->topic + " " + times_text(figures));
      if (!eye->capture.account().empty()) log(eye->topic + " " + eye->capture.account());
    }
    if (options_.json) fmt::print("{}\n", all.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  }

  const CameraOptions& options_;
  const scheduling::Config& config_;
  std::vector<Plan> plans_;
  sim::OwnedRegion region_;
  std::unique_ptr<rt::CpuLatencyHold> latency_hold_;
  std::atomic<bool> stop_{false};
  std::vector<std::unique_ptr<Eye>> eyes_;
};

}  // namespace

int main(int argc, char** argv) {
  CameraOptions options;
  if (const auto code = parse_camera_options(argc, argv, options)) return *code;
  sigset_t signals;  // taken by the main thread only
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  try {
    if (options.list) return list_cameras(options.json);
    const scheduling::Config config = camera_config(options);
    if (!options.save.empty()) return save_pictures(options, config);
    CameraProcess(options, config).run(signals);
  } catch (const std::exception& error) {
    fmt::print(stderr, "wasp-camera: {}\n", error.what());
    return 1;
  }
  return 0;
}
