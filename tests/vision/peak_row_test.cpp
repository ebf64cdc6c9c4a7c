#include "vision/kernels/peak_row.h"

#include <gtest/gtest.h>

#include <vector>

#include "vision/kernels/edge_rows.h"

namespace wasp::vision {
namespace {

TEST(PeakRow, IsTheLargestSlidingMean) {
  std::vector<std::int32_t> counts(240, 0);
  counts[20] = 90;                                         // one strong row: 90 / 9 = 10 in its window
  for (std::size_t v = 100; v < 109; ++v) counts[v] = 30;  // nine rows: 30
  const PeakRow peak = find_peak_row({.window_rows = 9}, counts);
  ASSERT_TRUE(peak.valid);
  EXPECT_EQ(peak.row, 104);
  EXPECT_FLOAT_EQ(peak.count, 30.f);
  EXPECT_EQ(find_peak_row({.window_rows = 1}, counts).row, 20);
}

TEST(PeakRow, OfAWallIsItsTopmostStrongRow) {
  std::vector<std::int32_t> counts(240, 1);
  for (std::size_t v = 80; v < 200; ++v) counts[v] = v < 160 ? 40 : 60;
  const PeakRow peak = find_peak_row({.window_rows = 5, .share = 0.5f}, counts);
  EXPECT_EQ(peak.row, 81);  // three of its five rows lie on the wall: mean 24.4; one row up it is 16.6
  EXPECT_GE(peak.most_row, 162);
  EXPECT_FLOAT_EQ(peak.most, 60.f);
}

TEST(PeakRow, EndsOfTheImageCountTheirOwnRowsOnly) {
  std::vector<std::int32_t> counts(50, 10);
  counts[0] = counts[1] = counts[2] = 20;
  const PeakRow peak = find_peak_row({.window_rows = 5}, counts);
  EXPECT_EQ(peak.row, 0);
  EXPECT_FLOAT_EQ(peak.count, 20.f);
  EXPECT_EQ(find_peak_row({.window_rows = 1001}, counts).row, 0);  // wider than the image: all rows alike
}

TEST(PeakRow, NothingIsNoPeak) {
  EXPECT_FALSE(find_peak_row({}, {}).valid);
  EXPECT_FALSE(find_peak_row({}, std::vector<std::int32_t>(240, 0)).valid);
  EXPECT_FALSE(find_peak_row({}, std::vector<std::int32_t>(kMaxEdgeRows + 1, 1)).valid);
  EXPECT_TRUE(find_peak_row({.window_rows = -3, .share = -1.f}, std::vector<std::int32_t>(240, 1)).valid);
}

}  // namespace
}  // namespace wasp::vision
