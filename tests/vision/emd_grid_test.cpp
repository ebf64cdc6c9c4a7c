#include "vision/kernels/emd_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"

namespace wasp::vision {
namespace {

constexpr int kWidth = 320, kHeight = 240;

std::vector<std::uint8_t> grating(double wavelength_px, double angle_rad, double phase_px, double contrast) {
  std::vector<std::uint8_t> pixels(kWidth * kHeight);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const double along = u * std::cos(angle_rad) + v * std::sin(angle_rad) - phase_px;
      pixels[static_cast<std::size_t>(v * kWidth + u)] =
          static_cast<std::uint8_t>(std::lround(128 + contrast * std::sin(2 * M_PI * along / wavelength_px)));
    }
  return pixels;
}

GrayView view(const std::vector<std::uint8_t>& pixels) { return {pixels.data(), kWidth, kHeight, kWidth}; }

/// Mean response over cells and the last half of 60 frames of a grating in motion.
EmdCell response(double wavelength_px, double angle_rad, double speed_px, double contrast = 80) {
  EmdGrid grid(kWidth, kHeight, {});
  EmdField field;
  EmdCell mean;
  for (int i = 0; i < 60; ++i) {
    grid.step(view(grating(wavelength_px, angle_rad, speed_px * i, contrast)), field);
    EXPECT_EQ(field.valid, i > 0);
    if (i < 30) continue;
    for (int k = 0; k < 108; ++k) {
      mean.right += field.cells[static_cast<std::size_t>(k)].right / (30 * 108);
      mean.down += field.cells[static_cast<std::size_t>(k)].down / (30 * 108);
    }
  }
  return mean;
}

TEST(EmdGrid, SignTellsTheDirection) {
  EXPECT_GT(response(48, 0, 3).right, 50.f);
  EXPECT_LT(response(48, 0, -3).right, -50.f);
  EXPECT_GT(response(48, M_PI / 2, 3).down, 50.f);
  EXPECT_LT(response(48, M_PI / 2, -3).down, -50.f);
  EXPECT_NEAR(response(48, 0, 3).down, 0.f, 5.f);
}

TEST(EmdGrid, RespondsToTemporalFrequencyNotSpeed) {
  // The same frequency (1/16 per frame) at twice the speed and wavelength: alike but for sin(2 pi b / l).
  const double slow = static_cast<double>(response(48, 0, 3).right) / std::sin(2 * M_PI * 8 / 48);
  const double fast = static_cast<double>(response(96, 0, 6).right) / std::sin(2 * M_PI * 8 / 96);
  EXPECT_NEAR(slow / fast, 1.0, 0.15);
  // Past its best frequency the response falls though the speed grows.
  EXPECT_GT(response(48, 0, 6).right, response(48, 0, 18).right);
}

TEST(EmdGrid, GrowsWithTheSquareOfContrast) {
  EXPECT_NEAR(response(48, 0, 3, 80).right / response(48, 0, 3, 40).right, 4.f, 0.2f);
}

TEST(EmdGrid, StillAndFlatImagesGiveNothing) {
  EXPECT_NEAR(response(48, 0, 0).right, 0.f, 1e-2f);
  EmdGrid grid(kWidth, kHeight, {});
  EmdField field;
  const std::vector<std::uint8_t> flat(kWidth * kHeight, 128);
  for (int i = 0; i < 3; ++i) grid.step(view(flat), field);
  EXPECT_TRUE(field.valid);
  EXPECT_EQ(field.cells[5].right, 0.f);
}

TEST(EmdGrid, BadInput) {
  EmdGrid grid(kWidth, kHeight, {});
  EmdField field;
  const std::vector<std::uint8_t> flat(kWidth * kHeight, 128);
  for (const GrayView& bad : {GrayView{}, GrayView{flat.data(), kWidth, kHeight, 8}, GrayView{flat.data(), 8, 8, 8}}) {
    grid.step(bad, field);
    EXPECT_FALSE(field.valid);
  }
  EXPECT_THROW(EmdGrid(kWidth, kHeight, {.pitch_px = 1}), std::invalid_argument);
  EXPECT_THROW(EmdGrid(32, 32, {}), std::invalid_argument);
  EXPECT_THROW(EmdGrid(kWidth, kHeight, {.delay_frames = 0.f}), std::invalid_argument);
}

TEST(EmdGrid, TakesNoMemory) {
  EmdGrid grid(kWidth, kHeight, {});
  EmdField field;
  const auto pixels = grating(48, 0, 0, 80);
  const test::MallocCount count;
  {
    const rt::RealtimeSection section;
    grid.step(view(pixels), field);
    grid.step(view(pixels), field);
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
