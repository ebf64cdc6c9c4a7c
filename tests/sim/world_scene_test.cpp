#include "sim/world_scene.h"

#include <gtest/gtest.h>

#include "sim/renderer.h"
#include "sim/scene.h"
#include "types/units.h"

namespace wasp::sim {
namespace {

constexpr Intrinsics kCamera{
    .width_px = 160, .height_px = 120, .fx_px = 110, .fy_px = 110, .cx_px = 79.5f, .cy_px = 59.5f};

struct Picture {
  std::vector<float> luminance = std::vector<float>(160 * 120), depth_m = std::vector<float>(160 * 120);
};

Picture picture(const Renderer& renderer, double at_s) {
  const WorldScene::Moment moment = renderer.scene().at(at_s);
  Picture p;
  for (int row = 0; row < 120; row += Renderer::kBandRows)
    renderer.render_band({Vec3(2, 0.1f, -1.2f), R_body_cam_from_pitch_down(Radians{0.1})}, row,
                         p.luminance.data() + row * 160, p.depth_m.data() + row * 160);
  return p;
}

int different(const Picture& a, const Picture& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.depth_m.size(); ++i)
    count += std::abs(a.depth_m[i] - b.depth_m[i]) > 1e-3f * (1 + a.depth_m[i]) ||
                     std::abs(a.luminance[i] - b.luminance[i]) > 1.5f
                 ? 1
                 : 0;
  return count;
}

class MovingKinds : public testing::TestWithParam<const char*> {};

TEST_P(MovingKinds, ShowTheSameAsAWorldBuiltForThatMoment) {
  const World world = placed_at_start(make_scene(GetParam(), 4));
  ASSERT_FALSE(world.movers.empty());
  const Renderer moving(world, kCamera);
  for (const double t : {0.0, 5.3, 10.01, 31.0, 5.3}) {
    const Renderer still(world.at(t), kCamera);
    EXPECT_LT(different(picture(moving, t), picture(still, 0)), 40) << "at " << t << ": rounding at edges only";
  }
  EXPECT_GT(different(picture(moving, 0), picture(moving, 14)), 150) << "something did move";
}

INSTANTIATE_TEST_SUITE_P(Kinds, MovingKinds, testing::Values("arena-step", "corridor-people"),
                         [](const auto& kind) { return std::string(kind.param).substr(0, 5); });

TEST(WorldScene, TwoCamerasAtDifferentTimesTakeTurns) {
  const auto scene = std::make_shared<const WorldScene>(placed_at_start(make_scene("corridor-people", 1)));
  auto first = std::make_unique<WorldScene::Moment>(scene->at(1));
  EXPECT_TRUE(first->owns_lock());
  first.reset();
  EXPECT_TRUE(scene->at(2).owns_lock());
  const WorldScene still(placed_at_start(make_scene("ground", 1)));
  EXPECT_FALSE(still.at(1).owns_lock()) << "nothing to wait for where nothing moves";
}

}  // namespace
}  // namespace wasp::sim
