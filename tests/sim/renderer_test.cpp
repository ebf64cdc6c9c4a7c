#include "sim/renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "sim/lab_world.h"
#include "tests/sim/optics_scenes.h"
#include "types/units.h"

namespace wasp::sim {
namespace {

struct Images {
  std::vector<float> luminance, depth_m;
};

Images render(const Renderer& renderer, const CameraPose& pose) {
  const auto pixels = static_cast<std::size_t>(renderer.width_px()) * static_cast<std::size_t>(renderer.height_px());
  Images images{std::vector<float>(pixels), std::vector<float>(pixels)};
  for (int row = 0; row < renderer.height_px(); row += Renderer::kBandRows) {
    const auto at = static_cast<std::size_t>(row) * static_cast<std::size_t>(renderer.width_px());
    renderer.render_band(pose, row, images.luminance.data() + at, images.depth_m.data() + at);
  }
  return images;
}

CameraPose over_the_floor(float height_m, double pitch_down_deg, const Euler& body = {}) {
  const Mat3 R =
      quat_from_euler(body).toRotationMatrix() * R_body_cam_from_pitch_down(to_radians(Degrees{pitch_down_deg}));
  return {Vec3(0.05f, 0, -height_m), R};
}

/// Largest difference from the depth of the floor plane z = 0 over the rows given, in metres.
double worst_plane_error(const Images& images, const CameraPose& pose, const Intrinsics& k, int first_row) {
  double worst = 0;
  for (int v = first_row; v < k.height_px; ++v)
    for (int u = 0; u < k.width_px; ++u) {
      const Eigen::Vector3d ray((u - 319.5) / 525, (v - 239.5) / 525, 1);
      const double down = (pose.R_ned_cam.cast<double>() * ray).z();
      const double expected = -static_cast<double>(pose.position_ned_m.z()) / down;
      const auto at = static_cast<std::size_t>(v) * static_cast<std::size_t>(k.width_px) + static_cast<std::size_t>(u);
      worst = std::max(worst, std::abs(static_cast<double>(images.depth_m[at]) - expected));
    }
  return worst;
}

class RendererTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { renderer_ = std::make_unique<Renderer>(make_lab({}), Intrinsics{}); }
  static void TearDownTestSuite() { renderer_.reset(); }
  inline static std::unique_ptr<Renderer> renderer_;
};

TEST_F(RendererTest, DepthOfTheFloorIsTheAnalyticPlane) {
  for (const float height : {0.2f, 0.5f, 1.0f}) {
    const CameraPose down = over_the_floor(height, 90), pitched = over_the_floor(height, 30);
    EXPECT_LT(worst_plane_error(render(*renderer_, down), down, {}, 0), 1e-4) << height << " m, straight down";
    EXPECT_LT(worst_plane_error(render(*renderer_, pitched), pitched, {}, 200), 5e-4)
        << height << " m, pitched 30 degrees";
  }
}

TEST_F(RendererTest, DepthStaysTrueWithTheBodyTilted) {
  const CameraPose pose = over_the_floor(1, 30, {0.15f, -0.1f, 0.4f});
  EXPECT_LT(worst_plane_error(render(*renderer_, pose), pose, {}, 240), 5e-4);
}

TEST_F(RendererTest, EveryPixelSeesTheRoom) {
  for (const float yaw : {0.f, 1.6f, 3.1f, -1.6f}) {
    const Images images = render(*renderer_, over_the_floor(1.2f, 0, {0, 0, yaw}));
    for (const float depth : images.depth_m) {
      ASSERT_GT(depth, 0.f) << "yaw " << yaw;
      ASSERT_LT(depth, 16.f);
    }
  }
}

TEST_F(RendererTest, TheFloorHasTexture) {
  const Images images = render(*renderer_, over_the_floor(0.5f, 30));
  double sum = 0, squares = 0;
  for (const float pixel : images.luminance) {
    const auto value = static_cast<double>(pixel);
    sum += value, squares += value * value;
  }
  const double n = static_cast<double>(images.luminance.size()), mean = sum / n;
  EXPECT_GT(mean, 40);
  EXPECT_LT(mean, 215);
  EXPECT_GT(std::sqrt(squares / n - mean * mean), 10);
}

TEST_F(RendererTest, TwoMetresOfFloorAroundTheStartAreFree) {
  for (int degrees = 0; degrees < 360; degrees += 30) {
    const CameraPose pose = over_the_floor(0.1f, 0, {0, 0, static_cast<float>(degrees) * 0.0174533f});
    const Images images = render(*renderer_, pose);
    for (int v = 100; v < 240; ++v)
      for (int u = 0; u < 640; ++u)
        ASSERT_GT(images.depth_m[static_cast<std::size_t>(v * 640 + u)] *
                      std::hypot(1.f, (static_cast<float>(u) - 319.5f) / 525),
                  2.0f)
            << "heading " << degrees;
  }
}

TEST_F(RendererTest, SameSeedSameRoomOtherSeedAnother) {
  const CameraPose pose = over_the_floor(1, 20);
  const Images first = render(*renderer_, pose), again = render(Renderer(make_lab({}), Intrinsics{}), pose);
  const Images other = render(Renderer(make_lab({.seed = 2}), Intrinsics{}), pose);
  EXPECT_EQ(first.luminance, again.luminance);
  EXPECT_EQ(first.depth_m, again.depth_m);
  EXPECT_NE(first.depth_m, other.depth_m);
}

TEST(Renderer, UndistortsItsRays) {
  Intrinsics k;
  k.k1 = -0.2f;
  const Renderer straight(make_lab({}), Intrinsics{}), bent(make_lab({}), k);
  const CameraPose pose = over_the_floor(1, 90);
  const Images a = render(straight, pose), b = render(bent, pose);
  // A ray at normalised x lands at x (1 + k1 x^2): the corner pixel of a barrel lens looks further out.
  EXPECT_EQ(a.depth_m[240 * 640 + 320], b.depth_m[240 * 640 + 320]);
  const CameraPose wall = over_the_floor(1.2f, 0);
  EXPECT_NE(render(straight, wall).luminance, render(bent, wall).luminance);
}

TEST(Renderer, NoRaySlipsThroughAFacesDiagonal) {
  World world = glowing_world();
  add_board(world, {8, 0, 0}, 90, 90, 20);
  Renderer renderer(std::move(world), pinhole(160, 64, 260));  // pixels (u, u - 48) look exactly along a diagonal
  CastFrame frame = renderer.frame();
  renderer.cast(northward(), frame);
  for (const float range : frame.range) ASSERT_FLOAT_EQ(range, 8);
}

TEST(Renderer, RefusesSizesThatAreNotMultiplesOfFour) {
  Intrinsics k;
  k.width_px = 642;
  EXPECT_THROW(Renderer(make_lab({}), k), std::runtime_error);
}

}  // namespace
}  // namespace wasp::sim
