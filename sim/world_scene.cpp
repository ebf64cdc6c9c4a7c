#include "sim/world_scene.h"

#include <embree3/rtcore.h>

#include <cstring>
#include <stdexcept>
#include <utility>

namespace wasp::sim {
namespace {

/// Without it a ray that meets a quad's diagonal to the last bit slips through between its two triangles.
constexpr RTCSceneFlags kFlags = RTC_SCENE_FLAG_ROBUST;

}  // namespace

WorldScene::WorldScene(World world, RTCDeviceTy* device) : world_(std::move(world)), device_(device) {}

// Delegating makes the object whole before the scene is built, so the destructor also runs where that throws.
WorldScene::WorldScene(World world) : WorldScene(std::move(world), rtcNewDevice("threads=1,frequency_level=simd512")) {
  build();
}

WorldScene::~WorldScene() {
  if (scene_ != nullptr) rtcReleaseScene(scene_);
  for (RTCGeometry instance : instances_) rtcReleaseGeometry(instance);
  for (RTCScene part : parts_) rtcReleaseScene(part);
  if (device_ != nullptr) rtcReleaseDevice(device_);
}

/// A committed scene of some quads, all in one geometry of the number given.
RTCSceneTy* WorldScene::build_faces(std::uint32_t number, std::size_t first, std::size_t count) {
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_QUAD);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), world_.vertices_ned_m.size()));
  auto* quads =
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 4 * sizeof(std::uint32_t), count);
  if (vertices == nullptr || quads == nullptr) throw std::runtime_error("renderer: Embree gives no buffers");
  for (const Vec3& v : world_.vertices_ned_m)
    for (int axis = 0; axis < 3; ++axis) *vertices++ = v[axis];
  std::memcpy(quads, world_.quads.data() + first, count * sizeof(world_.quads[0]));
  rtcCommitGeometry(geometry);
  RTCScene scene = rtcNewScene(device_);
  rtcSetSceneFlags(scene, kFlags);
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
  rtcAttachGeometryByID(scene, geometry, number);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  return scene;
}

RTCGeometryTy* WorldScene::add_instance(RTCSceneTy* faces) {
  RTCGeometry instance = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(instance, faces);
  rtcCommitGeometry(instance);
  rtcAttachGeometry(scene_, instance);
  return instance;
}

void WorldScene::build() {
  if (device_ == nullptr) throw std::runtime_error("renderer: Embree gives no device");
  surfaces_ = world_.surfaces;
  first_ = {0};
  for (const Mover& mover : world_.movers) first_.push_back(mover.first_quad);
  if (world_.movers.empty()) {
    scene_ = build_faces(0, 0, world_.quads.size());
  } else {
    parts_.push_back(build_faces(0, 0, world_.still_quads()));
    for (const Mover& mover : world_.movers)
      parts_.push_back(build_faces(static_cast<std::uint32_t>(parts_.size()), mover.first_quad, mover.quad_count));
    scene_ = rtcNewScene(device_);
    rtcSetSceneFlags(scene_, static_cast<RTCSceneFlags>(kFlags | RTC_SCENE_FLAG_DYNAMIC));
    for (RTCScene part : parts_) instances_.push_back(add_instance(part));
    move_to(0);
  }
  if (rtcGetDeviceError(device_) != RTC_ERROR_NONE) throw std::runtime_error("renderer: Embree cannot build the scene");
}

void WorldScene::move_to(double t_s) const {
  if (t_s == at_s_) return;
  at_s_ = t_s;
  for (std::size_t i = 0; i < world_.movers.size(); ++i) {
    const Mover& mover = world_.movers[i];
    const MoverPlace place = mover.at(t_s);
    Eigen::Matrix<float, 3, 4> columns;
    columns << R_world_mover(place), place.position_ned_m;
    RTCGeometry instance = instances_[i + 1];
    rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns.data());
    rtcCommitGeometry(instance);
    for (std::uint32_t quad = mover.first_quad; quad < mover.first_quad + mover.quad_count; ++quad)
      surfaces_[quad] = World::placed(world_.surfaces[quad], place);
  }
  rtcCommitScene(scene_);
}

std::array<Vec3, 4> WorldScene::corners(std::uint32_t geometry, std::uint32_t primitive) const {
  std::array<Vec3, 4> corners;
  const auto& quad = world_.quads[first_[geometry] + primitive];
  for (std::size_t i = 0; i < 4; ++i) corners[i] = world_.vertices_ned_m[quad[i]];
  if (geometry == 0) return corners;
  const MoverPlace place = world_.movers[geometry - 1].at(at_s_);
  const Mat3 R = R_world_mover(place);
  for (Vec3& corner : corners) corner = place.position_ned_m + R * corner;
  return corners;
}

WorldScene::Moment WorldScene::at(double t_s) const {
  if (world_.movers.empty()) return {};
  Moment moment(moving_);
  move_to(t_s);
  return moment;
}

}  // namespace wasp::sim
