#include "sim/world_scene.h"

#include <embree3/rtcore.h>

#include <cstring>
#include <stdexcept>
#include <utility>

namespace wasp::sim {

WorldScene::WorldScene(World world, RTCDeviceTy* device) : world_(std::move(world)), device_(device) {}

// Delegating makes the object whole before the scene is built, so the destructor also runs where that throws.
WorldScene::WorldScene(World world) : WorldScene(std::move(world), rtcNewDevice("threads=1,frequency_level=simd512")) {
  build_scene();
}

WorldScene::~WorldScene() {
  if (scene_ != nullptr) rtcReleaseScene(scene_);
  if (device_ != nullptr) rtcReleaseDevice(device_);
}

void WorldScene::build_scene() {
  if (device_ == nullptr) throw std::runtime_error("renderer: Embree gives no device");
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_QUAD);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), world_.vertices_ned_m.size()));
  auto* quads = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 4 * sizeof(std::uint32_t),
                                        world_.quads.size());
  if (vertices == nullptr || quads == nullptr) throw std::runtime_error("renderer: Embree gives no buffers");
  for (const Vec3& v : world_.vertices_ned_m)
    for (int axis = 0; axis < 3; ++axis) *vertices++ = v[axis];
  std::memcpy(quads, world_.quads.data(), world_.quads.size() * sizeof(world_.quads[0]));
  rtcCommitGeometry(geometry);
  scene_ = rtcNewScene(device_);
  // Without it a ray that meets a quad's diagonal to the last bit slips through between its two triangles.
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_);
  if (rtcGetDeviceError(device_) != RTC_ERROR_NONE) throw std::runtime_error("renderer: Embree cannot build the scene");
}

}  // namespace wasp::sim
