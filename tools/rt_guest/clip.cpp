#include "tools/rt_guest/clip.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <stdexcept>

#include "drivers/image_file.h"
#include "sim/sim_camera.h"

namespace wasp::tools::rt_guest {
namespace {

namespace fs = std::filesystem;

constexpr int kFrames = 30;
constexpr double kRate_hz = 30.0;
constexpr double kHeight_m = 1.0, kSway_m = 0.03;

/// Up and down once a clip, level.
sim::BodyPose pose_of(int frame) {
  const double turn = 2.0 * std::numbers::pi * frame / kFrames;
  sim::BodyPose pose;
  pose.position_ned_m = Vec3(0.f, 0.f, static_cast<float>(-kHeight_m - kSway_m * std::sin(turn)));
  return pose;
}

void write_file(const fs::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

std::string camera_toml(const sim::SimConfig& config) {
  const Intrinsics& k = config.camera.intrinsics;
  return fmt::format("width_px = {}\nheight_px = {}\nfx_px = {}\nfy_px = {}\ncx_px = {}\ncy_px = {}\n", k.width_px,
                     k.height_px, k.fx_px, k.fy_px, k.cx_px, k.cy_px) +
         "pitch_down_deg = 30.0\ndepth_units_per_m = 1000\nposition_body_m = [0.05, 0.0, 0.0]\n";
}

}  // namespace

void make_clip(const fs::path& folder) {
  const sim::SimConfig config;
  sim::SimCamera camera(config);
  const int width = camera.width_px(), height = camera.height_px();
  drivers::Image<std::uint8_t> gray{width, height, {}};
  drivers::Image<std::uint16_t> depth{width, height, {}};
  gray.pixels.resize(static_cast<std::size_t>(width * height));
  depth.pixels.resize(gray.pixels.size());
  fs::create_directories(folder / "depth");
  fs::create_directories(folder / "rgb");
  std::string depth_list, gray_list;
  for (int i = 0; i < kFrames; ++i) {
    camera.render(pose_of(i), static_cast<std::uint32_t>(i), gray.pixels.data(), depth.pixels.data());
    const std::string name = fmt::format("{:04}.png", i);
    drivers::save_png(folder / "depth" / name, depth.view());
    drivers::save_png(folder / "rgb" / name, gray.view());
    depth_list += fmt::format("{:.6f} depth/{}\n", i / kRate_hz, name);
    gray_list += fmt::format("{:.6f} rgb/{}\n", i / kRate_hz, name);
  }
  write_file(folder / "depth.txt", depth_list);
  write_file(folder / "rgb.txt", gray_list);
  write_file(folder / "camera.toml", camera_toml(config));
}

}  // namespace wasp::tools::rt_guest
