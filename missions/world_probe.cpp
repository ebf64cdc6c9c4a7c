#include "missions/world_probe.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/sim_camera.h"

namespace wasp::missions {
namespace {

constexpr int kDirections = 96;

Vec3 direction(int i) {
  const double z = 1 - 2 * (i + 0.5) / kDirections, r = std::sqrt(1 - z * z);
  const double a = i * std::numbers::pi * (3 - std::sqrt(5.0));
  return Vec3(static_cast<float>(r * std::cos(a)), static_cast<float>(r * std::sin(a)), static_cast<float>(z));
}

double cast(RTCSceneTy* scene, const Vec3& from, const Vec3& d, double range_m) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit ray{};
  ray.ray.org_x = from.x(), ray.ray.org_y = from.y(), ray.ray.org_z = from.z();
  ray.ray.dir_x = d.x(), ray.ray.dir_y = d.y(), ray.ray.dir_z = d.z();
  ray.ray.tfar = static_cast<float>(range_m), ray.ray.mask = ~0u;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene, &context, &ray);
  return static_cast<double>(ray.ray.tfar);
}

}  // namespace

struct WorldProbe::Parts {
  std::shared_ptr<sim::WorldScene> scene;
};

WorldProbe::WorldProbe(const MissionSetup& setup) : parts_(new Parts{sim::make_world_scene(setup.sim)}) {}
WorldProbe::~WorldProbe() = default;

WorldProbe::Look WorldProbe::look(const Truth& truth, double /*flight_time_s*/) {
  const Vec3 at(truth.position_ned_m[0], truth.position_ned_m[1], truth.position_ned_m[2]);
  Look look{kRange_m, cast(parts_->scene->handle(), at, Vec3::UnitZ(), 200)};
  for (int i = 0; i < kDirections; ++i) {
    const Vec3 d = direction(i);
    if (d.z() > 0.8f) continue;  // the ground below has a figure of its own
    look.around_m = std::min(look.around_m, cast(parts_->scene->handle(), at, d, kRange_m));
  }
  return look;
}

}  // namespace wasp::missions
