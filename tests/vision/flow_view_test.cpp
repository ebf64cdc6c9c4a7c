#include "vision/kernels/flow_view.h"

#include <gtest/gtest.h>

#include <limits>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "tests/vision/flow_scene.h"

namespace wasp::vision {
namespace {

using namespace test;

TEST(FlowView, ACameraSeesItselfUnchanged) {
  const FlowScene scene{pinhole(320, 240, 1.2f, 0.3), {ground(), wall_ahead(6.f)}};
  const FlowMessage m = scene.message({Vec3(0, 0, -1), {}}, {Vec3(0.1f, 0, -1), {}}, kSecond);
  FlowField out;
  view_flow(scene.camera.lens(), m.seen, {.focal_px = scene.camera.intrinsics.fx_px, .max_angle_rad = 1.4f}, out);
  for (std::size_t i = 0; i < 108; ++i) {
    ASSERT_EQ(out.cells[i].valid, m.seen.cells[i].valid);
    if (out.cells[i].valid == 0) continue;
    EXPECT_NEAR(out.cells[i].x_px + scene.camera.intrinsics.cx_px, m.seen.cells[i].x_px, 1e-3f);
    EXPECT_NEAR(out.cells[i].u_px, m.seen.cells[i].u_px, 1e-3f);
    EXPECT_NEAR(out.cells[i].v_px, m.seen.cells[i].v_px, 1e-3f);
  }
}

TEST(FlowView, AFisheyeSeesLevelGroundMoveAsASimilarityAndCellsBeyondTheAngleGo) {
  const FlowScene scene{fisheye_down(), {ground()}};
  const FlowMessage m = scene.message({Vec3(0, 0, -1), {}}, {Vec3(0.05f, 0, -1), {}}, kSecond);
  FlowField out;
  view_flow(scene.camera.lens(), m.seen, {.focal_px = 100.f, .max_angle_rad = 0.9f}, out);
  int valid = 0;
  for (const FlowCell& cell : out.cells) {
    if (cell.valid == 0) continue;
    ++valid;
    EXPECT_NEAR(cell.u_px, 0.f, 1e-2f);
    EXPECT_NEAR(cell.v_px, 5.f, 1e-2f);  // the ground slides backwards, which is down in the image
    EXPECT_LT(std::hypot(cell.x_px, cell.y_px), 100.f * std::tan(0.901f));
  }
  EXPECT_GT(valid, 20);
  EXPECT_LT(valid, 90);
}

TEST(FlowFrames, LevelAxesKeepTheHeadingOnly) {
  const std::array<float, 4> q = BodyAt{Vec3::Zero(), {0.2f, -0.3f, 2.f}}.q_ned_body();
  const Vec3 down_body = Quat(q[0], q[1], q[2], q[3]).conjugate() * Vec3(0, 0, 1);
  EXPECT_LT((R_level_body_of(q) * down_body - Vec3(0, 0, 1)).norm(), 1e-5f);
  EXPECT_NEAR((R_level_body_of(q) * Vec3(1, 0, 0)).y(), 0.f, 1e-5f);
}

TEST(FlowFrames, BothFramesComeFromTheMessage) {
  const FlowScene scene{pinhole(320, 240, 1.2f, 0.3), {ground()}};
  const BodyAt a{Vec3(0, 0, -1), {0.2f, -0.3f, 2.f}}, b{Vec3(0, 0, -1), {0.15f, -0.28f, 2.1f}};
  const FlowMessage m = scene.message(a, b, kSecond);
  const FlowFrames f = frames_of(m, scene.camera.R_body_cam);
  ASSERT_TRUE(f.valid);
  EXPECT_NEAR(f.interval_s, 0.033f, 1e-6f);
  EXPECT_LT((f.R_level_first - R_level_body_of(a.q_ned_body())).norm(), 1e-4f);
  EXPECT_LT((f.R_level_second - R_level_body_of(b.q_ned_body())).norm(), 1e-4f);
  const Mat3 R = (quat_from_euler(b.attitude).conjugate() * quat_from_euler(a.attitude)).toRotationMatrix();
  EXPECT_LT((f.R_second_first_body - R).norm(), 1e-4f);
}

TEST(FlowView, BadInput) {
  const FlowScene scene{pinhole(320, 240, 1.2f, 0.3), {ground()}};
  const FlowMessage m = scene.message({Vec3(0, 0, -1), {}}, {Vec3(0.1f, 0, -1), {}}, kSecond);
  const auto any_valid = [&](const Lens& lens, const FlowField& in, const FlowView& view) {
    FlowField out;
    view_flow(lens, in, view, out);
    return std::any_of(out.cells.begin(), out.cells.end(), [](const FlowCell& c) { return c.valid != 0; });
  };
  const Lens lens = scene.camera.lens();
  FlowView bad;
  bad.R_view_first(0, 0) = std::nanf("");
  EXPECT_TRUE(any_valid(lens, m.seen, {}));
  EXPECT_FALSE(any_valid(lens, m.seen, bad));
  EXPECT_FALSE(any_valid(lens, m.seen, {.focal_px = 0.f}));
  FlowField shape = m.seen;
  shape.columns = 5000;
  EXPECT_FALSE(any_valid(lens, shape, {}));
  Lens broken = lens;
  broken.intrinsics.fx_px = std::nanf("");
  EXPECT_FALSE(any_valid(broken, m.seen, {}));
  FlowMessage late = m;
  late.first_exposed_at_ns = std::numeric_limits<TimeNs>::min();
  EXPECT_FALSE(frames_of(late, scene.camera.R_body_cam).valid);
}

TEST(FlowView, DoesNotAllocate) {
  const FlowScene scene{pinhole(320, 240, 1.2f, 0.3), {ground()}};
  const FlowMessage m = scene.message({Vec3(0, 0, -1), {}}, {Vec3(0.1f, 0, -1), {}}, kSecond);
  const Lens lens = scene.camera.lens();
  FlowField out;
  const wasp::test::MallocCount count;
  {
    const rt::RealtimeSection section;
    view_flow(lens, m.seen, {}, out);
    EXPECT_TRUE(frames_of(m, scene.camera.R_body_cam).valid);
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
