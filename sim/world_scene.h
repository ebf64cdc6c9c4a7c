// A world in Embree's hands, shared by every camera that looks into it. The surfaces stay beside it: what a ray hits is
// a geometry and a primitive in it, and `surface` says how that looks.
//
// Where parts move, everything is built once and put in place as an instance: a new time sets the movers' transforms
// and rebuilds the little tree over the instances, never the trees of the faces.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "sim/world.h"

struct RTCDeviceTy;
struct RTCSceneTy;
struct RTCGeometryTy;

namespace wasp::sim {

class WorldScene {
 public:
  /// Builds the acceleration structure; keeps the world. Throws std::runtime_error when Embree fails.
  explicit WorldScene(World world);
  ~WorldScene();
  WorldScene(const WorldScene&) = delete;
  WorldScene& operator=(const WorldScene&) = delete;

  [[nodiscard]] const World& world() const { return world_; }
  /// Embree's handle, committed: rays may be cast into it from any thread, where parts move while holding `at`.
  [[nodiscard]] RTCSceneTy* handle() const { return scene_; }
  /// Of a hit. The world that stands still is geometry 0, mover number i is geometry i + 1.
  [[nodiscard]] const Surface& surface(std::uint32_t geometry, std::uint32_t primitive) const {
    return surfaces_[first_[geometry] + primitive];
  }
  /// The face's corners in the world.
  [[nodiscard]] std::array<Vec3, 4> corners(std::uint32_t geometry, std::uint32_t primitive) const;

  /// Puts every moving part where it is at this time. While the result lives, no other thread puts them elsewhere. Free
  /// of cost where nothing moves. Must not be nested.
  using Moment = std::unique_lock<std::mutex>;
  [[nodiscard]] Moment at(double t_s) const;

 private:
  WorldScene(World world, RTCDeviceTy* device);
  void build();
  RTCSceneTy* build_faces(std::uint32_t geometry, std::size_t first, std::size_t count);
  RTCGeometryTy* add_instance(RTCSceneTy* faces);
  void move_to(double t_s) const;

  World world_;
  RTCDeviceTy* device_ = nullptr;
  RTCSceneTy* scene_ = nullptr;
  std::vector<RTCSceneTy*> parts_;         ///< where something moves: the still world's scene, then the movers'
  std::vector<RTCGeometryTy*> instances_;  ///< of parts_
  std::vector<std::uint32_t> first_;       ///< first quad of each geometry
  mutable std::vector<Surface> surfaces_;  ///< as they lie at at_s_
  mutable double at_s_ = -1;
  mutable std::mutex moving_;
};

}  // namespace wasp::sim
