#include "tools/camera_bringup.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "drivers/image_file.h"
#include "rt/clock.h"
#include "tools/camera_capture.h"

namespace wasp::tools {
namespace {

constexpr int kNothingThere = 4;

drivers::CameraRequest request_of(const Intrinsics& size, double rate_hz, const drivers::CameraSettings& settings) {
  return {size.width_px, size.height_px, rate_hz, settings};
}

nlohmann::json camera_json(const drivers::CameraDriverRow& row, const drivers::FoundCamera& camera) {
  return {{"driver", row.name},          {"device", camera.device},   {"name", camera.name},
          {"identity", camera.identity}, {"formats", camera.formats}, {"problem", camera.problem}};
}

void print_camera(const drivers::CameraDriverRow& row, const drivers::FoundCamera& camera) {
  fmt::print("{:<8} {:<24} {}\n", row.name, camera.device, camera.identity);
  for (const auto& format : camera.formats) fmt::print("         {}\n", format);
  if (!camera.problem.empty()) fmt::print("         cannot be used: {}\n", camera.problem);
}

/// One exposure in ordinary memory.
class PictureSink final : public drivers::FrameSink {
 public:
  PictureSink(int width_px, int height_px, bool depth)
      : gray{width_px, height_px, std::vector<std::uint8_t>(count(width_px, height_px))} {
    if (depth) depth_mm = {width_px, height_px, std::vector<std::uint16_t>(count(width_px, height_px))};
  }
  drivers::FrameSlot slot() override {
    return {gray.pixels.data(), depth_mm.pixels.empty() ? nullptr : depth_mm.pixels.data()};
  }
  void announce() override {}
  void publish(const drivers::FrameStamp& s) override { stamp = s; }

  drivers::Image<std::uint8_t> gray;
  drivers::Image<std::uint16_t> depth_mm;
  drivers::FrameStamp stamp;

 private:
  static std::size_t count(int w, int h) { return static_cast<std::size_t>(w) * static_cast<std::size_t>(h); }
};

void save_picture(const PictureSink& sink, const std::filesystem::path& folder, int number) {
  drivers::save_png(folder / fmt::format("gray_{:05}.png", number), sink.gray.view());
  if (!sink.depth_mm.pixels.empty() && sink.stamp.depth)
    drivers::save_png(folder / fmt::format("depth_{:05}.png", number), sink.depth_mm.view());
}

}  // namespace

drivers::CameraRequest front_request(const scheduling::Config& c) {
  return request_of(c.camera.intrinsics, c.camera_rate_hz, c.camera_settings);
}

drivers::CameraRequest down_request(const scheduling::Config& c) {
  return request_of(c.camera_down.geometry.intrinsics, c.camera_down.rate_hz, c.camera_down.settings);
}

int list_cameras(bool json) {
  nlohmann::json all = nlohmann::json::array();
  for (const auto& row : drivers::camera_drivers()) {
    const auto cameras = row.list();
    for (const auto& camera : cameras) {
      all.push_back(camera_json(row, camera));
      if (!json) print_camera(row, camera);
    }
    if (!json && cameras.empty()) fmt::print("{:<8} none ({})\n", row.name, row.what);
  }
  if (json) fmt::print("{}\n", all.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  return all.empty() ? kNothingThere : 0;
}

int save_pictures(const CameraOptions& options, const scheduling::Config& config) {
  const auto& row = drivers::camera_driver(config.camera_driver);
  const drivers::CameraRequest request = front_request(config);
  const auto driver = row.make(request);
  const drivers::CameraFormat format = driver->open();
  check_promise(format, request, false);
  fmt::print("{} {}: {}, {} x {} {}, {}\n", row.name, format.node, format.identity, format.width_px, format.height_px,
             format.pixels, format.settings);
  std::filesystem::create_directories(options.save);
  PictureSink sink(request.width_px, request.height_px, row.depth);
  driver->start(sink);
  int saved = 0, bad = 0;
  for (const TimeNs limit = rt::now() + 30 * kSecond; saved < options.frames && rt::now() < limit + saved * kSecond;) {
    const drivers::FrameEvent event = driver->wait_frame(rt::now() + kSecond);
    if (event == drivers::FrameEvent::kGone) throw drivers::CameraError(format.node, "went while it was looked at");
    if (event == drivers::FrameEvent::kFrame)
      save_picture(sink, options.save, saved++);
    else
      ++bad;
  }
  fmt::print("{} pictures in {}; {} damaged or late\n", saved, options.save.string(), bad);
  return saved == options.frames ? 0 : 1;
}

}  // namespace wasp::tools
