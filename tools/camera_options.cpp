#include "tools/camera_options.h"

#include <CLI/CLI.hpp>

#include "tools/flight_config.h"

namespace wasp::tools {

std::optional<int> parse_camera_options(int argc, char** argv, CameraOptions& o) {
  CLI::App app{
      "Reads a real camera ([camera] driver = v4l2 | dc1394 | kinect) into the shared memory of an instance, where\n"
      "`wasp flight` finds it as it finds the simulator's; with [camera_down] driver a second one. `wasp fly` starts\n"
      "it. Survives unplugging. Exit code 0: ended in order; 1: the camera cannot be used, and why; 2: bad arguments."};
  app.name("wasp camera");
  app.add_option("--instance", o.instance, "name of the shared memory region: wasp.NAME.camera")->capture_default_str();
  app.add_option("--config", o.configs, "TOML files in order, the same as of the flight")->check(CLI::ExistingFile);
  app.add_option("--driver", o.driver, "in the place of [camera] driver");
  app.add_option("--device", o.device, "likewise: path, or part of what --list shows");
  app.add_option("--pixel-format", o.pixel_format, "likewise: one of those that --list shows");
  app.add_option("--width", o.width_px, "likewise [px]")->check(CLI::Range(16, 8192));
  app.add_option("--height", o.height_px, "likewise [px]")->check(CLI::Range(16, 8192));
  app.add_option("--rate", o.rate_hz, "likewise [Hz]")->check(CLI::Range(1.0, 1000.0));
  app.add_option("--exposure-us", o.exposure_us, "likewise; 0: automatic")->check(CLI::Range(0.0, 1e6));
  app.add_option("--gain", o.gain, "likewise; -1: automatic")->check(CLI::Range(-1.0, 1e6));
  auto* list = app.add_flag("--list", o.list, "show the cameras that are plugged in, by every driver, and end");
  app.add_option("--save", o.save, "write pictures as PNG into this folder and end: no shared memory, no real time")
      ->excludes(list);
  app.add_option("--frames", o.frames, "how many pictures --save takes")->check(CLI::Range(1, 100000));
  app.add_flag("--stats", o.stats, "show rate and counts every second, jitter and latency at the end");
  app.add_option("--seconds", o.seconds, "end after this time; 0: run until SIGINT or SIGTERM")
      ->check(CLI::NonNegativeNumber);
  app.add_flag("--json", o.json, "--list and the figures at the end as one JSON object");
  app.add_flag("--wait", o.wait, "a camera that is not there yet is waited for, as after a loss, instead of refused");
  app.add_flag("--no-rt", o.no_rt, "do not ask for SCHED_FIFO and locked memory");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  return std::nullopt;
}

scheduling::Config camera_config(const CameraOptions& o) {
  scheduling::Config config = read_flight_config(o.configs);
  drivers::CameraSettings& settings = config.camera_settings;
  const auto take = [](const auto& from, auto& to) {
    if (from) to = *from;
  };
  take(o.driver, config.camera_driver);
  take(o.device, settings.device);
  take(o.pixel_format, settings.pixel_format);
  take(o.width_px, config.camera.intrinsics.width_px);
  take(o.height_px, config.camera.intrinsics.height_px);
  take(o.rate_hz, config.camera_rate_hz);
  take(o.exposure_us, settings.exposure_us);
  take(o.gain, settings.gain);
  return config;
}

}  // namespace wasp::tools
