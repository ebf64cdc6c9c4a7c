#include "vision/kernels/plane_passes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "tests/vision/every_target.h"
#include "tests/vision/synthetic_depth.h"
#include "vision/kernels/depth_plane.h"

namespace wasp::vision {
namespace {

using test::on_every_target;

struct Points {
  std::vector<float> x, y, w;
  [[nodiscard]] InverseDepths view() const { return {x, y, w}; }
};

Points points_about(const InversePlane& plane, std::size_t n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> ray(-0.6f, 0.6f);
  std::normal_distribution<float> noise(0.f, 0.02f);
  Points p;
  for (std::size_t i = 0; i < n; ++i) {
    p.x.push_back(ray(random));
    p.y.push_back(ray(random));
    p.w.push_back(plane.a * p.x[i] + plane.b * p.y[i] + plane.c + noise(random));
  }
  return p;
}

PlaneSupport plain_support(const Points& p, const InversePlane& plane, const PlaneBand& band) {
  PlaneSupport support;
  for (std::size_t i = 0; i < p.w.size(); ++i) {
    const float r = p.w[i] - (plane.a * p.x[i] + plane.b * p.y[i] + plane.c);
    const float tolerance = band.sensor + band.slope * p.w[i];
    support.inliers += std::abs(r) < tolerance ? 1 : 0;
    support.below += r < -1.5f * tolerance ? 1 : 0;
  }
  return support;
}

/// Sample i adds to partial sum i mod 8, in order; the partial sums add up in double.
PlaneMoments plain_moments(const Points& p, const InversePlane& plane, const PlaneBand& band) {
  float sums[11][8] = {};
  for (std::size_t i = 0; i < p.w.size(); ++i) {
    const float x = p.x[i], y = p.y[i], r = p.w[i] - (plane.a * x + plane.b * y + plane.c);
    if (!(std::abs(r) < band.sensor + band.slope * p.w[i])) continue;
    const float d = r / p.w[i];
    const float terms[] = {1.f, x, y, r, x * x, x * y, y * y, r * x, r * y, r * r, d * d};
    for (std::size_t m = 0; m < 11; ++m) sums[m][i % 8] += terms[m];
  }
  double all[11];
  for (std::size_t m = 0; m < 11; ++m) {
    const auto pair = [&](std::size_t i) {
      return static_cast<double>(sums[m][i]) + static_cast<double>(sums[m][i + 4]);
    };
    all[m] = (pair(0) + pair(1)) + (pair(2) + pair(3));
  }
  return {all[0], all[1], all[2], all[3], all[4], all[5], all[6], all[7], all[8], all[9], all[10]};
}

TEST(PlanePasses, EqualThePlainLoopsToTheBitOnEveryTarget) {
  const InversePlane plane{0.1f, 0.8f, 0.5f};
  const PlaneBand band{0.006f, 0.01f};
  for (const std::size_t n : {0u, 1u, 7u, 8u, 15u, 17u, 256u, 1199u, 1200u}) {
    const Points p = points_about(plane, n, static_cast<unsigned>(n) + 1);
    const PlaneSupport support = plain_support(p, plane, band);
    const PlaneMoments moments = plain_moments(p, plane, band);
    on_every_target([&](const std::string&) {
      const PlaneSupport got = pass_support(p.view(), plane, band);
      EXPECT_EQ(got.inliers, support.inliers) << n;
      EXPECT_EQ(got.below, support.below) << n;
      const PlaneMoments sums = pass_moments(p.view(), plane, band, true);
      EXPECT_EQ(std::memcmp(&sums, &moments, sizeof sums), 0) << n;
      const PlaneMoments fewer = pass_moments(p.view(), plane, band, false);
      EXPECT_EQ(std::memcmp(&fewer, &moments, offsetof(PlaneMoments, dd)), 0) << n;
      EXPECT_EQ(fewer.dd, 0.0);
    });
  }
}

TEST(DepthSamples, StayInTheirCellsAndTheValidOnesAreListed) {
  auto table = std::make_unique<SampleTable>();
  ASSERT_TRUE(prepare(*table, Intrinsics{}));
  std::mt19937 random(3);
  for (const unsigned invalid : {0u, 1u, 50u, 99u, 100u}) {
    test::DepthImage image{640, 480, std::vector<std::uint16_t>(640 * 480)};
    for (auto& mm : image.mm)
      mm = static_cast<std::uint16_t>(random() % 100 < invalid ? (random() % 2 != 0 ? 0 : 65535)
                                                               : 301 + random() % 7698);
    auto out = std::make_unique<DepthSamples>();
    gather(*table, image.view(), {}, *out);
    std::size_t n = 0;
    for (std::size_t i = 0; i < kSampleCount; ++i) {
      const int mm = image.view().row(table->v_px[i])[table->u_px[i]];
      const bool valid = mm != 0 && mm != 65535;
      ASSERT_EQ(out->w[i], valid ? 1000.f / static_cast<float>(mm) : kAbsent_per_m);
      if (!valid) continue;
      ASSERT_EQ(out->valid[n++], static_cast<int>(i));
    }
    EXPECT_EQ(out->count, static_cast<int>(n));
  }
}

TEST(PlanePasses, TheSamePlaneOnEveryTarget) {
  test::Scene scene;
  scene.floor = {test::up_for(0.5f, 0.1f), 1.3f};
  scene.clutter_share = 0.3f;
  const test::DepthImage image = test::render(scene, 4);
  std::vector<PlaneEstimate> all;
  on_every_target([&](const std::string&) {
    auto state = std::make_unique<DepthPlaneState>();
    all.push_back(estimate_floor({}, scene.k, image.view(), {}, *state));
  });
  for (const PlaneEstimate& e : all) {
    EXPECT_TRUE(e.valid);
    EXPECT_EQ(std::memcmp(e.normal_cam.data(), all[0].normal_cam.data(), sizeof(Vec3)), 0);
    EXPECT_EQ(e.height_m, all[0].height_m);
    EXPECT_EQ(e.rms_m, all[0].rms_m);
    EXPECT_EQ(e.inlier_share, all[0].inlier_share);
  }
}

}  // namespace
}  // namespace wasp::vision
