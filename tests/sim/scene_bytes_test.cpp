#include "sim/scene_bytes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>
#include <stdexcept>

#include "sim/random.h"

namespace wasp::sim {
namespace {

Scene with_moving_parts() {
  Scene scene = make_scene("corridor-obstacles", 4);
  if (scene.world.movers.empty()) scene = make_scene("arena-step", 4);
  scene.title = "a title";
  return scene;
}

class BytesOfAScene : public testing::TestWithParam<SceneKind> {};

TEST_P(BytesOfAScene, ComesBackToTheBit) {
  const Scene scene = GetParam().make({.seed = 5});
  const auto bytes = scene_bytes(scene);
  const Scene again = scene_of_bytes(bytes);
  EXPECT_EQ(scene_bytes(again), bytes);
  EXPECT_EQ(again.title, scene.title);
  ASSERT_EQ(again.world.textures.size(), scene.world.textures.size());
  for (std::size_t i = 0; i < scene.world.textures.size(); ++i) {
    const Texture &a = scene.world.textures[i], &b = again.world.textures[i];
    ASSERT_EQ(a.offsets(), b.offsets());
    const auto size = static_cast<std::size_t>(a.offsets().back()) + 2;
    EXPECT_EQ(std::memcmp(a.texels(), b.texels(), size), 0) << "all its levels";
  }
  ASSERT_EQ(again.world.movers.size(), scene.world.movers.size());
  for (std::size_t i = 0; i < scene.world.movers.size(); ++i)
    EXPECT_EQ(again.world.movers[i].name, scene.world.movers[i].name);
}

INSTANTIATE_TEST_SUITE_P(EveryKind, BytesOfAScene, testing::ValuesIn(scene_kinds().begin(), scene_kinds().end()),
                         [](const auto& of) {
                           std::string name = of.param.name;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST(SceneBytes, EveryCutIsRefused) {
  const auto bytes = scene_bytes(make_scene("wall", 1));
  for (std::size_t n = 0; n < bytes.size(); n += 1 + n / 8)
    EXPECT_THROW(scene_of_bytes(std::span(bytes).first(n)), std::runtime_error) << n;
  auto longer = bytes;
  longer.push_back(0);
  EXPECT_THROW(scene_of_bytes(longer), std::runtime_error);
}

TEST(SceneBytes, AWorldThatDoesNotHoldTogetherIsRefusedByItsReason) {
  const std::vector<std::pair<const char*, std::function<void(World&)>>> cases = {
      {"corner", [](World& w) { w.quads[0][3] = static_cast<std::uint32_t>(w.vertices_ned_m.size()); }},
      {"surface", [](World& w) { w.surfaces.pop_back(); }},
      {"texture", [](World& w) { w.surfaces[0].texture = static_cast<std::int32_t>(w.textures.size()); }},
      {"texture", [](World& w) { w.surfaces[0].texture = -1; }},
      {"finite", [](World& w) { w.vertices_ned_m[0][1] = std::numeric_limits<float>::quiet_NaN(); }},
      {"path", [](World& w) { w.movers[0].keys.clear(); }},
      {"path", [](World& w) { w.movers[0].keys.back().at_s = -1; }},
      {"faces", [](World& w) { w.movers.back().quad_count += 1; }},
  };
  for (const auto& [reason, damage] : cases) {
    Scene scene = with_moving_parts();
    ASSERT_FALSE(scene.world.movers.empty());
    damage(scene.world);
    try {
      scene_of_bytes(scene_bytes(scene));
      ADD_FAILURE() << reason;
    } catch (const std::runtime_error& e) {
      EXPECT_NE(std::string(e.what()).find(reason), std::string::npos) << e.what();
    }
  }
}

TEST(SceneBytes, RandomDamageIsRefusedOrStillAWorldThatHoldsTogether) {
  const auto bytes = scene_bytes(with_moving_parts());
  Random random(11);
  for (int trial = 0; trial < 300; ++trial) {
    auto damaged = bytes;
    for (int i = 0; i < 3; ++i)
      damaged[static_cast<std::size_t>(random.uniform(0, static_cast<double>(damaged.size())))] =
          static_cast<std::uint8_t>(random.bits());
    try {
      const Scene scene = scene_of_bytes(damaged);
      for (const auto& quad : scene.world.quads)
        for (const auto i : quad) ASSERT_LT(i, scene.world.vertices_ned_m.size());
    } catch (const std::runtime_error&) {
    }
  }
}

}  // namespace
}  // namespace wasp::sim
