#include "vision/kernels/hough_plane.h"

#include <gtest/gtest.h>

#include <memory>

#include "tests/vision/synthetic_depth.h"

namespace wasp::vision {
namespace {

using namespace test;

constexpr std::array kSamplers = {HoughSampler::kNaive, HoughSampler::kLocalCartesian, HoughSampler::kLocalImage,
                                  HoughSampler::kOrthogonal};

HoughPlane detect(HoughSampler sampler, const Scene& scene, bool mean = true) {
  HoughParams params;
  params.sampling.sampler = sampler;
  params.mean_of_cell = mean;
  return std::make_unique<RandomizedHough>(params, scene.k)->detect(render(scene, 1).view());
}

TEST(HoughPlane, EverySamplerFindsACleanFloor) {
  Scene scene;
  scene.floor = {up_for(0.7f, 0.05f), 1.f};
  scene.noise_per_m = 0.0003f;
  for (const HoughSampler sampler : kSamplers) {
    const HoughPlane plane = detect(sampler, scene);
    ASSERT_TRUE(plane.valid) << static_cast<int>(sampler);
    EXPECT_NEAR(plane.height_m, 1.f, 0.05f);
    EXPECT_LT(angle_deg(plane.normal_cam, scene.floor.normal_cam), 2.5f);
    EXPECT_EQ(plane.votes, 10);
    EXPECT_LE(plane.planes, plane.draws);
  }
}

TEST(HoughPlane, CellCentreIsCoarserThanTheMeanOfTheCell) {
  Scene scene;
  scene.floor = {up_for(0.7f, 0.05f), 1.01f};
  scene.noise_per_m = 0.0003f;
  const HoughPlane centre = detect(HoughSampler::kNaive, scene, false);
  ASSERT_TRUE(centre.valid);
  EXPECT_NEAR(centre.height_m, 1.025f, 1e-4f);  // bins of 5 cm: centres at 0.975, 1.025
  EXPECT_LT(angle_deg(centre.normal_cam, scene.floor.normal_cam), 2.f);
}

TEST(HoughPlane, SamplersKeepTheirShape) {
  auto tuples = std::make_unique<std::array<PixelTuple, kHoughTuples>>();
  draw_tuples({.sampler = HoughSampler::kOrthogonal}, 640, 480, *tuples);
  int square = 0;
  for (const PixelTuple& t : *tuples) {
    const int u1 = t.u_px[1] - t.u_px[0], v1 = t.v_px[1] - t.v_px[0], u2 = t.u_px[2] - t.u_px[0],
              v2 = t.v_px[2] - t.v_px[0];
    ASSERT_LT(t.u_px[2], 640);
    ASSERT_LT(t.v_px[2], 480);
    const int dot = u1 * u2 + v1 * v2, size = u1 * u1 + v1 * v1;
    square += std::abs(dot) <= 0.1 * size + 60 ? 1 : 0;
  }
  EXPECT_GT(square, kHoughTuples * 95 / 100);
}

TEST(HoughPlane, SameSeedSameAnswer) {
  Scene scene;
  scene.floor = {up_for(0.6f, 0.f), 1.2f};
  const HoughPlane a = detect(HoughSampler::kOrthogonal, scene), b = detect(HoughSampler::kOrthogonal, scene);
  EXPECT_EQ(a.height_m, b.height_m);
  EXPECT_EQ(a.draws, b.draws);
}

TEST(HoughPlane, BlindAndBadInputIsInvalid) {
  const Intrinsics k;
  auto hough = std::make_unique<RandomizedHough>(HoughParams{}, k);
  const std::vector<std::uint16_t> nothing(640 * 480, 0);
  EXPECT_FALSE(hough->detect({nothing.data(), 640, 480, 640}).valid);
  EXPECT_FALSE(hough->detect({}).valid);
  EXPECT_FALSE(hough->detect({nothing.data(), 320, 240, 320}).valid);
  Intrinsics broken;
  broken.fx_px = -1.f;
  EXPECT_FALSE(std::make_unique<RandomizedHough>(HoughParams{}, broken)->detect({nothing.data(), 640, 480, 640}).valid);
}

}  // namespace
}  // namespace wasp::vision
