#include "vision/kernels/depth_plane.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "tests/vision/synthetic_depth.h"

namespace wasp::vision {
namespace {

using namespace test;

Scene floor_scene(float height_m, float pitch_rad, float roll_rad = 0.f) {
  Scene scene;
  scene.floor = {up_for(pitch_rad, roll_rad), height_m};
  return scene;
}

PlaneEstimate estimate(const Scene& scene, unsigned seed = 1, const GravityPrior& prior = {}) {
  auto state = std::make_unique<DepthPlaneState>();
  return estimate_floor({}, scene.k, render(scene, seed).view(), prior, *state);
}

void expect_close(const PlaneEstimate& e, const Surface& truth, float height_m = 0.01f, float degrees = 0.5f) {
  ASSERT_TRUE(e.valid);
  EXPECT_NEAR(e.height_m, truth.height_m, height_m);
  EXPECT_LT(angle_deg(e.normal_cam, truth.normal_cam), degrees);
}

TEST(DepthPlane, FindsTheFloorAtManyHeightsAndTilts) {
  for (const float height_m : {0.4f, 1.f, 2.f, 3.f})
    for (const float pitch_rad : {0.3f, 0.6f, 0.9f, 1.3f})
      for (const float roll_rad : {-0.3f, 0.f, 0.3f}) {
        SCOPED_TRACE(testing::Message() << height_m << " m, pitch " << pitch_rad << ", roll " << roll_rad);
        const Scene scene = floor_scene(height_m, pitch_rad, roll_rad);
        expect_close(estimate(scene), scene.floor, 0.005f * height_m + 0.002f, 0.3f);
      }
}

TEST(DepthPlane, FindsASmallFloorBelowALargeWallAndBoxes) {
  Scene scene = floor_scene(1.2f, 0.05f);
  scene.walls = {{Vec3(0.f, std::sin(0.05f), -std::cos(0.05f)), 3.5f}};
  scene.patches = {{100, 250, 300, 480, {Vec3(0.f, 0.f, -1.f), 1.5f}},
                   {350, 200, 420, 480, {Vec3(0.3f, 0.f, -0.95f).normalized(), 2.f}}};
  expect_close(estimate(scene), scene.floor, 0.025f, 0.7f);  // a band of floor 2.3 to 3.5 m away
}

TEST(DepthPlane, PrefersTheFloorToALargerTableAboveIt) {
  Scene scene = floor_scene(1.5f, 0.6f);
  scene.patches = {{160, 160, 640, 480, {up_for(0.6f, 0.f), 0.75f}}};  // half of the image
  expect_close(estimate(scene), scene.floor, 0.02f, 0.7f);
}

TEST(DepthPlane, SurvivesClutterAndMissingPixels) {
  Scene scene = floor_scene(1.f, 0.5f);
  scene.clutter_share = 0.4f;
  scene.missing_share = 0.5f;
  expect_close(estimate(scene), scene.floor);
}

TEST(DepthPlane, RefusesAWall) {
  Scene scene;
  scene.has_floor = false;
  for (const float pitch_rad : {0.f, 0.2f, 0.5f}) {
    scene.walls = {{Vec3(0.f, std::sin(pitch_rad), -std::cos(pitch_rad)), 2.f}};
    EXPECT_FALSE(estimate(scene).valid) << pitch_rad;
  }
  scene.walls = {{Vec3(-1.f, 0.f, 0.f), 1.f}, {Vec3(1.f, 0.f, 0.f), 1.f}};
  EXPECT_FALSE(estimate(scene).valid);
}

TEST(DepthPlane, RefusesATableTopWithTheFloorInView) {
  Scene scene = floor_scene(1.5f, 0.6f);
  scene.patches = {{0, 0, 640, 440, {up_for(0.6f, 0.f), 0.7f}}};
  scene.patches.push_back({0, 0, 60, 440, {up_for(0.6f, 0.5f), 2.5f}, true});  // not one plane, but below
  const PlaneEstimate e = estimate(scene);
  EXPECT_FALSE(e.valid && std::abs(e.height_m - 0.7f) < 0.1f);
}

TEST(DepthPlane, RefusesClutterWithoutAPlane) {
  Scene scene = floor_scene(1.f, 0.5f);
  scene.clutter_share = 1.f;
  EXPECT_FALSE(estimate(scene).valid);
}

TEST(DepthPlane, MeasuredGravityTellsALevelFloorFromAFacingWall) {
  // Seen by a camera that looks straight down, a floor and a wall are the same image; gravity decides.
  const Scene scene = floor_scene(1.f, 1.5708f);
  const GravityPrior down{.up_cam = {0.f, 0.f, -1.f}, .max_angle_rad = 0.23f, .measured = true};
  const GravityPrior ahead{.up_cam = {0.f, -1.f, 0.f}, .max_angle_rad = 0.23f, .measured = true};
  expect_close(estimate(scene, 1, down), scene.floor);
  EXPECT_FALSE(estimate(scene, 1, ahead).valid);
}

TEST(DepthPlane, WorksForOtherImageSizesAndADistortedLensTable) {
  Scene scene = floor_scene(1.f, 0.6f);
  scene.k = {.width_px = 160, .height_px = 120, .fx_px = 131.f, .fy_px = 131.f, .cx_px = 79.5f, .cy_px = 59.5f};
  expect_close(estimate(scene), scene.floor);
  scene.k = {.width_px = 32, .height_px = 24, .fx_px = 26.f, .fy_px = 26.f, .cx_px = 15.5f, .cy_px = 11.5f};
  expect_close(estimate(scene), scene.floor, 0.02f, 1.f);
}

/// Failure: no estimate, or a height off by more than 2 cm + 1 %, or a normal off by more than 1 degree.
TEST(DepthPlane, TenThousandSeededRunsOnASyntheticFloorDoNotFail) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0.f, 1.f);
  auto state = std::make_unique<DepthPlaneState>();
  int failures = 0;
  for (int scene_index = 0; scene_index < 50; ++scene_index) {
    Scene scene =
        floor_scene(0.4f + 2.f * uniform(random), 0.35f + 0.7f * uniform(random), 0.4f * uniform(random) - 0.2f);
    scene.clutter_share = 0.4f * uniform(random);
    scene.missing_share = 0.4f * uniform(random);
    const DepthImage image = render(scene, static_cast<unsigned>(scene_index));
    for (unsigned run = 0; run < 200; ++run) {
      state->random.state = run * 7919u + 1u;
      state->warm = false;
      const PlaneEstimate e = estimate_floor({}, scene.k, image.view(), {}, *state);
      failures += !e.valid || std::abs(e.height_m - scene.floor.height_m) > 0.02f + 0.01f * scene.floor.height_m ||
                  angle_deg(e.normal_cam, scene.floor.normal_cam) > 1.f;
    }
  }
  EXPECT_EQ(failures, 0);
}

TEST(DepthPlane, ReplaysToTheBit) {
  const Scene scene = floor_scene(1.1f, 0.5f);
  auto first = std::make_unique<DepthPlaneState>(), second = std::make_unique<DepthPlaneState>();
  for (unsigned frame = 0; frame < 5; ++frame) {
    const DepthImage image = render(scene, frame);
    std::memcpy(static_cast<void*>(second.get()), first.get(), sizeof *first);
    const PlaneEstimate a = estimate_floor({}, scene.k, image.view(), {}, *first);
    const PlaneEstimate b = estimate_floor({}, scene.k, image.view(), {}, *second);
    EXPECT_EQ(std::memcmp(&a.normal_cam, &b.normal_cam, sizeof a.normal_cam), 0);
    EXPECT_EQ(a.height_m, b.height_m);
    EXPECT_EQ(a.rms_m, b.rms_m);
    EXPECT_EQ(first->random.state, second->random.state);
  }
}

TEST(DepthPlane, BadInputIsInvalidAndHarmless) {
  const Intrinsics k;
  auto state = std::make_unique<DepthPlaneState>();
  const DepthImage image = render(floor_scene(1.f, 0.6f), 1);
  const auto run = [&](const DepthPlaneParams& params, const Intrinsics& intrinsics, const DepthView& view,
                       const GravityPrior& prior) {
    return estimate_floor(params, intrinsics, view, prior, *state).valid;
  };
  ASSERT_TRUE(run({}, k, image.view(), {}));
  EXPECT_FALSE(run({}, k, {}, {}));
  EXPECT_FALSE(run({}, k, {image.mm.data(), 640, 480, 320}, {}));
  EXPECT_FALSE(run({}, k, {image.mm.data(), 320, 240, 320}, {}));
  EXPECT_FALSE(run({}, {.width_px = 8, .height_px = 8}, {image.mm.data(), 8, 8, 8}, {}));
  EXPECT_FALSE(run({}, {.fx_px = std::nanf("")}, image.view(), {}));
  DepthPlaneParams params;
  params.sensor_sigma_per_m = std::nanf("");
  EXPECT_FALSE(run(params, k, image.view(), {}));
  params = {};
  params.range.min_m = std::nanf("");
  EXPECT_FALSE(run(params, k, image.view(), {}));
  EXPECT_FALSE(run({}, k, image.view(), {.up_cam = Vec3::Zero()}));
  EXPECT_FALSE(run({}, k, image.view(), {.max_angle_rad = std::nanf("")}));
  for (const int fill : {0, 65535, 1000, 1}) {
    const std::vector<std::uint16_t> flat(640 * 480, static_cast<std::uint16_t>(fill));
    EXPECT_FALSE(run({}, k, {flat.data(), 640, 480, 640}, {})) << fill;
  }
}

TEST(DepthPlane, RandomPixelsAndParametersNeverYieldNonsense) {
  std::mt19937 random(3);
  auto state = std::make_unique<DepthPlaneState>();
  std::vector<std::uint16_t> pixels(64 * 48);
  for (int run = 0; run < 2000; ++run) {
    for (auto& p : pixels) p = static_cast<std::uint16_t>(random() >> (random() % 16));
    Intrinsics k{.width_px = 64, .height_px = 48, .fx_px = 50.f, .fy_px = 50.f, .cx_px = 32.f, .cy_px = 24.f};
    k.k1 = static_cast<float>(random() % 200) / 100.f - 1.f;
    const PlaneEstimate e = estimate_floor({}, k, {pixels.data(), 64, 48, 64}, {}, *state);
    EXPECT_TRUE(std::isfinite(e.height_m + e.rms_m + e.normal_cam.sum()));
    if (e.valid) {
      EXPECT_NEAR(e.normal_cam.norm(), 1.f, 1e-3f);
    }
  }
}

}  // namespace
}  // namespace wasp::vision
