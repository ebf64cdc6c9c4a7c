#include "vision/kernels/derotate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"

namespace wasp::vision {
namespace {

Lens pinhole(float k1 = 0) {
  Lens lens;
  lens.intrinsics.k1 = k1;
  return lens;
}

Lens fisheye() {
  Lens lens;
  lens.kind = LensKind::kFisheye;
  lens.intrinsics.fx_px = lens.intrinsics.fy_px = 240.f;
  lens.fisheye_k = {-0.02f, 0.004f, -0.001f, 0.f};
  return lens;
}

/// Flow of points at `depth_m` along their ray when the camera turns and then moves.
FlowField flow_of(const Lens& lens, const Vec3& turn, const Vec3& moved_m, float depth_m) {
  const Mat3 R_first_second = turn.norm() > 0
                                  ? Mat3(Eigen::AngleAxisf(turn.norm(), turn.normalized()).toRotationMatrix())
                                  : Mat3(Mat3::Identity());
  FlowField field;
  for (int r = 0; r < field.rows; ++r)
    for (int c = 0; c < field.columns; ++c) {
      FlowCell& cell = field.at(c, r);
      cell.x_px = 26.f + 53.f * static_cast<float>(c);
      cell.y_px = 26.f + 53.f * static_cast<float>(r);
      Vec3 d;
      Pixel end;
      if (!direction_of(lens, {cell.x_px, cell.y_px}, d)) continue;
      if (!pixel_of(lens, R_first_second.transpose() * (d * depth_m - moved_m), end)) continue;
      cell.u_px = end.u_px - cell.x_px;
      cell.v_px = end.v_px - cell.y_px;
      cell.valid = 1;
    }
  return field;
}

TEST(Derotate, TakesAPureRotationAwayForEveryLens) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> rate(-2.f, 2.f);
  for (const Lens& lens : {pinhole(), pinhole(-0.15f), fisheye()})
    for (int i = 0; i < 50; ++i) {
      const Vec3 omega(rate(random), rate(random), rate(random));
      FlowField out;
      derotate(lens, flow_of(lens, omega * 0.05f, Vec3::Zero(), 1.f), omega, 0.05f, out);
      for (const FlowCell& cell : out.cells) {
        if (cell.valid == 0) continue;
        ASSERT_NEAR(cell.u_px, 0.f, 0.02f);
        ASSERT_NEAR(cell.v_px, 0.f, 0.02f);
      }
    }
}

TEST(Derotate, LeavesTheTranslationalPart) {
  for (const Lens& lens : {pinhole(), fisheye()}) {
    const Vec3 omega(0.4f, -0.8f, 0.6f), moved(0.02f, -0.03f, 0.1f);
    const FlowField still = flow_of(lens, Vec3::Zero(), moved, 3.f);
    FlowField out;
    derotate(lens, flow_of(lens, omega * 0.05f, moved, 3.f), omega, 0.05f, out);
    for (int i = 0; i < out.count(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (out.cells[k].valid == 0 || still.cells[k].valid == 0) continue;
      EXPECT_NEAR(out.cells[k].u_px, still.cells[k].u_px, 0.02f);
      EXPECT_NEAR(out.cells[k].v_px, still.cells[k].v_px, 0.02f);
    }
  }
}

TEST(Derotate, FirstOrderFormHasTheSignsOfTheMotion) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> any(-1.f, 1.f);
  for (int i = 0; i < 200; ++i) {
    const Ray e{0.5f * any(random), 0.4f * any(random)};
    const Vec3 omega(any(random), any(random), any(random));
    constexpr float kStep = 1e-3f;
    const Vec3 end = Eigen::AngleAxisf(-kStep * omega.norm(), omega.normalized()) * Vec3(e.x, e.y, 1.f);
    const auto flow = rotational_flow(e, omega);
    EXPECT_NEAR((end.x() / end.z() - e.x) / kStep, flow[0], 5e-3f);
    EXPECT_NEAR((end.y() / end.z() - e.y) / kStep, flow[1], 5e-3f);
  }
}

TEST(Derotate, LensesInvert) {
  for (const Lens& lens : {pinhole(), pinhole(-0.15f), fisheye()})
    for (float u = 0; u < 640.f; u += 37.f)
      for (float v = 0; v < 480.f; v += 31.f) {
        Vec3 d;
        Pixel back;
        ASSERT_TRUE(direction_of(lens, {u, v}, d));
        EXPECT_NEAR(d.norm(), 1.f, 1e-5f);
        ASSERT_TRUE(pixel_of(lens, d, back));
        EXPECT_NEAR(back.u_px, u, 0.01f);
        EXPECT_NEAR(back.v_px, v, 0.01f);
      }
  Pixel pixel;
  EXPECT_FALSE(pixel_of(pinhole(), {0.f, 0.f, -1.f}, pixel));
  EXPECT_FALSE(pixel_of(pinhole(), Vec3::Zero(), pixel));
  EXPECT_TRUE(pixel_of(fisheye(), {1.f, 0.f, 0.f}, pixel));  // 90 degrees off the axis
}

TEST(Derotate, BadInputGivesNoFlow) {
  const FlowField field = flow_of(pinhole(), Vec3::Zero(), {0.1f, 0, 0}, 2.f);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  FlowField out;
  const auto none_valid = [&out] {
    for (const FlowCell& cell : out.cells)
      if (cell.valid != 0) return false;
    return true;
  };
  derotate(pinhole(), field, Vec3(nan, 0, 0), 0.05f, out);
  EXPECT_TRUE(none_valid());
  derotate(pinhole(), field, Vec3(0, 0, 0), 0.f, out);
  EXPECT_TRUE(none_valid());
  derotate(pinhole(), field, Vec3(100, 0, 0), 0.05f, out);
  EXPECT_TRUE(none_valid());
  Lens broken = pinhole();
  broken.intrinsics.fx_px = 0.f;
  derotate(broken, field, Vec3(0, 0, 0), 0.05f, out);
  EXPECT_TRUE(none_valid());
  FlowField strange = field;
  strange.cells[3].u_px = nan;
  derotate(pinhole(), strange, Vec3(0, 0, 1), 0.05f, out);
  EXPECT_EQ(out.cells[3].valid, 0);
  EXPECT_EQ(out.cells[4].valid, 1);
}

TEST(Derotate, TakesNoMemory) {
  FlowField field = flow_of(fisheye(), Vec3::Zero(), {0.1f, 0, 0}, 2.f);
  const test::MallocCount count;
  {
    const rt::RealtimeSection section;
    derotate(fisheye(), field, Vec3(0.1f, 0.2f, 0.3f), 0.05f, field);
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
