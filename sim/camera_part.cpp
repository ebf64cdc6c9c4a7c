#include "sim/camera_part.h"

#include <array>
#include <cstdio>
#include <optional>

#include "rt/thread.h"
#include "shm/topics.h"
#include "sim/camera_loop.h"
#include "sim/owned_region.h"

namespace wasp::sim {

struct CameraPart::Parts {
  Parts(const SimConfig& config, const std::string& instance)
      : rate_hz(config.camera_rate_hz),
        camera(config),
        frames(shm::camera_region(instance), CameraLoop::topics(camera.width_px(), camera.height_px())) {}
  double rate_hz;
  SimCamera camera;
  OwnedRegion frames;
  std::optional<CameraLoop> loop;
  rt::Thread thread;  // joined first
};

CameraPart::CameraPart(const SimConfig& config, const std::string& instance)
    : parts_(std::make_unique<Parts>(config, instance)) {}

CameraPart::~CameraPart() = default;

void CameraPart::start(TimeNs start_ns, PoseQueue& poses, const std::atomic<bool>& stop) {
  CameraLoop& loop = parts_->loop.emplace(parts_->camera, start_ns, parts_->rate_hz, parts_->frames.region, poses);
  parts_->thread = rt::Thread({.name = "camera", .core = rt::nearest_usable_core(0)}, [&] { loop.run(stop); });
}

void CameraPart::join() { parts_->thread.join(); }

std::string CameraPart::summary() const {
  const CameraLoop& loop = *parts_->loop;
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(),
                "%llu frames, %llu skipped, rendering p50 %.2f ms, max %.2f ms, announced %.0f us ahead",
                static_cast<unsigned long long>(loop.frames()), static_cast<unsigned long long>(loop.skipped()),
                static_cast<double>(loop.render_time().quantile_ns(0.5)) * 1e-6,
                static_cast<double>(loop.render_time().max_ns()) * 1e-6,
                static_cast<double>(loop.lead().quantile_ns(0.5)) * 1e-3);
  return text.data();
}

}  // namespace wasp::sim
