#include "sim/camera_part.h"

#include <array>
#include <cstdio>
#include <optional>

#include "rt/thread.h"
#include "shm/topics.h"
#include "sim/camera_loop.h"
#include "sim/follow_loop.h"
#include "sim/owned_region.h"

namespace wasp::sim {
namespace {

std::unique_ptr<SimCamera> make_down(const SimConfig& config, std::shared_ptr<const WorldScene> scene) {
  if (!config.down.enabled) return nullptr;
  return std::make_unique<SimCamera>(std::move(scene), config.down.setup, config.sensor, down_seed(config.seed));
}

std::string account_of(const CameraEye& eye) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(),
                "%llu frames, %llu skipped, rendering p50 %.2f ms, max %.2f ms, announced %.0f us ahead",
                static_cast<unsigned long long>(eye.frames()), static_cast<unsigned long long>(eye.skipped()),
                static_cast<double>(eye.render_time().quantile_ns(0.5)) * 1e-6,
                static_cast<double>(eye.render_time().max_ns()) * 1e-6,
                static_cast<double>(eye.lead().quantile_ns(0.5)) * 1e-3);
  return text.data();
}

}  // namespace

struct CameraPart::Parts {
  Parts(const SimConfig& config, const std::string& instance, const std::shared_ptr<WorldScene>& scene)
      : front_rate_hz(config.camera_rate_hz),
        down_rate_hz(config.down.rate_hz),
        front(scene, config.front(), config.sensor, config.seed),
        down(make_down(config, scene)),
        frames(shm::camera_region(instance), CameraLoop::topics(front, down.get())) {}
  double front_rate_hz, down_rate_hz;
  SimCamera front;
  std::unique_ptr<SimCamera> down;  ///< nullptr: there is none
  OwnedRegion frames;
  std::optional<CameraLoop> loop;
  std::optional<FollowLoop> following;  ///< instead

  [[nodiscard]] std::optional<CameraView> down_view() {
    return down ? std::optional(CameraView{down.get(), down_rate_hz}) : std::nullopt;
  }
  rt::Thread thread;  // joined first
};

CameraPart::CameraPart(const SimConfig& config, const std::string& instance)
    : parts_(std::make_unique<Parts>(config, instance, make_world_scene(config))) {}

CameraPart::~CameraPart() = default;

void CameraPart::start(TimeNs start_ns, PoseQueue& poses, const std::atomic<bool>& stop) {
  CameraLoop& loop = parts_->loop.emplace(CameraView{&parts_->front, parts_->front_rate_hz}, parts_->down_view(),
                                          start_ns, parts_->frames.region, poses);
  parts_->thread = rt::Thread({.name = "camera", .core = rt::nearest_usable_core(0)}, [&] { loop.run(stop); });
}

void CameraPart::start(TimeNs start_ns, FollowedPose& pose, const std::atomic<bool>& stop) {
  FollowLoop& loop = parts_->following.emplace(CameraView{&parts_->front, parts_->front_rate_hz}, parts_->down_view(),
                                               start_ns, parts_->frames.region, pose);
  parts_->thread = rt::Thread({.name = "camera", .core = rt::nearest_usable_core(0)}, [&] { loop.run(stop); });
}

void CameraPart::join() { parts_->thread.join(); }

std::string CameraPart::summary() const {
  const auto text_of = [](const auto& loop) {
    const std::string text = account_of(loop.front());
    return loop.down() == nullptr ? text : text + "; down: " + account_of(*loop.down());
  };
  return parts_->following ? text_of(*parts_->following) : text_of(*parts_->loop);
}

}  // namespace wasp::sim
