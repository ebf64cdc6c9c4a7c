#include "missions/world_probe.h"

#include <embree3/rtcore.h>

#include "sim/clearance.h"
#include "sim/scene.h"
#include "sim/vrml_file.h"

namespace wasp::missions {

struct WorldProbe::Parts {
  std::shared_ptr<sim::WorldScene> scene;
  Vec3 start_ned_m = Vec3::Zero();
  float start_yaw_rad = 0;
};

WorldProbe::WorldProbe(const MissionSetup& setup) : parts_(std::make_unique<Parts>()) {
  const sim::Scene scene =
      setup.sim.world_file.empty() ? sim::generated_scene(setup.sim) : sim::read_vrml(setup.sim.world_file);
  parts_->start_ned_m = scene.start_ned_m;
  parts_->start_yaw_rad = scene.start_yaw_rad;
  parts_->scene = std::make_shared<sim::WorldScene>(sim::placed_at_start(scene));
}
WorldProbe::~WorldProbe() = default;

Vec3 WorldProbe::in_world(const Truth& t) const {
  const Mat3 R = Eigen::AngleAxisf(parts_->start_yaw_rad, Vec3::UnitZ()).toRotationMatrix();
  return parts_->start_ned_m + R * Vec3(t.position_ned_m[0], t.position_ned_m[1], t.position_ned_m[2]);
}

WorldProbe::Look WorldProbe::look(const Truth& t) const {
  const Vec3 at(t.position_ned_m[0], t.position_ned_m[1], t.position_ned_m[2]);
  const sim::Clearance c = sim::clearance_at(*parts_->scene, at, static_cast<double>(t.flight_time_s));
  return {static_cast<double>(c.around_m), static_cast<double>(c.below_m), c.collides(), c.collides_in_flight()};
}

double WorldProbe::height_over(const Truth& t) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit ray{};
  ray.ray.org_x = t.position_ned_m[0], ray.ray.org_y = t.position_ned_m[1], ray.ray.org_z = t.position_ned_m[2];
  ray.ray.dir_z = 1;
  ray.ray.tfar = 1e3f, ray.ray.mask = ~0u;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(parts_->scene->handle(), &context, &ray);
  return ray.hit.geomID == RTC_INVALID_GEOMETRY_ID ? 0 : static_cast<double>(ray.ray.tfar);
}

}  // namespace wasp::missions
