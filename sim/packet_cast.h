// One packet of 16 rays through a world, from directions in camera axes to pixel values.
#pragma once

#include <embree3/rtcore.h>
#include <xmmintrin.h>

#include <bit>
#include <cstdint>

#include "sim/renderer.h"
#include "sim/shading.h"

namespace wasp::sim {

/// Embree is fast only while denormals count as zero; the thread's own mode comes back afterwards.
class FlushDenormals {
 public:
  FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | 0x8040u); }
  ~FlushDenormals() { _mm_setcsr(saved_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned saved_;
};

class PacketCast {
 public:
  PacketCast(const WorldScene& scene, const CameraPose& pose) : scene_(scene), pose_(pose) {
    rtcInitIntersectContext(&context_);
    context_.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    hits_.eye_ned_m = pose.position_ned_m;
    RTCRay16& ray = packet_.ray;
    for (int i = 0; i < 16; ++i) {
      ray.org_x[i] = pose.position_ned_m.x(), ray.org_y[i] = pose.position_ned_m.y();
      ray.org_z[i] = pose.position_ned_m.z();
      ray.tnear[i] = 0.01f, ray.time[i] = 0;
      ray.mask[i] = ~0u, ray.id[i] = 0, ray.flags[i] = 0;
      packet_.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
  }

  /// `pixel` scales the footprint, `aside` is added to every direction. Afterwards `luminance`, `range` and `face` hold
  /// what the rays see.
  void cast(const RayPacket& rays, float pixel, const Vec3& aside = Vec3::Zero()) {
    const Mat3& R = pose_.R_ned_cam;
    RTCRay16& ray = packet_.ray;
    for (int i = 0; i < 16; ++i) {
      const float x = rays.x[i] + aside.x(), y = rays.y[i] + aside.y(), z = rays.z[i] + aside.z();
      hits_.dir_x[i] = ray.dir_x[i] = R(0, 0) * x + R(0, 1) * y + R(0, 2) * z;
      hits_.dir_y[i] = ray.dir_y[i] = R(1, 0) * x + R(1, 1) * y + R(1, 2) * z;
      hits_.dir_z[i] = ray.dir_z[i] = R(2, 0) * x + R(2, 1) * y + R(2, 2) * z;
      ray.tfar[i] = 1e3f;
      packet_.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    }
    hits_.pixel = pixel;
    rtcIntersect16(rays.seen, scene_.handle(), &context_, &packet_);
    shade(rays);
  }

  alignas(64) float luminance[16];
  alignas(64) float range[16];
  alignas(64) std::uint32_t face[16];

 private:
  static constexpr std::uint32_t kFacesOfGeometry = 1u << 24;

  void shade(const RayPacket& rays) {
    std::uint32_t waiting = 0;
    for (int i = 0; i < 16; ++i) {
      const bool seen = rays.seen[i] != 0;  // Embree's kernels without AVX-512 fill the lanes that were not asked for too
      const bool hit = seen && packet_.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
      waiting |= (hit ? 1u : 0u) << i;
      hits_.range[i] = packet_.ray.tfar[i];
      range[i] = hit ? packet_.ray.tfar[i] : 0.f;
      const std::uint32_t none = seen ? CastFrame::kNoFace : CastFrame::kUnseen;
      face[i] = hit ? packet_.hit.geomID[i] * kFacesOfGeometry + packet_.hit.primID[i] : none;
      luminance[i] = seen ? scene_.world().sky : 0.f;
    }
    while (waiting != 0) {
      const int first = std::countr_zero(waiting);
      std::uint32_t same = 0;
      for (int i = 0; i < 16; ++i) same |= (face[i] == face[first] ? 1u : 0u) << i;
      same &= waiting;
      shade_lanes(scene_.world(), scene_.surface(packet_.hit.geomID[first], packet_.hit.primID[first]), hits_, same,
                  luminance);
      waiting &= ~same;
    }
  }

  const WorldScene& scene_;
  const CameraPose& pose_;
  RTCIntersectContext context_;
  alignas(64) RTCRayHit16 packet_;
  PacketHits hits_;
};

}  // namespace wasp::sim
