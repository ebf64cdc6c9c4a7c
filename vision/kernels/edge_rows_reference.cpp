// The scalar form: what it computes in plain loops, row by row.
#include "vision/kernels/edge_rows_reference.h"

#include <array>

namespace wasp::vision {
namespace {

using SobelRow = std::array<std::int16_t, kMaxEdgeColumns>;
using MagnitudeRow = std::array<std::int32_t, kMaxEdgeColumns>;

/// Gradient of the interior pixels of row v: out[u-1] for u = 1 ... width-2.
void sobel_row(const GrayView& image, int v, SobelRow& out) noexcept {
  const std::uint8_t* above = image.row(v - 1);
  const std::uint8_t* below = image.row(v + 1);
  SobelRow difference;
  const int width = image.width_px;
  for (int u = 0; u < width; ++u)
    difference[static_cast<std::size_t>(u)] =
        static_cast<std::int16_t>(static_cast<std::int16_t>(below[u]) - static_cast<std::int16_t>(above[u]));
  const std::int16_t* d = difference.data();
  for (int u = 0; u < width - 2; ++u)
    out[static_cast<std::size_t>(u)] = static_cast<std::int16_t>(d[u] + 2 * d[u + 1] + d[u + 2]);
}

/// At most 2,046 squares of at most 1,020^2 fit 32 bits.
std::uint32_t sum_of_squares(const SobelRow& g, int n) noexcept {
  std::uint32_t sum = 0;
  for (int u = 0; u < n; ++u) {
    const int x = g[static_cast<std::size_t>(u)];
    sum += static_cast<std::uint32_t>(x * x);
  }
  return sum;
}

/// At most 2,046 values of at most 2 * 1,020^2 (a pixel's gradients cannot both be full) fit 33 bits: sum in 64.
std::uint64_t sum_of(const MagnitudeRow& m, int n) noexcept {
  std::uint64_t sum = 0;
  for (int u = 0; u < n; ++u) sum += static_cast<std::uint64_t>(m[static_cast<std::size_t>(u)]);
  return sum;
}

/// Squared gradient of any direction, interior pixels of row v.
void magnitude_row(const GrayView& image, int v, const SobelRow& gv, MagnitudeRow& out) noexcept {
  const std::uint8_t *above = image.row(v - 1), *middle = image.row(v), *below = image.row(v + 1);
  SobelRow column;
  for (int u = 0; u < image.width_px; ++u)
    column[static_cast<std::size_t>(u)] = static_cast<std::int16_t>(above[u] + 2 * middle[u] + below[u]);
  const std::int16_t* c = column.data();
  for (int u = 0; u < image.width_px - 2; ++u) {
    const int gu = c[u + 2] - c[u], g = gv[static_cast<std::size_t>(u)];
    out[static_cast<std::size_t>(u)] = gu * gu + g * g;
  }
}

/// 16-bit counters (n < 65536) keep the loops in one register width.
int count_brighter(const SobelRow& g, int n, int threshold) noexcept {
  const auto least = static_cast<std::int16_t>(threshold);
  std::uint16_t count = 0;
  for (int u = 0; u < n; ++u) count = static_cast<std::uint16_t>(count + (g[static_cast<std::size_t>(u)] >= least));
  return count;
}

int count_both(const SobelRow& g, int n, int threshold) noexcept {
  const auto least = static_cast<std::int16_t>(threshold), most = static_cast<std::int16_t>(-threshold);
  std::uint16_t count = 0;
  for (int u = 0; u < n; ++u) {
    const std::int16_t x = g[static_cast<std::size_t>(u)];
    count = static_cast<std::uint16_t>(count + ((x >= least) | (x <= most)));
  }
  return count;
}

int count_magnitude(const MagnitudeRow& m, int n, int threshold) noexcept {
  const int least = threshold * threshold;
  int count = 0;
  for (int u = 0; u < n; ++u) count += m[static_cast<std::size_t>(u)] >= least ? 1 : 0;
  return count;
}

/// Zeroes what lies at or beyond the limit, and what has no depth (0, 65535) if that is to be masked.
template <class Row>
void mask_row(Row& g, const EdgeSweep& sweep, int v) noexcept {
  const std::uint16_t* depth_mm = sweep.depth.row(v);
  for (int u = 0; u < sweep.image.width_px - 2; ++u) {
    const int mm = depth_mm[u + 1];
    const bool unknown = mm == 0 || mm == 65535;
    if (unknown ? sweep.mask_unknown : mm >= sweep.limit_mm) g[static_cast<std::size_t>(u)] = 0;
  }
}

struct RowCounter {
  const EdgeSweep& sweep;

  [[nodiscard]] int count(int v) const noexcept {
    const GrayView& image = sweep.image;
    const int n = image.width_px - 2;
    SobelRow g;
    sobel_row(image, v, g);
    if (sweep.kind == EdgeKind::kAnyDirection) {
      MagnitudeRow m;
      magnitude_row(image, v, g, m);
      if (sweep.limit_mm > 0) mask_row(m, sweep, v);
      return count_magnitude(m, n, sweep.threshold);
    }
    if (sweep.limit_mm > 0) mask_row(g, sweep, v);
    return sweep.kind == EdgeKind::kHorizontal ? count_both(g, n, sweep.threshold)
                                               : count_brighter(g, n, sweep.threshold);
  }
};

}  // namespace

std::uint64_t gradient_squares_reference(const GrayView& image, EdgeKind kind) noexcept {
  SobelRow g;
  MagnitudeRow m;
  const int n = image.width_px - 2;
  std::uint64_t squares = 0;
  for (int v = 1; v < image.height_px - 1; ++v) {
    sobel_row(image, v, g);
    if (kind == EdgeKind::kAnyDirection) magnitude_row(image, v, g, m);
    squares += kind == EdgeKind::kAnyDirection ? sum_of(m, n) : sum_of_squares(g, n);
  }
  return squares;
}

void count_rows_reference(const EdgeSweep& sweep, EdgeRows& out) noexcept {
  const RowCounter counter{sweep};
  for (int v = 1; v < sweep.image.height_px - 1; ++v) out.count[static_cast<std::size_t>(v)] = counter.count(v);
}

}  // namespace wasp::vision
