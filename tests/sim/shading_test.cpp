#include "sim/shading.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/lab_world.h"
#include "sim/random.h"

namespace wasp::sim {
namespace {

TEST(Shading, SixteenRaysAtOnceSeeWhatOneByOneWouldSee) {
  const World world = make_lab({});
  Random random(5);
  double worst = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const Surface& surface = world.surfaces[random.bits() % world.surfaces.size()];
    PacketHits hits;
    hits.eye_ned_m = Vec3(static_cast<float>(random.uniform(-3, 7)), static_cast<float>(random.uniform(-4, 4)), -1);
    hits.pixel = static_cast<float>(random.uniform(1e-3, 1e-2));
    for (int i = 0; i < 16; ++i) {
      hits.dir_x[i] = static_cast<float>(random.uniform(-1, 1)), hits.dir_y[i] = static_cast<float>(random.normal());
      hits.dir_z[i] = static_cast<float>(random.uniform(-1, 1)),
      hits.range[i] = static_cast<float>(random.uniform(0.1, 9));
    }
    const std::uint32_t lanes = random.bits() & 0xffff;
    alignas(64) float out[16];
    for (float& value : out) value = -7;
    shade_lanes(world, surface, hits, lanes, out);
    for (int i = 0; i < 16; ++i) {
      if ((lanes >> i & 1) == 0) {
        ASSERT_EQ(out[i], -7) << "a ray of another face keeps its value";
        continue;
      }
      const float one = shade_reference(world, surface, hits.eye_ned_m, {hits.dir_x[i], hits.dir_y[i], hits.dir_z[i]},
                                        hits.range[i], hits.pixel);
      worst = std::max(worst, static_cast<double>(std::fabs(out[i] - one)));
    }
  }
  // Texture coordinates reach some hundred texels, where a float's last bit moves a sample by a few hundredths.
  EXPECT_LT(worst, 0.5);
}

TEST(Texture, SamplesBlendNeighboursAndWrapAround) {
  const Texture texture(4, [](int u, int) { return u / 4.0; });
  EXPECT_NEAR(texture.sample(0.125f, 0.5f, 1), 0, 0.01);
  EXPECT_NEAR(texture.sample(0.375f, 0.5f, 1), 64, 0.51);
  EXPECT_NEAR(texture.sample(0.25f, 0.5f, 1), 32, 0.51) << "half way between two texels";
  EXPECT_NEAR(texture.sample(1.0f, 0.5f, 1), 0.5 * 191, 0.6) << "between the last and the first";
  EXPECT_NEAR(texture.sample(-0.625f, 0.5f, 1), texture.sample(0.375f, 0.5f, 1), 1e-3);
  EXPECT_NEAR(texture.sample(0.3f, 0.3f, 100), 96, 1) << "far away only the mean is left";
}

}  // namespace
}  // namespace wasp::sim
