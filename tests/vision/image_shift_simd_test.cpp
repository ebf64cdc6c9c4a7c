// The SIMD functions of image_shift beside plain loops over seeded data, for every instruction set this processor and
// this build have in common.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <random>
#include <vector>

#include "vision/kernels/image_shift_affine.h"
#include "vision/kernels/image_shift_bins.h"
#include "vision/kernels/image_shift_overlap.h"
#include "vision/kernels/image_shift_spectrum.h"

namespace wasp::vision::shift {
namespace {

using Complex = std::complex<float>;
std::size_t size(int n) { return static_cast<std::size_t>(n); }

class ShiftSimd : public testing::TestWithParam<std::int64_t> {
 protected:
  void SetUp() override { hwy::SetSupportedTargetsForTest(GetParam()), refresh(); }
  void TearDown() override { hwy::SetSupportedTargetsForTest(0), refresh(); }
  static void refresh() { hwy::GetChosenTarget().Update(hwy::SupportedTargets()); }

  std::vector<float> reals(int count, float low = -1, float high = 1) {
    std::uniform_real_distribution<float> uniform(low, high);
    std::vector<float> values(size(count));
    for (float& v : values) v = uniform(random_);
    return values;
  }
  std::vector<std::uint8_t> pixels(int count) {
    std::vector<std::uint8_t> values(size(count));
    for (auto& v : values) v = static_cast<std::uint8_t>(random_());
    return values;
  }

  std::mt19937 random_{2026};
};

TEST_P(ShiftSimd, BinsWeighHalfBinsOneThreeThreeOne) {
  constexpr int kStride = 210;
  const auto data = pixels(kStride * 190);
  const GrayView image{data.data(), 201, 190, kStride};
  for (const int bin : {1, 2, 4})
    for (const auto& [rows, columns] : {std::pair{7, 9}, {32, 33}, {40, 47}}) {
      const int x = 3, y = 5, half = std::max(1, bin / 2), pitch = columns + 2 * kLanesMargin;
      std::vector<float> out(size((rows + 1) * pitch), -1.f);
      bin_image(image, x, y, bin, rows, columns, out.data(), pitch);
      const auto half_bin = [&](int r, int c) {
        r = std::clamp(r, 0, 2 * rows - 1), c = std::clamp(c, 0, 2 * columns - 1);
        int sum = 0;
        for (int i = 0; i < half; ++i)
          for (int j = 0; j < half; ++j) sum += image.row(y + r * half + i)[x + c * half + j];
        return sum;
      };
      for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c) {
          int expected = bin == 1 ? image.row(y + r)[x + c] : 0;
          constexpr int kWeights[] = {1, 3, 3, 1};
          for (int i = 0; bin > 1 && i < 4; ++i)
            for (int j = 0; j < 4; ++j) expected += kWeights[i] * kWeights[j] * half_bin(2 * r - 1 + i, 2 * c - 1 + j);
          ASSERT_EQ(out[size(r * pitch + c)], static_cast<float>(expected)) << bin << " " << r << " " << c;
        }
    }
}

TEST_P(ShiftSimd, HalvingSumsFour) {
  constexpr int kRows = 11, kColumns = 21, kPitch = 64;
  const auto in = reals(2 * kRows * kPitch + kPitch);
  std::vector<float> out(size(kRows * kPitch + kPitch));
  halve_image(in.data(), kPitch, kRows, kColumns, out.data(), kPitch);
  for (int r = 0; r < kRows; ++r)
    for (int c = 0; c < kColumns; ++c) {
      const auto at = [&](int v, int u) { return in[size((2 * r + v) * kPitch + 2 * c + u)]; };
      EXPECT_NEAR(out[size(r * kPitch + c)], at(0, 0) + at(0, 1) + at(1, 0) + at(1, 1), 1e-6f);
    }
}

TEST_P(ShiftSimd, SumsOverWindowsAndOverlaps) {
  for (const auto& [rows, columns] : {std::pair{5, 8}, {17, 31}, {33, 64}}) {
    const int pitch = columns + 2 * kLanesMargin;
    const auto a = reals((rows + 1) * pitch), b = reals((rows + 1) * pitch), wy = reals(rows);
    auto wx = reals(pitch);
    std::fill(wx.begin() + columns, wx.end(), 0.f);
    double weighted = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
    float most = -2;
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < columns; ++c) {
        const double p = static_cast<double>(a[size(r * pitch + c)]), q = static_cast<double>(b[size(r * pitch + c)]);
        weighted += static_cast<double>(wy[size(r)]) * static_cast<double>(wx[size(c)]) * p;
        sa += p, sb += q, saa += p * p, sbb += q * q, sab += p * q;
        if (r == 0) most = std::max(most, a[size(c)]);
      }
    EXPECT_NEAR(weighted_sum(a.data(), pitch, rows, columns, wx.data(), wy.data()), weighted, 1e-3);
    const OverlapSums sums = overlap_sums(a.data(), b.data(), pitch, rows, columns);
    EXPECT_NEAR(sums.a, sa, 1e-3);
    EXPECT_NEAR(sums.b, sb, 1e-3);
    EXPECT_NEAR(sums.aa, saa, 1e-2);
    EXPECT_NEAR(sums.bb, sbb, 1e-2);
    EXPECT_NEAR(sums.ab, sab, 1e-2);
    EXPECT_EQ(max_of(a.data(), columns), most);
  }
}

TEST_P(ShiftSimd, PacksTheWindowedPair) {
  constexpr int kRows = 9, kColumns = 13, kPitch = 48, kZRows = 12, kZColumns = 18;
  const auto a = reals(kRows * kPitch + kPitch), b = reals(kRows * kPitch + kPitch), wy = reals(kRows);
  auto wx = reals(kPitch);
  std::fill(wx.begin() + kColumns, wx.end(), 0.f);
  std::vector<Complex> z(size(kZRows * kZColumns), {9, 9});
  pack_pair(a.data(), b.data(), kPitch, kRows, kColumns, 0.25f, -0.5f, wx.data(), wy.data(), z.data(), kZRows,
            kZColumns);
  for (int r = 0; r < kZRows; ++r)
    for (int c = 0; c < kZColumns; ++c) {
      const bool inside = r < kRows && c < kColumns;
      const float w = inside ? wy[size(r)] * wx[size(c)] : 0.f;
      const Complex expected =
          inside ? Complex{w * (a[size(r * kPitch + c)] - 0.25f), w * (b[size(r * kPitch + c)] + 0.5f)} : Complex{};
      EXPECT_LT(std::abs(z[size(r * kZColumns + c)] - expected), 1e-6f) << r << " " << c;
    }
}

/// A band and its planes.
struct Planes {
  std::vector<float> re, im;
  Band band;
  Planes(int rows_v, int columns_u) {
    const int pitch = (columns_u + 1 + kLanesMargin - 1) / kLanesMargin * kLanesMargin + kLanesMargin;
    re.assign(size((2 * rows_v + 1) * pitch + kLanesMargin), 0.f);
    im = re;
    band = {re.data(), im.data(), rows_v, columns_u, pitch};
  }
  [[nodiscard]] Complex at(int v, int u) const { return {band.re[band.offset(v) + u], band.im[band.offset(v) + u]}; }
};

TEST_P(ShiftSimd, CrossPowerWhiteningAndMean) {
  constexpr int kRows = 24, kColumns = 60, kV = 9, kU = 21;
  std::vector<Complex> z(size(kRows * kColumns));
  const auto values = reals(2 * kRows * kColumns);
  for (std::size_t i = 0; i < z.size(); ++i) z[i] = {values[2 * i], values[2 * i + 1]};
  Planes h(kV, kU), g(kV, kU);
  const BandEnergy energy = cross_power(z.data(), kRows, kColumns, h.band);
  auto wx = reals(h.band.pitch, 0, 1);
  const auto wy = reals(2 * kV + 1, 0, 1);
  std::fill(wx.begin() + kU + 1, wx.end(), 0.f);
  const float noise = 0.7f, whole = whiten(h.band, noise, wx.data(), wy.data(), g.band);
  double first = 0, second = 0, sum = 0, magnitude = 0;
  for (int v = -kV; v <= kV; ++v)
    for (int u = 0; u <= kU; ++u) {
      const Complex p = z[size((v + kRows) % kRows * kColumns + u)];
      const Complex m = std::conj(z[size((kRows - v) % kRows * kColumns + (kColumns - u) % kColumns)]);
      const Complex f1 = p + m, f2 = Complex{0, -1} * (p - m), cross = f2 * std::conj(f1);
      ASSERT_LT(std::abs(h.at(v, u) - cross), 1e-4f) << v << " " << u;
      first += static_cast<double>(std::norm(f1)), second += static_cast<double>(std::norm(f2));
      const float gain = wx[size(u)] * wy[size(v + kV)] * std::abs(cross) / (std::norm(cross) + noise * noise);
      ASSERT_LT(std::abs(g.at(v, u) - gain * cross), 1e-4f) << v << " " << u;
      sum += static_cast<double>(gain * std::abs(cross));
      magnitude += static_cast<double>(std::abs(cross));
    }
  EXPECT_NEAR(energy.first, first, 1e-4 * first);
  EXPECT_NEAR(energy.second, second, 1e-4 * second);
  EXPECT_NEAR(whole, sum, 1e-4 * sum);
  EXPECT_NEAR(mean_magnitude(h.band, 0), magnitude / ((kU + 1) * (2 * kV + 1)), 1e-3);
}

TEST_P(ShiftSimd, PeakSumsAreTheCorrelationAndItsDerivatives) {
  constexpr int kV = 7, kU = 19;
  Planes g(kV, kU);
  const auto values = reals(2 * (kU + 1) * (2 * kV + 1));
  std::size_t next = 0;
  for (int v = -kV; v <= kV; ++v)
    for (int u = 0; u <= kU; ++u)
      g.band.re[g.band.offset(v) + u] = values[next++], g.band.im[g.band.offset(v) + u] = values[next++];
  const auto phases_x = reals(g.band.pitch, -3, 3), phases_y = reals(2 * kV + 1, -3, 3);
  std::vector<float> xr, xi, yr, yi;
  for (const float p : phases_x) xr.push_back(std::cos(p)), xi.push_back(std::sin(p));
  for (const float p : phases_y) yr.push_back(std::cos(p)), yi.push_back(std::sin(p));
  const PeakSums sums = peak_sums(g.band, xr.data(), xi.data(), yr.data(), yi.data());
  double c = 0, cx = 0, cy = 0, cxx = 0, cxy = 0, cyy = 0;
  for (int v = -kV; v <= kV; ++v)
    for (int u = 0; u <= kU; ++u) {
      const Complex t = g.at(v, u) * Complex{xr[size(u)], xi[size(u)]} * Complex{yr[size(v + kV)], yi[size(v + kV)]};
      const double re = static_cast<double>(t.real()), im = static_cast<double>(t.imag());
      c += re, cx -= u * im, cy -= v * im, cxx -= u * u * re, cxy -= u * v * re, cyy -= v * v * re;
    }
  EXPECT_NEAR(sums.c, c, 1e-3);
  EXPECT_NEAR(sums.cx, cx, 1e-2);
  EXPECT_NEAR(sums.cy, cy, 1e-2);
  EXPECT_NEAR(sums.cxx, cxx, 0.2);
  EXPECT_NEAR(sums.cxy, cxy, 0.2);
  EXPECT_NEAR(sums.cyy, cyy, 0.2);
}

TEST_P(ShiftSimd, AffineSums) {
  constexpr int kRows = 40, kColumns = 53, kPitch = 96;
  const auto a = reals(kRows * kPitch + 2 * kPitch), b = reals(kRows * kPitch + 2 * kPitch);
  auto wx = reals(kPitch, 0, 1);
  const auto wy = reals(kRows, 0, 1);
  const Region region{4, 3, 37, 30, wx.data(), wy.data()};
  std::fill(wx.begin() + region.columns, wx.end(), 0.f);
  const ImagePair images{a.data(), b.data(), kPitch, kRows, kColumns, 1.5f, 0.25f};
  for (const Affine& m : {Affine{2.4f, -1.7f}, Affine{-1.3f, 0.6f, 2.f, -1.f, 0.5f, -1.5f}}) {
    const AffineSums sums = affine_sums(images, region, m);
    double gxx_xx = 0, gxy_xy = 0, gyy_y = 0, gxe_x = 0, gye_y = 0, ee = 0, weight = 0;
    for (int r = 0; r < region.rows; r += 2)
      for (int c = 0; c < region.columns; ++c) {
        const int row = region.row + r, column = region.column + c;
        const float x = (static_cast<float>(column) - 26.f) * 2 / kColumns,
                    y = (static_cast<float>(row) - 19.5f) * 2 / kColumns;
        const float u = std::clamp(static_cast<float>(column) + m.dx + m.xx * x + m.xy * y, 0.f, kColumns - 1.001f);
        const float v = std::clamp(static_cast<float>(row) + m.dy + m.yx * x + m.yy * y, 0.f, kRows - 1.001f);
        const int u0 = static_cast<int>(u), v0 = static_cast<int>(v);
        const auto at = [](const std::vector<float>& image, int i, int j) { return image[size(i * kPitch + j)]; };
        const float s = u - static_cast<float>(u0), t = v - static_cast<float>(v0);
        const float top = at(b, v0, u0) + s * (at(b, v0, u0 + 1) - at(b, v0, u0));
        const float low = at(b, v0 + 1, u0) + s * (at(b, v0 + 1, u0 + 1) - at(b, v0 + 1, u0));
        const float e = 1.5f * (top + t * (low - top)) + 0.25f - at(a, row, column);
        const float gx = 0.5f * (at(a, row, column + 1) - at(a, row, column - 1));
        const float gy = 0.5f * (at(a, row + 1, column) - at(a, row - 1, column));
        const float w = wx[size(c)] * wy[size(r)];
        gxx_xx += static_cast<double>(w * gx * gx * x * x), gxy_xy += static_cast<double>(w * gx * gy * x * y);
        gyy_y += static_cast<double>(w * gy * gy * y), gxe_x += static_cast<double>(w * gx * e * x);
        gye_y += static_cast<double>(w * gy * e * y), ee += static_cast<double>(w * e * e);
        weight += static_cast<double>(w);
      }
    EXPECT_NEAR(sums.gxx[3], gxx_xx, 1e-2);
    EXPECT_NEAR(sums.gxy[4], gxy_xy, 1e-2);
    EXPECT_NEAR(sums.gyy[2], gyy_y, 1e-2);
    EXPECT_NEAR(sums.gxe[1], gxe_x, 1e-2);
    EXPECT_NEAR(sums.gye[2], gye_y, 1e-2);
    EXPECT_NEAR(sums.ee, ee, 5e-2);
    EXPECT_NEAR(sums.weight, weight, 1e-2);
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, ShiftSimd, testing::ValuesIn(hwy::SupportedAndGeneratedTargets()),
                         [](const auto& target) { return std::string(hwy::TargetName(target.param)); });

}  // namespace
}  // namespace wasp::vision::shift
