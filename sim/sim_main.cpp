// wasp-sim: hardware that is not there. A flight controller on a pseudo-terminal and a Kinect in shared memory, driven
// by a simulated quadrotor in a simulated laboratory. The flying process cannot tell it from the vehicle.
#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "rt/thread.h"
#include "shm/region.h"
#include "shm/topics.h"
#include "sim/camera_part.h"
#include "sim/owned_region.h"
#include "sim/pose_feed.h"
#include "sim/pty.h"
#include "sim/truth_feed.h"
#include "sim/udp_line.h"
#include "sim/vehicle_loop.h"

namespace {

using namespace wasp;
using namespace wasp::sim;

struct Options {
  std::string instance = "wasp", tty_link, second_link, udp, config_path, world_kind, world_file, autopilot;
  std::vector<std::string> parameters;
  std::optional<std::uint32_t> seed;
  std::optional<double> rate_hz;
  bool no_camera = false, camera_only = false, no_safety_pilot = false;
  double seconds = 0;
  std::string follow;
  PoseLinkParams follow_link{.rate_hz = 0};
  double follow_delay_ms = 0;
  bool follow_heading = false;
  std::vector<float> follow_origin;
};

void declare_follow(CLI::App& app, Options& o) {
  auto* follow = app.add_option(
      "--follow", o.follow,
      "the camera alone, looking from the vehicle of another autopilot (a real one, ArduPilot's or PX4's simulator): "
      "an endpoint where it speaks MAVLink (serial:DEVICE:BAUD, udp://OWN:PORT, udpout://HOST:PORT, tcp://HOST:PORT), "
      "or `flight`, which takes its pose from the flight of the same instance. Each frame is drawn when the poses "
      "on both sides of its exposure are known, never ahead of them");
  app.add_option("--follow-system", o.follow_link.system_id, "system id of the autopilot")->capture_default_str();
  app.add_option("--follow-component", o.follow_link.component_id, "our component id there")->capture_default_str();
  app.add_option("--follow-rate", o.follow_link.rate_hz,
                 "attitudes and positions asked for [Hz]; without it 50 on a serial line, 100 on a socket")
      ->check(CLI::Range(4.0, 200.0));
  app.add_option("--follow-delay-ms", o.follow_delay_ms,
                 "draw so long after the exposure; 0: as the poses come, and 3 ms")
      ->check(CLI::Range(0.0, 700.0))
      ->capture_default_str();
  app.add_flag("--follow-heading", o.follow_heading,
               "keep the autopilot's heading; without it what it faces before arming is the world's north");
  app.add_option("--follow-origin", o.follow_origin,
                 "north east down [m] in the autopilot's local frame of the point on the ground that is the world's "
                 "start; without it, where it is armed")
      ->expected(3);
  for (const char* other : {"--no-camera", "--camera-only", "--tty-link", "--second-link"}) follow->excludes(other);
}

void declare(CLI::App& app, Options& o) {
  app.add_option("--instance", o.instance, "name of the shared memory regions: wasp.NAME.camera, wasp.NAME.truth")
      ->capture_default_str();
  app.add_option("--tty-link", o.tty_link, "symbolic link to make to the autopilot's serial line");
  app.add_option("--udp", o.udp,
                 "in place of a serial line: speak from a port of its own to HOST:PORT, where the companion listens "
                 "(udp://HOST:PORT there)")
      ->excludes("--tty-link");
  app.add_option("--autopilot", o.autopilot, "whose autopilot to behave as (default: autopilot.flavour)")
      ->check(CLI::IsMember({"wasp", "px4", "ardupilot"}));
  app.add_option("--param", o.parameters, "NAME=VALUE: a parameter of the autopilot (px4, ardupilot); may be repeated");
  app.add_option("--second-link", o.second_link,
                 "symbolic link to make to a second serial port of the autopilot, which sends what it is asked for");
  app.add_option("--config", o.config_path, "TOML file; see share/wasp/config/sim.toml for every key");
  app.add_option("--world", o.world_file, "VRML97 file to fly in (`wasp world make`); default: world.kind")
      ->check(CLI::ExistingFile);
  app.add_option("--world-kind", o.world_kind,
                 "generated world to fly in, see `wasp world list` (default: world.kind of the configuration)")
      ->excludes("--world");
  app.add_option("--seed", o.seed, "seed of world, sensors and vehicle (default: run.seed of the configuration)");
  app.add_option("--rate-hz", o.rate_hz, "camera rate (default: camera.rate_hz of the configuration)")
      ->check(CLI::Range(1.0, 120.0));
  auto* no_camera = app.add_flag("--no-camera", o.no_camera, "autopilot and truth only");
  app.add_flag(
         "--camera-only", o.camera_only,
         "the camera alone, looking from the vehicle of another wasp-sim --no-camera of the same instance; killed "
         "and started again it goes on in the same region")
      ->excludes(no_camera);
  app.add_flag(
      "--no-safety-pilot", o.no_safety_pilot,
      "do not hold the vehicle over its place: without this flag a small slow trim (at most 3 degrees, from the "
      "true position) is added to roll and pitch, as the supervising pilot of the thesis' flights would");
  app.add_option("--seconds", o.seconds, "end after this time; 0: run until SIGINT or SIGTERM")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  declare_follow(app, o);
}

SimConfig settings(const Options& o) {
  SimConfig config = o.config_path.empty() ? SimConfig{} : load_sim_config(o.config_path);
  config.world_file = o.world_file;
  if (!o.world_kind.empty()) config.world_kind = o.world_kind;
  if (find_scene_kind(config.world_kind) == nullptr)
    throw std::runtime_error("--world-kind " + config.world_kind + ": known are " + scene_kind_names());
  if (o.seed) config.seed = *o.seed;
  if (o.rate_hz) config.camera_rate_hz = *o.rate_hz;
  if (o.no_safety_pilot) config.safety_pilot = false;
  for (std::size_t i = 0; i < drivers::kFlavours.size(); ++i)
    if (drivers::kFlavours[i].name == o.autopilot) config.flavour = static_cast<Flavour>(i);
  config.autopilot_parameters = o.parameters;
  return config;
}

/// SCHED_FIFO where that is allowed, else an ordinary thread on the same core.
rt::Thread start_vehicle(std::function<void()> body) {
  const int core = rt::nearest_usable_core(0);
  try {
    return rt::Thread({.name = "vehicle", .policy = rt::Policy::kFifo, .priority = 20, .core = core}, body);
  } catch (const std::system_error&) {
    std::fprintf(stderr, "wasp-sim: no right to SCHED_FIFO, the vehicle runs as an ordinary thread\n");
    return rt::Thread({.name = "vehicle", .core = core}, body);
  }
}

void wait_for_end(const sigset_t& signals, double seconds) {
  if (seconds <= 0) {
    int signal = 0;
    sigwait(&signals, &signal);
    return;
  }
  const TimeNs end_ns = rt::now() + from_seconds(seconds);
  for (TimeNs now = rt::now(); now < end_ns; now = rt::now()) {
    const timespec left = rt::to_timespec(end_ns - now);
    if (sigtimedwait(&signals, nullptr, &left) > 0) return;
  }
}

/// The camera as a process of its own.
void run_camera(const Options& options, const sigset_t& signals) {
  CameraPart camera(settings(options), options.instance);
  TruthFeed feed(options.instance, 60);
  auto poses = std::make_unique<PoseQueue>();
  std::atomic<bool> stop{false};
  rt::Thread feed_thread({.name = "truth", .core = rt::nearest_usable_core(0)}, [&] { feed.run(*poses, stop); });
  camera.start(rt::now() + 10 * kMillisecond, *poses, stop);
  std::printf("wasp-sim: instance %s, camera only\n", options.instance.c_str());
  std::fflush(stdout);
  wait_for_end(signals, options.seconds);
  stop.store(true);
  camera.join();
  feed_thread.join();
  std::printf("wasp-sim: %s\n", camera.summary().c_str());
}

std::unique_ptr<CompanionLine> open_line(const Options& options) {
  if (!options.udp.empty()) return std::make_unique<UdpLine>(options.udp);
  return std::make_unique<Pty>(options.tty_link);
}

FollowParams follow_params(const Options& o, const SimConfig& config) {
  FollowParams params;
  params.delay_ns = from_seconds(o.follow_delay_ms * 1e-3);
  params.placement.standing_m = static_cast<float>(config.vehicle.leg_m);
  params.placement.keep_heading = o.follow_heading;
  if (o.follow_origin.size() == 3)
    params.placement.origin_ned_m = Vec3(o.follow_origin[0], o.follow_origin[1], o.follow_origin[2]);
  return params;
}

void print_texts(FollowedPose& pose) {
  for (const auto& text : pose.take_texts()) std::printf("wasp-sim: %s\n", text.c_str());
  std::fflush(stdout);
}

/// The camera of a vehicle that somebody else flies.
void run_follow(const Options& options, const sigset_t& signals) {
  const SimConfig config = settings(options);
  FollowedPose pose(follow_params(options, config));
  PoseLinkParams link = options.follow_link;
  if (link.rate_hz <= 0) link.rate_hz = options.follow.starts_with("serial:") ? 50 : 100;
  const auto feed = make_pose_feed(options.follow, options.instance, link, pose);
  CameraPart camera(config, options.instance);
  std::atomic<bool> stop{false};
  rt::Thread feed_thread({.name = "follow", .core = rt::nearest_usable_core(0)}, [&] { feed->run(stop); });
  camera.start(rt::now() + 10 * kMillisecond, pose, stop);
  std::printf("wasp-sim: instance %s, camera only, following %s\n", options.instance.c_str(), options.follow.c_str());
  const TimeNs end_ns = options.seconds > 0 ? rt::now() + from_seconds(options.seconds) : INT64_MAX;
  while (rt::now() < end_ns) {
    print_texts(pose);
    const timespec turn = rt::to_timespec(100 * kMillisecond);
    if (sigtimedwait(&signals, nullptr, &turn) > 0) break;
  }
  stop.store(true);
  camera.join();
  feed_thread.join();
  print_texts(pose);
  std::printf("wasp-sim: %s\n", camera.summary().c_str());
}

void run(const Options& options, const sigset_t& signals) {
  const SimConfig config = settings(options);
  std::optional<CameraPart> camera;
  if (!options.no_camera) camera.emplace(config, options.instance);
  const shm::TopicSpec truth_topic{shm::kTruth, "Truth", shm::TopicKind::kRing, shm::kTruthSlots, sizeof(Truth)};
  const OwnedRegion truth(shm::truth_region(options.instance), {&truth_topic, 1});
  const std::unique_ptr<CompanionLine> line = open_line(options);
  std::optional<Pty> second;
  if (!options.second_link.empty()) second.emplace(options.second_link);

  const TimeNs start_ns = rt::now() + 10 * kMillisecond;
  auto poses = std::make_unique<PoseQueue>();
  VehicleLoop vehicle_loop(config, start_ns, *line, truth.region, *poses, second ? &*second : nullptr);
  std::atomic<bool> stop{false};
  rt::Thread vehicle_thread = start_vehicle([&] { vehicle_loop.run(stop); });
  if (camera) camera->start(start_ns, *poses, stop);
  std::printf("wasp-sim: instance %s, autopilot on %s\n", options.instance.c_str(),
              options.udp.empty() ? options.tty_link.c_str() : options.udp.c_str());
  std::fflush(stdout);
  wait_for_end(signals, options.seconds);
  stop.store(true);
  if (camera) camera->join();
  vehicle_thread.join();
  std::printf("wasp-sim: %llu late ticks%s\n", static_cast<unsigned long long>(vehicle_loop.late_ticks()),
              camera ? (", " + camera->summary()).c_str() : "");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "wasp-sim: a simulated quadrotor with autopilot (MAVLink on a pseudo-terminal) and Kinect (shared memory)"};
  Options options;
  declare(app, options);
  CLI11_PARSE(app, argc, argv);
  sigset_t signals;  // taken by sigwait in the main thread only
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  try {
    if (!options.follow.empty()) {
      run_follow(options, signals);
    } else if (options.camera_only) {
      run_camera(options, signals);
    } else {
      if (options.tty_link.empty() && options.udp.empty()) throw std::runtime_error("--tty-link or --udp is required");
      run(options, signals);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "wasp-sim: %s\n", error.what());
    return 1;
  }
  return 0;
}
