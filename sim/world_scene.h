// A world in Embree's hands, shared by every camera that looks into it. The surfaces stay beside it: what a ray hits is
// a geometry and a primitive in it, and `surface` says how that looks.
#pragma once

#include <cstdint>
#include <memory>

#include "sim/world.h"

struct RTCDeviceTy;
struct RTCSceneTy;

namespace wasp::sim {

class WorldScene {
 public:
  /// Builds the acceleration structure; keeps the world. Throws std::runtime_error when Embree fails.
  explicit WorldScene(World world);
  ~WorldScene();
  WorldScene(const WorldScene&) = delete;
  WorldScene& operator=(const WorldScene&) = delete;

  [[nodiscard]] const World& world() const { return world_; }
  /// Embree's handle, committed: rays may be cast into it from any thread.
  [[nodiscard]] RTCSceneTy* handle() const { return scene_; }
  /// Of a hit. The world that stands still is geometry 0.
  [[nodiscard]] const Surface& surface(std::uint32_t /*geometry*/, std::uint32_t primitive) const {
    return world_.surfaces[primitive];
  }

 private:
  WorldScene(World world, RTCDeviceTy* device);
  void build_scene();

  World world_;
  RTCDeviceTy* device_ = nullptr;
  RTCSceneTy* scene_ = nullptr;
};

}  // namespace wasp::sim
