// FFTW's plans of every size the kernels may ask for must run without the heap, and transform right.
#include "vision/kernels/fft.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"

namespace wasp::vision {
namespace {

/// Allocations in one execution of each transform of this size.
std::uint64_t allocations(int rows, int columns, FftPlanning planning) {
  const ComplexFft complex(rows, columns, planning);
  const RealFft real(rows, columns, planning);
  const test::MallocCount count;
  const rt::RealtimeSection section;
  complex.execute();
  real.forward();
  real.inverse();
  return count.violations();
}

TEST(Fft, NoSizeAllocatesWhenExecuted) {
  int plans = 0;
  for (int rows = 1; rows <= 640; rows = rows < 8 ? rows + 1 : good_fft_size(rows + rows / 4))
    for (int columns = 2; columns <= 640; columns = good_fft_size(columns + 1 + columns / 16), ++plans)
      EXPECT_EQ(allocations(rows, columns, FftPlanning::kEstimate), 0u) << rows << " x " << columns;
  EXPECT_GT(plans, 500);
}

TEST(Fft, MeasuredPlansDoNotAllocateEither) {
  for (const int rows : {1, 5, 36, 64})
    for (const int columns : {36, 80, 96, 128, 162})
      EXPECT_EQ(allocations(rows, columns, FftPlanning::kMeasure), 0u) << rows << " x " << columns;
}

TEST(Fft, AComplexWaveIsOneBin) {
  for (const auto& [rows, columns] : {std::pair{1, 30}, {2, 6}, {12, 20}, {9, 8}, {27, 50}}) {
    const int v0 = rows / 3, u0 = columns / 4;
    const ComplexFft fft(rows, columns, FftPlanning::kEstimate);
    for (int y = 0; y < rows; ++y)
      for (int x = 0; x < columns; ++x)
        fft.data()[y * columns + x] = std::polar(1.f, 2 * std::numbers::pi_v<float> *
                                                          (static_cast<float>(v0 * y) / static_cast<float>(rows) +
                                                           static_cast<float>(u0 * x) / static_cast<float>(columns)));
    fft.execute();
    for (int v = 0; v < rows; ++v)
      for (int u = 0; u < columns; ++u)
        EXPECT_NEAR(std::abs(fft.data()[v * columns + u]),
                    v == v0 && u == u0 ? static_cast<float>(rows * columns) : 0.f, 2e-3f)
            << rows << " x " << columns << " at " << v << ", " << u;
  }
}

TEST(Fft, ARealWaveIsOneBinAndComesBack) {
  constexpr int kRows = 12, kColumns = 20, kV = 3, kU = 4;
  const RealFft fft(kRows, kColumns, FftPlanning::kEstimate);
  const auto wave = [](int y, int x) {
    return std::cos(2 * std::numbers::pi_v<float> *
                    (static_cast<float>(kV * y) / kRows + static_cast<float>(kU * x) / kColumns));
  };
  for (int y = 0; y < kRows; ++y)
    for (int x = 0; x < kColumns; ++x) fft.real()[y * kColumns + x] = wave(y, x);
  fft.forward();
  constexpr int kPitch = kColumns / 2 + 1;
  for (int v = 0; v < kRows; ++v)
    for (int u = 0; u < kPitch; ++u)
      EXPECT_NEAR(std::abs(fft.spectrum()[v * kPitch + u]), v == kV && u == kU ? kRows * kColumns / 2.f : 0.f, 1e-3f);
  fft.inverse();
  for (int y = 0; y < kRows; ++y)
    for (int x = 0; x < kColumns; ++x)
      EXPECT_NEAR(fft.real()[y * kColumns + x] / (kRows * kColumns), wave(y, x), 1e-5f);
}

}  // namespace
}  // namespace wasp::vision
