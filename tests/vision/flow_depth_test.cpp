#include "vision/kernels/flow_depth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <random>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"

namespace wasp::vision {
namespace {

/// Depths 1 ... 5 m, by cell.
float depth_at(int cell) { return 1.f + static_cast<float>(cell * 37 % 41) / 10.f; }

FlowField flow_of(const Lens& lens, const CameraStep& camera, float noise_px, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> grain(0.f, 1.f);
  const Vec3 turn = camera.rate_cam_rad_s * camera.interval_s;
  const Mat3 R_first_second = turn.norm() > 0
                                  ? Mat3(Eigen::AngleAxisf(turn.norm(), turn.normalized()).toRotationMatrix())
                                  : Mat3(Mat3::Identity());
  FlowField field;
  for (int i = 0; i < field.count(); ++i) {
    FlowCell& cell = field.cells[static_cast<std::size_t>(i)];
    cell.x_px = 26.f + 53.f * static_cast<float>(i % field.columns);
    cell.y_px = 26.f + 53.f * static_cast<float>(i / field.columns);
    Ray ray;
    unproject(lens.intrinsics, {cell.x_px, cell.y_px}, ray);
    const Vec3 point = Vec3(ray.x, ray.y, 1.f) * depth_at(i);
    Pixel end;
    cell.valid =
        pixel_of(lens, R_first_second.transpose() * (point - camera.velocity_cam_m_s * camera.interval_s), end);
    cell.u_px = end.u_px - cell.x_px + noise_px * grain(random);
    cell.v_px = end.v_px - cell.y_px + noise_px * grain(random);
  }
  return field;
}

TEST(FlowDepth, ExactWithoutNoise) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> any(-1.f, 1.f);
  for (int round = 0; round < 100; ++round) {
    const CameraStep camera{Vec3(any(random), any(random), 2.f * any(random)),
                            Vec3(any(random), any(random), any(random)), 0.1f};
    DepthGrid depth;
    const FlowField flow = flow_of({}, camera, 0.f, 1);
    flow_depth({}, {}, flow, camera, depth);
    for (int i = 0; i < flow.count(); ++i)
      if (depth[static_cast<std::size_t>(i)].valid) {
        ASSERT_NEAR(depth[static_cast<std::size_t>(i)].depth_m / depth_at(i), 1.f, 2e-2f);
      }
  }
}

TEST(FlowDepth, StatesItsOwnUncertainty) {
  const CameraStep camera{Vec3(0.5f, 0.1f, 1.f), Vec3(0.2f, -0.3f, 0.1f), 0.1f};
  double squares = 0, count = 0;
  for (unsigned seed = 0; seed < 50; ++seed) {
    const FlowField flow = flow_of({}, camera, 0.3f, seed);
    DepthGrid depth;
    flow_depth({}, {}, flow, camera, depth);
    for (int i = 0; i < flow.count(); ++i) {
      const DepthCell& cell = depth[static_cast<std::size_t>(i)];
      if (!cell.valid) continue;
      EXPECT_LE(cell.sigma_m, 0.2f * cell.depth_m * 1.001f);
      squares += std::pow(static_cast<double>((cell.depth_m - depth_at(i)) / cell.sigma_m), 2);
      count += 1;
    }
  }
  EXPECT_GT(count, 1000);
  EXPECT_GT(squares / count, 0.6);
  EXPECT_LT(squares / count, 1.5);
}

TEST(FlowDepth, NothingAtTheFocusOrWithoutMotion) {
  const CameraStep ahead{Vec3(0, 0, 1.f), Vec3::Zero(), 0.05f};
  FlowField flow = flow_of({}, ahead, 0.f, 1);
  flow.cells[0].x_px = 319.5f;  // exactly on the focus
  flow.cells[0].y_px = 239.5f;
  flow.cells[0].u_px = flow.cells[0].v_px = 0.f;
  DepthGrid depth;
  flow_depth({}, {}, flow, ahead, depth);
  EXPECT_FALSE(depth[0].valid);
  EXPECT_TRUE(depth[1].valid);
  const CameraStep still{Vec3::Zero(), Vec3(0.1f, 0, 0), 0.05f};
  flow_depth({}, {}, flow, still, depth);
  for (const DepthCell& cell : depth) EXPECT_FALSE(cell.valid);
}

TEST(FlowDepth, APointThatMovesByItselfHasNoDepth) {
  const CameraStep camera{Vec3(1.f, 0, 0), Vec3::Zero(), 0.1f};
  FlowField flow = flow_of({}, camera, 0.f, 1);
  flow.cells[40].v_px += 6.f;
  flow.cells[41].u_px = -flow.cells[41].u_px;
  DepthGrid depth;
  flow_depth({}, {}, flow, camera, depth);
  EXPECT_FALSE(depth[40].valid);
  EXPECT_FALSE(depth[41].valid);
  EXPECT_TRUE(depth[42].valid);
}

TEST(FlowDepthPrinted, AgreesWithTheTruthAndGatesItsSingularRowAndColumn) {
  const CameraStep camera{Vec3(0, 0, 0.4f), Vec3(0.05f, -0.04f, 0.03f), 0.05f};
  FlowField flow = flow_of({}, camera, 0.f, 1);
  auto depth = std::make_unique<PrintedDepthGrid>();
  FlowDepthParams params;
  params.flow_sigma_px = 0.02f;
  flow_depth_printed(params, {}, flow, camera, *depth);
  int used = 0;
  for (int i = 0; i < flow.count(); ++i) {
    const PrintedDepthCell& cell = (*depth)[static_cast<std::size_t>(i)];
    if (cell.valid_u) {
      EXPECT_NEAR(cell.from_u_m / depth_at(i), 1.f, 0.1f) << i;
    }
    if (cell.valid_v) {
      EXPECT_NEAR(cell.from_v_m / depth_at(i), 1.f, 0.1f) << i;
    }
    used += cell.valid_u && cell.valid_v ? 1 : 0;
  }
  EXPECT_GT(used, 60);
  flow.cells[0].x_px = 319.5f;
  flow.cells[0].u_px = 0.f;
  flow_depth_printed(params, {}, flow, {Vec3(0, 0, 0.4f), Vec3::Zero(), 0.05f}, *depth);
  EXPECT_FALSE((*depth)[0].valid_u);
}

TEST(FlowDepth, BadInput) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const CameraStep camera{Vec3(1.f, 0, 0), Vec3::Zero(), 0.1f};
  FlowField flow = flow_of({}, camera, 0.f, 1);
  DepthGrid depth;
  for (const CameraStep& bad :
       {CameraStep{Vec3(nan, 0, 0), Vec3::Zero(), 0.1f}, CameraStep{Vec3(1, 0, 0), Vec3::Zero(), 0},
        CameraStep{Vec3(1, 0, 0), Vec3(0, nan, 0), 0.1f}}) {
    flow_depth({}, {}, flow, bad, depth);
    for (const DepthCell& cell : depth) ASSERT_FALSE(cell.valid);
  }
  flow.columns = 1000;
  flow_depth({}, {}, flow, camera, depth);
  EXPECT_FALSE(depth[0].valid);
}

TEST(FlowDepth, TakesNoMemory) {
  const CameraStep camera{Vec3(1.f, 0, 0), Vec3(0, 0.1f, 0), 0.1f};
  const FlowField flow = flow_of({}, camera, 0.f, 1);
  DepthGrid depth;
  const test::MallocCount count;
  {
    const rt::RealtimeSection section;
    flow_depth({}, {}, flow, camera, depth);
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
