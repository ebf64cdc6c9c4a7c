#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/optics_scenes.h"

namespace wasp::sim {
namespace {

constexpr int kWidth = 96, kHeight = 64, kTimes = 4;

/// Boards at several angles, a thin post, one before the other.
std::shared_ptr<const WorldScene> boards() {
  World world = glowing_world();
  add_board(world, {6, 0, 0}, 30, 30, 30);
  add_board(world, {3, -0.5f, 0.1f}, 0.7f, 0.5f, 200, 0.2f);
  add_board(world, {3, 0.6f, -0.1f}, 0.5f, 0.6f, 120, 0.7f);
  add_board(world, {2, 0.1f, 0}, 0.1f, 1.5f, 240, 0.05f);
  return std::make_shared<const WorldScene>(std::move(world));
}

CastFrame cast(Renderer& renderer, bool smooth) {
  CastFrame frame = renderer.frame();
  renderer.cast(northward(), frame);
  if (smooth) renderer.antialias(northward(), frame);
  return frame;
}

/// The mean of 4 x 4 rays in every pixel.
std::vector<float> truth(const std::shared_ptr<const WorldScene>& scene) {
  Renderer fine(scene, {LensKind::kPinhole, pinhole(kTimes * kWidth, kTimes * kHeight, kTimes * 90), {}}, 3);
  const CastFrame frame = cast(fine, false);
  std::vector<float> mean(kWidth * kHeight);
  for (int v = 0; v < kTimes * kHeight; ++v)
    for (int u = 0; u < kTimes * kWidth; ++u)
      mean[static_cast<std::size_t>(v / kTimes * kWidth + u / kTimes)] +=
          frame.luminance[static_cast<std::size_t>(v * kTimes * kWidth + u)] / (kTimes * kTimes);
  return mean;
}

double error_of(const CastFrame& frame, const std::vector<float>& truth) {
  double squares = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    squares += std::pow(static_cast<double>(frame.luminance[i] - truth[i]), 2);
  return std::sqrt(squares / static_cast<double>(truth.size()));
}

TEST(Antialias, EdgesComeCloserToTheMeanOfSixteenRays) {
  const auto scene = boards();
  Renderer renderer(scene, {LensKind::kPinhole, pinhole(kWidth, kHeight, 90), {}}, 3);
  const std::vector<float> mean = truth(scene);
  const double rough = error_of(cast(renderer, false), mean), smooth = error_of(cast(renderer, true), mean);
  EXPECT_GT(rough, 5) << "there are edges to smooth";
  EXPECT_LT(smooth, 0.4 * rough);
}

TEST(Antialias, DepthAndWhatIsNoEdgeStayAsTheyWere) {
  Renderer renderer(boards(), {LensKind::kPinhole, pinhole(kWidth, kHeight, 90), {}}, 3);
  const CastFrame rough = cast(renderer, false), smooth = cast(renderer, true);
  EXPECT_EQ(rough.range, smooth.range);
  EXPECT_EQ(rough.face, smooth.face);
  std::size_t changed = 0;
  for (std::size_t i = 0; i < rough.luminance.size(); ++i) changed += rough.luminance[i] != smooth.luminance[i];
  EXPECT_GT(changed, 0u);
  EXPECT_LE(changed, renderer.edge_pixels());
  EXPECT_LT(renderer.edge_pixels(), rough.luminance.size() / 4);
}

TEST(Antialias, BordersBetweenFacesThatLookAlikeCostNothing) {
  World world = glowing_world();
  add_board(world, {2, -5, 0}, 10, 10, 100);
  add_board(world, {2, 5, 0}, 10, 10, 101);
  Renderer renderer(std::make_shared<const WorldScene>(std::move(world)),
                    {LensKind::kPinhole, pinhole(kWidth, kHeight, 90), {}}, 3);
  cast(renderer, true);
  EXPECT_EQ(renderer.edge_pixels(), 0u);
}

}  // namespace
}  // namespace wasp::sim
