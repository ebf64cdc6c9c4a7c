#include "sim/clearance.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace wasp::sim {
namespace {

constexpr float kDownCone = 0.7071068f;  ///< cosine of its half angle

/// The point of a triangle that is nearest to p (C. Ericson, Real-Time Collision Detection, 5.1.5): the corner, edge or
/// inside that p lies over.
Vec3 nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const float d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const float d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
  const float d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  const float scale = 1 / (va + vb + vc);
  return a + ab * (vb * scale) + ac * (vc * scale);
}

struct Search {
  const WorldScene& scene;
  Vec3 centre;
  Clearance best;
};

void note(Search& search, const Vec3& nearest) {
  const Vec3 to = nearest - search.centre;
  const float distance = to.norm();
  float& best = to.z() > kDownCone * distance ? search.best.below_m : search.best.around_m;
  best = std::min(best, distance);
}

bool on_face(RTCPointQueryFunctionArguments* args) {
  auto& search = *static_cast<Search*>(args->userPtr);
  const std::array<Vec3, 4> q = search.scene.corners(args->geomID, args->primID);
  const Vec3 one = nearest_on_triangle(search.centre, q[0], q[1], q[2]);
  const Vec3 other = nearest_on_triangle(search.centre, q[0], q[2], q[3]);
  note(search, (one - search.centre).squaredNorm() <= (other - search.centre).squaredNorm() ? one : other);
  const float farther = std::max(search.best.below_m, search.best.around_m);
  if (farther >= args->query->radius) return false;
  args->query->radius = farther;
  return true;
}

}  // namespace

Clearance clearance_at(const WorldScene& scene, const Vec3& centre_ned_m, double flight_time_s) {
  if (!centre_ned_m.allFinite()) return {0, 0};
  const WorldScene::Moment moment = scene.at(flight_time_s);
  Search search{scene, centre_ned_m, {}};
  RTCPointQuery query{centre_ned_m.x(), centre_ned_m.y(), centre_ned_m.z(), 0, kClearanceRange_m};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene.handle(), &query, &context, &on_face, &search);
  return search.best;
}

}  // namespace wasp::sim
