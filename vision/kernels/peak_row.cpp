// One pass for the sliding sums and their largest, one for the first row that reaches the share.
#include "vision/kernels/peak_row.h"

#include <algorithm>
#include <array>

#include "vision/kernels/edge_rows.h"

namespace wasp::vision {
namespace {

using Means = std::array<float, kMaxEdgeRows>;

void sliding_means(std::span<const std::int32_t> counts, int half, Means& means) noexcept {
  const int n = static_cast<int>(counts.size());
  std::int64_t sum = 0;
  for (int i = 0; i < std::min(half, n); ++i) sum += counts[static_cast<std::size_t>(i)];
  for (int i = 0; i < n; ++i) {
    if (i + half < n) sum += counts[static_cast<std::size_t>(i + half)];
    if (i - half > 0) sum -= counts[static_cast<std::size_t>(i - half - 1)];
    const int rows = std::min(i + half, n - 1) - std::max(i - half, 0) + 1;
    means[static_cast<std::size_t>(i)] = static_cast<float>(sum) / static_cast<float>(rows);
  }
}

}  // namespace

PeakRow find_peak_row(const PeakRowParams& params, std::span<const std::int32_t> counts) noexcept {
  PeakRow out;
  if (counts.empty() || counts.size() > kMaxEdgeRows) return out;
  Means means;
  sliding_means(counts, std::clamp(params.window_rows, 1, kMaxEdgeRows) / 2, means);
  const auto end = means.begin() + static_cast<std::ptrdiff_t>(counts.size());
  const auto most = std::max_element(means.begin(), end);
  out.most_row = static_cast<int>(most - means.begin());
  out.most = *most;
  const float least = out.most * std::clamp(params.share, 0.01f, 1.f);
  auto first = means.begin();
  while (first != most && !(*first >= least)) ++first;
  out.row = static_cast<int>(first - means.begin());
  out.count = *first;
  out.valid = out.most > 0.f;
  return out;
}

}  // namespace wasp::vision
