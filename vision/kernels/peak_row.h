// The row of most edges in a row histogram (thesis 7.38): counts are averaged over a sliding window, and the row of the
// largest mean is taken, or, in front of a wall full of edges, the topmost row that reaches a share of it.
#pragma once

#include <cstdint>
#include <span>

#include "types/realtime.h"

namespace wasp::vision {

struct PeakRowParams {
  int window_rows = 9;  ///< width of the sliding window; the ends of the image cut it
  float share = 1.f;    ///< 1: the largest mean, as (7.38); less: the topmost row of at least this share of it
};

struct PeakRow {
  bool valid = false;
  int row = 0;       ///< m_p
  float count = 0;   ///< mean count of the window about it
  int most_row = 0;  ///< arg max, whatever `share` is
  float most = 0;    ///< its mean
};

/// `counts` by row, none negative, at most kMaxEdgeRows of them; invalid when there are none, too many, or all are
/// zero. Realtime-safe: yes.
PeakRow find_peak_row(const PeakRowParams& params, std::span<const std::int32_t> counts) WASP_REALTIME;

}  // namespace wasp::vision
