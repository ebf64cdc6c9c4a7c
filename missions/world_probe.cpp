#include "missions/world_probe.h"

#include <embree3/rtcore.h>

#include "sim/clearance.h"
#include "sim/sim_camera.h"

namespace wasp::missions {

struct WorldProbe::Parts {
  std::shared_ptr<sim::WorldScene> scene;
};

WorldProbe::WorldProbe(const MissionSetup& setup) : parts_(new Parts{sim::make_world_scene(setup.sim)}) {}
WorldProbe::~WorldProbe() = default;

WorldProbe::Look WorldProbe::look(const Truth& t, double flight_time_s) const {
  const Vec3 at(t.position_ned_m[0], t.position_ned_m[1], t.position_ned_m[2]);
  const sim::Clearance c = sim::clearance_at(*parts_->scene, at, flight_time_s);
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
