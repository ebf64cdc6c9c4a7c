// wasp bench render: what a simulated frame costs, in one thread, with noise and (for a pinhole) depth: worlds by sizes
// by optics, along the same swerving flight. Time is the thread's own processor time, so that others on the machine
// disturb little; the bar is a frame in 1/30 s for every row but those with all optics at once. Every row: median and
// p99 of a frame, frames a second of the whole row.
#include <ctime>
#include <string>
#include <vector>

#include "benchmarks/bench.h"
#include "benchmarks/report.h"
#include "rt/process.h"
#include "sim/scene.h"
#include "sim/sim_camera.h"
#include "types/units.h"

namespace wasp::bench {
namespace {

using namespace wasp::sim;

constexpr double kBar_ms = 1e3 / 30;
constexpr float kSpeed_mps = 2, kFrame_s = 1.f / 30;

struct Optics {
  const char* name;
  void (*set)(CameraSetup&);
};

void make_fisheye(CameraSetup& setup) {
  Intrinsics& k = setup.geometry.intrinsics;
  setup.geometry.lens_kind = LensKind::kFisheye;
  setup.optics.field_of_view_rad = static_cast<float>(to_radians(Degrees{170}).value);
  k.fx_px = k.fy_px = 0.5f * static_cast<float>(k.height_px) / (0.5f * setup.optics.field_of_view_rad);
}

constexpr Optics kOptics[] = {
    {"pinhole", [](CameraSetup&) {}},
    {"pinhole antialias", [](CameraSetup& s) { s.optics.antialias = true; }},
    {"fisheye", make_fisheye},
    {"fisheye antialias",
     [](CameraSetup& s) {
       make_fisheye(s);
       s.optics.antialias = true;
     }},
    {"pinhole defocus 5 mm", [](CameraSetup& s) { s.optics.aperture_m = 0.005f; }},
    {"pinhole motion 10 ms", [](CameraSetup& s) { s.optics.exposure_s = 0.01f; }},
    {"pinhole all on",
     [](CameraSetup& s) { s.optics = {.antialias = true, .aperture_m = 0.005f, .exposure_s = 0.01f}; }},
};

CameraSetup setup_of(int width_px, int height_px) {
  CameraSetup setup;
  Intrinsics& k = setup.geometry.intrinsics;
  k = {.width_px = width_px, .height_px = height_px};
  k.fx_px = k.fy_px = 525.f * static_cast<float>(width_px) / 640;
  k.cx_px = 0.5f * static_cast<float>(width_px - 1), k.cy_px = 0.5f * static_cast<float>(height_px - 1);
  setup.geometry.R_body_cam = R_body_cam_from_pitch_down(to_radians(Degrees{15}));
  setup.optics.antialias = false;
  return setup;
}

/// To and fro along the first eight metres, swerving, rolling and climbing.
BodyPose pose_of(int frame) {
  const float t = kFrame_s * static_cast<float>(frame);
  BodyPose pose;
  pose.position_ned_m = {4 - 4 * std::cos(0.5f * t), 0.4f * std::sin(0.7f * t), -1.2f - 0.4f * std::sin(0.3f * t)};
  pose.q_ned_body = quat_from_euler({0.1f * std::sin(t), 0.05f * std::sin(1.3f * t), 0.8f * std::sin(0.4f * t)});
  pose.velocity_ned_mps = {kSpeed_mps * std::sin(0.5f * t), 0.28f * std::cos(0.7f * t), 0};
  pose.rate_body_radps = {0.1f * std::cos(t), 0, 0.32f * std::cos(0.4f * t)};
  return pose;
}

double processor_ns() {
  timespec at{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &at);
  return static_cast<double>(at.tv_sec) * 1e9 + static_cast<double>(at.tv_nsec);
}

void measure(Report& report, const std::string& name, SimCamera& camera, bool depth, double seconds) {
  const auto pixels = static_cast<std::size_t>(camera.width_px()) * static_cast<std::size_t>(camera.height_px());
  std::vector<std::uint8_t> gray(pixels);
  std::vector<std::uint16_t> depth_mm(pixels);
  std::vector<std::int64_t> frames_ns;
  double spent_ns = 0;
  for (int frame = -3; spent_ns < seconds * 1e9 || frames_ns.size() < 30; ++frame) {
    const double began_ns = processor_ns();
    camera.render(pose_of(5 * frame), static_cast<std::uint32_t>(frame + 3), gray.data(),
                  depth ? depth_mm.data() : nullptr);
    const double took_ns = processor_ns() - began_ns;
    if (frame < 0) continue;  // caches and pages are warm now
    spent_ns += took_ns;
    frames_ns.push_back(static_cast<std::int64_t>(took_ns));
  }
  const bool judged = name.find("all on") == std::string::npos;  // everything at once is told, not promised
  const double rate_hz = 1e9 * static_cast<double>(frames_ns.size()) / spent_ns;
  const Quantiles q = quantiles(frames_ns);
  const std::string rate = std::to_string(static_cast<int>(rate_hz)) + " frames/s";
  if (judged) report.bar(name + ".p50", q.p50 * 1e-6, "ms", kBar_ms, rate);
  if (!judged) report.figure(name + ".p50", q.p50 * 1e-6, "ms", rate);
  report.figure(name + ".p99", q.p99 * 1e-6, "ms");
}

}  // namespace

int run_render(const Options& options) {
  constexpr const char* kWorlds[] = {"laboratory", "corridor", "city"};
  constexpr int kSizes[][2] = {{320, 240}, {640, 480}};
  Report report(options.json);
  report.note("frames", "processor time of one thread; grey and depth (fisheye: grey), with sensor noise");
  const double seconds = options.seconds / static_cast<double>(std::size(kWorlds) * 2 * std::size(kOptics));
  for (const char* world : kWorlds) {
    std::shared_ptr<const WorldScene> scene;
    for (const auto& [width_px, height_px] : kSizes)
      for (const Optics& optics : kOptics) {
        const std::string name =
            std::string(world) + "." + std::to_string(width_px) + "x" + std::to_string(height_px) + "." + optics.name;
        if (name.find(options.only) == std::string::npos) continue;
        if (!scene) scene = std::make_shared<const WorldScene>(placed_at_start(make_scene(world, 1)));
        CameraSetup setup = setup_of(width_px, height_px);
        optics.set(setup);
        SimCamera camera(scene, setup, SensorParams{}, 1);
        measure(report, name, camera, setup.geometry.lens_kind == LensKind::kPinhole, seconds);
      }
  }
  return report.met() ? 0 : 1;
}

}  // namespace wasp::bench
