#include "sim/defocus.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/optics_scenes.h"

namespace wasp::sim {
namespace {

constexpr int kWidth = 160, kHeight = 64;
constexpr float kFocal_px = 260;

CastFrame blurred(const std::shared_ptr<const WorldScene>& scene, float aperture_m, float focus_m) {
  Renderer renderer(scene, {LensKind::kPinhole, pinhole(kWidth, kHeight, kFocal_px), {}}, 3);
  CastFrame frame = renderer.frame();
  renderer.cast(northward(), frame);
  if (aperture_m > 0) Defocus({.focus_m = focus_m, .aperture_m = aperture_m}, kFocal_px, kWidth, kHeight).apply(frame);
  return frame;
}

TEST(Defocus, TheCircleOfConfusionIsTheThinLenses) {
  // f = 4 mm, A = 2 mm, focus 2 m, pixel 10 um: sensor at 1 / (1/f - 1/2) = 4.00802 mm; the point at 0.5 m is sharp at
  // 4.03226 mm; the circle is 2 mm (4.03226 - 4.00802) / 4.03226 = 12.02 um = 1.202 px.
  const float sensor_m = 1 / (1 / 0.004f - 1 / 2.f);
  EXPECT_NEAR(circle_of_confusion_px(0.002f, sensor_m / 1e-5f, 2, 0.5f), 1.2024, 1e-3);
  EXPECT_FLOAT_EQ(circle_of_confusion_px(0.002f, 400, 2, 2), 0);
}

TEST(Defocus, AnEdgesWidthGrowsAsTheFormulaSays) {
  constexpr float kAperture_m = 0.02f, kFocus_m = 2;
  for (const float z : {0.7f, 1.f, 1.5f, 4.f, 10.f}) {
    const auto c = static_cast<double>(circle_of_confusion_px(kAperture_m, kFocal_px, kFocus_m, z));
    const EdgeProfile sharp = edge_profile(blurred(split_wall(z), 0, 2), kWidth, 32);
    const EdgeProfile soft = edge_profile(blurred(split_wall(z), kAperture_m, kFocus_m), kWidth, 32);
    EXPECT_NEAR(sharp.deviation_px, 0, 1e-3);
    EXPECT_NEAR(soft.at_px, sharp.at_px, 0.02) << z;
    EXPECT_NEAR(soft.deviation_px, c / 4, 0.02 + 0.05 * c / 4) << "a disc's deviation along a line; z = " << z;
  }
}

TEST(Defocus, InFocusNothingChanges) {
  EXPECT_EQ(blurred(split_wall(2), 0.02f, 2).luminance, blurred(split_wall(2), 0, 2).luminance);
}

/// A board of 200 before a wall of 20, its right edge on the axis.
std::shared_ptr<const WorldScene> board_before_wall(float board_m, float wall_m) {
  World world = glowing_world();
  add_board(world, {wall_m, 0, 0}, 90, 90, 20);
  add_board(world, {board_m, -5, 0}, 10, 10, 200);
  return std::make_shared<const WorldScene>(std::move(world));
}

TEST(Defocus, AnObjectInFocusKeepsItsEdgeBeforeABlurredBackground) {
  const auto scene = board_before_wall(1, 8);
  const CastFrame soft = blurred(scene, 0.02f, 1), sharp = blurred(scene, 0, 1);
  for (std::size_t i = 0; i < sharp.luminance.size(); ++i)
    ASSERT_NEAR(soft.luminance[i], sharp.luminance[i], 1e-3) << i % kWidth << ", " << i / kWidth;
}

TEST(Defocus, ANearBlurredEdgeReachesOverASharpBackground) {
  constexpr float kAperture_m = 0.02f, kNear_m = 1, kFar_m = 4;
  const CastFrame frame = blurred(board_before_wall(kNear_m, kFar_m), kAperture_m, kFar_m);
  const auto c = static_cast<double>(circle_of_confusion_px(kAperture_m, kFocal_px, kFar_m, kNear_m));
  const float* row = frame.luminance.data() + 32 * kWidth;
  for (int u = 0; u + 1 < kWidth; ++u) EXPECT_GE(row[u], row[u + 1] - 0.5f) << u;
  EXPECT_NEAR(0.5f * (row[79] + row[80]), 110, 6) << "half and half on the edge itself";
  EXPECT_NEAR(edge_profile(frame, kWidth, 32).deviation_px, c / 4, 0.1 * c / 4);
  EXPECT_FLOAT_EQ(row[79 + static_cast<int>(c / 2) + 2], 20) << "and no farther than its circle";
}

TEST(Defocus, LightIsNeitherMadeNorLostOnABlurredPlane) {
  const CastFrame frame = blurred(split_wall(0.8f), 0.02f, 2);
  EXPECT_NEAR(frame.luminance[32 * kWidth + 10], 20, 1e-3);
  EXPECT_NEAR(frame.luminance[32 * kWidth + 150], 220, 1e-3);
  EXPECT_NEAR(frame.luminance[0], 20, 1e-3) << "at the image's border too";
}

}  // namespace
}  // namespace wasp::sim
