// wasp-world: makes the simulated worlds as VRML97 files, says what is in one, draws what a camera would see in it.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "drivers/image_file.h"
#include "sim/renderer.h"
#include "sim/vrml_file.h"
#include "types/units.h"

namespace {

using namespace wasp;
using namespace wasp::sim;
namespace fs = std::filesystem;

struct View {
  std::vector<float> eye{0, 0, 1.2f};  ///< north, east, up from the start
  double yaw_deg = 0, pitch_down_deg = 0;
  int width_px = 640, height_px = 480;
  double field_of_view_deg = 75;
  double at_s = 0;  ///< after the vehicle first left the ground
};

/// Grey picture seen from the start (heading 0) or wherever `view` says.
drivers::Image<std::uint8_t> draw(const Scene& scene, const View& view) {
  Intrinsics k{.width_px = view.width_px, .height_px = view.height_px};
  const double half_rad = to_radians(Degrees{view.field_of_view_deg / 2}).value;
  k.fx_px = k.fy_px = static_cast<float>(0.5 * view.width_px / std::tan(half_rad));
  k.cx_px = 0.5f * static_cast<float>(view.width_px - 1), k.cy_px = 0.5f * static_cast<float>(view.height_px - 1);
  const Renderer renderer(placed_at_start(scene), k);
  const Mat3 R_yaw =
      Eigen::AngleAxisf(static_cast<float>(to_radians(Degrees{view.yaw_deg}).value), Vec3::UnitZ()).toRotationMatrix();
  const CameraPose pose{Vec3(view.eye[0], view.eye[1], -view.eye[2]),
                        R_yaw * R_body_cam_from_pitch_down(to_radians(Degrees{view.pitch_down_deg}))};
  const WorldScene::Moment moment = renderer.scene().at(view.at_s);
  drivers::Image<std::uint8_t> image{view.width_px, view.height_px, {}};
  std::vector<float> luminance(static_cast<std::size_t>(view.width_px) * Renderer::kBandRows), depth(luminance.size());
  for (int row = 0; row < view.height_px; row += Renderer::kBandRows) {
    renderer.render_band(pose, row, luminance.data(), depth.data());
    for (const float value : luminance)
      image.pixels.push_back(static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.f, 255.f))));
  }
  return image;
}

void describe(const fs::path& file, const Scene& scene) {
  Vec3 low = scene.world.vertices_ned_m.front(), high = low;
  for (const Vec3& v : scene.world.vertices_ned_m) low = low.cwiseMin(v), high = high.cwiseMax(v);
  std::printf("%s: %s, %zu faces, %zu textures, %.1f m north x %.1f m east x %.1f m up\n", file.c_str(),
              scene.title.empty() ? "untitled" : scene.title.c_str(), scene.world.quads.size(),
              scene.world.textures.size() - 2, static_cast<double>(high.x() - low.x()),
              static_cast<double>(high.y() - low.y()), static_cast<double>(high.z() - low.z()));
}

void make(const std::string& kind, std::uint32_t seed, fs::path file) {
  if (file.empty()) file = kind + "-" + std::to_string(seed) + ".wrl";
  Scene scene = make_scene(kind, seed);
  scene.title += ", seed " + std::to_string(seed);
  if (file.has_parent_path()) fs::create_directories(file.parent_path());
  write_vrml(scene, file);
  describe(file, read_vrml(file));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Simulated worlds as VRML97 files, which any VRML viewer shows and `wasp sim --world` flies in."};
  app.name("wasp world");
  app.require_subcommand(1);
  std::string kind;
  std::uint32_t seed = 1;
  fs::path file, out;
  View view;
  auto* list = app.add_subcommand("list", "the kinds of world");
  auto* maker = app.add_subcommand("make", "make one; the same seed makes the same world");
  maker->add_option("KIND", kind, "see `wasp world list`")->required();
  maker->add_option("--seed", seed, "which one of its kind")->capture_default_str();
  maker->add_option("--out", out, "the file; its textures are written beside it (default: KIND-SEED.wrl)");
  auto* show = app.add_subcommand("show", "say what is in a file and draw what a camera at the start would see");
  show->add_option("FILE", file, "VRML97")->required();
  show->add_option("--out", out, "picture to write (default: FILE with .png)");
  show->add_option("--eye", view.eye, "metres north, east and up from the start")->expected(3)->capture_default_str();
  show->add_option("--yaw-deg", view.yaw_deg, "from the start's heading, clockwise")->capture_default_str();
  show->add_option("--pitch-down-deg", view.pitch_down_deg, "90: straight down")->capture_default_str();
  show->add_option("--fov-deg", view.field_of_view_deg, "across the picture")
      ->check(CLI::Range(10.0, 140.0))
      ->capture_default_str();
  show->add_option("--at-s", view.at_s, "moving parts as they are this long after the vehicle first left the ground")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    if (*list)
      for (const SceneKind& k : scene_kinds()) std::printf("%-20s %s\n", k.name, k.what);
    if (*maker) make(kind, seed, out);
    if (*show) {
      const Scene scene = read_vrml(file);
      describe(file, scene);
      if (out.empty()) out = fs::path(file).replace_extension(".png");
      drivers::save_png(out, draw(scene, view).view());
      std::printf("%s written\n", out.c_str());
    }
  } catch (const std::exception& e) {
    std::fprintf(stderr, "wasp world: %s\n", e.what());
    return 1;
  }
  return 0;
}
