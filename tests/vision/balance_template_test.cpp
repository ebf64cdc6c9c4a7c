#include "vision/kernels/balance_template.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"

namespace wasp::vision {
namespace {

constexpr float kFoeX = 320, kFoeY = 240;

/// 12 x 9 cells; `motion` gives (u, v) from the offset to the focus.
FlowField field(const std::function<std::pair<float, float>(float, float)>& motion) {
  FlowField flow;
  for (int r = 0; r < flow.rows; ++r)
    for (int c = 0; c < flow.columns; ++c) {
      FlowCell& cell = flow.at(c, r);
      cell.x_px = 26.5f + 53.3f * static_cast<float>(c);
      cell.y_px = 26.5f + 53.3f * static_cast<float>(r);
      std::tie(cell.u_px, cell.v_px) = motion(cell.x_px - kFoeX, cell.y_px - kFoeY);
      cell.valid = 1;
    }
  return flow;
}

void drop_cells(FlowField& flow, double share, std::mt19937& random) {
  for (FlowCell& cell : flow.cells)
    if (std::uniform_real_distribution<>()(random) < share) cell.valid = 0;
}

TEST(BalanceTemplate, PushesAwayFromTheNearerWall) {
  const FlowField left_near = field([](float dx, float dy) {
    const float nearness = dx < 0 ? 0.03f : 0.01f;
    return std::pair{nearness * dx, nearness * dy};
  });
  for (const BalanceForm form : {BalanceForm::kRadial, BalanceForm::kPrinted}) {
    const GrossForce g = gross_force({.form = form}, left_near, kFoeX, kFoeY);
    ASSERT_TRUE(g.valid_x && g.valid_y);
    EXPECT_GT(g.force.x, 0.f);
    EXPECT_LT(std::abs(g.force.y), 0.2f * g.force.x);
  }
  const FlowField floor_near = field([](float dx, float dy) {
    const float nearness = dy > 0 ? 0.03f : 0.01f;
    return std::pair{nearness * dx, nearness * dy};
  });
  EXPECT_LT(gross_force({}, floor_near, kFoeX, kFoeY).force.y, 0.f);  // up
}

TEST(BalanceTemplate, EvenExpansionInTheMiddleIsBalanced) {
  FlowField flow = field([](float dx, float dy) { return std::pair{0.02f * dx, 0.02f * dy}; });
  const GrossForce g = gross_force({}, flow, kFoeX, kFoeY);
  ASSERT_TRUE(g.valid_x && g.valid_y);
  EXPECT_NEAR(g.force.x, 0.f, 0.1f);
  EXPECT_NEAR(g.force.y, 0.f, 0.1f);
}

/// Whichever cells are missing and wherever the focus is: roll about it is tangential everywhere.
TEST(BalanceTemplate, RollCancels) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> place(-150.f, 150.f);
  float worst_printed = 0;
  for (int run = 0; run < 200; ++run) {
    const float x = kFoeX + place(random), y = kFoeY + place(random);
    FlowField flow = field([&](float dx, float dy) {
      return std::pair{-0.05f * (dy + kFoeY - y), 0.05f * (dx + kFoeX - x)};
    });
    drop_cells(flow, 0.4, random);
    const GrossForce radial = gross_force({}, flow, x, y);
    EXPECT_NEAR(radial.force.x, 0.f, 1e-4f);
    EXPECT_NEAR(radial.force.y, 0.f, 1e-4f);
    const GrossForce printed = gross_force({.form = BalanceForm::kPrinted}, flow, x, y);
    worst_printed = std::max(worst_printed, std::abs(printed.force.x));
  }
  EXPECT_GT(worst_printed, 5.f);  // what the printed sum makes of roll when cells are missing
}

TEST(BalanceTemplate, PrintedFormIsTheSumAndRollCancelsInTheFullField) {
  const FlowField roll = field([](float dx, float dy) { return std::pair{-0.05f * dy, 0.05f * dx}; });
  FlowField centred = roll;
  for (FlowCell& c : centred.cells) {
    c.x_px += 0.35f;  // the grid's centre onto the focus
    c.y_px += 0.3f;
  }
  const GrossForce g = gross_force({.form = BalanceForm::kPrinted}, centred, kFoeX, kFoeY);
  EXPECT_NEAR(g.force.x, 0.f, 2.f);
  EXPECT_EQ(g.cells[0], g.cells[1]);
  EXPECT_EQ(g.cells[2], g.cells[3]);
}

TEST(BalanceTemplate, BlindOnOneSideIsInvalidNotBalanced) {
  FlowField flow = field([](float dx, float dy) { return std::pair{0.02f * dx, 0.02f * dy}; });
  for (FlowCell& cell : flow.cells)
    if (cell.x_px < kFoeX) cell.valid = 0;
  const GrossForce g = gross_force({}, flow, kFoeX, kFoeY);
  EXPECT_FALSE(g.valid_x);
  EXPECT_EQ(g.force.x, 0.f);
}

TEST(BalanceTemplate, BadInputIsInvalid) {
  FlowField flow = field([](float, float) { return std::pair{std::nanf(""), 1.f}; });
  EXPECT_FALSE(gross_force({}, flow, kFoeX, kFoeY).valid_x);
  flow = field([](float dx, float dy) { return std::pair{dx, dy}; });
  EXPECT_FALSE(gross_force({}, flow, std::nanf(""), kFoeY).valid_x);
  EXPECT_FALSE(gross_force({.wedge_half_angle_rad = 2.f}, flow, kFoeX, kFoeY).valid_x);
  EXPECT_FALSE(gross_force({.min_cells = 0}, flow, kFoeX, kFoeY).valid_x);
  flow.columns = FlowField::kMaxColumns + 1;
  EXPECT_FALSE(gross_force({}, flow, kFoeX, kFoeY).valid_x);
}

TEST(ForceAverage, IsTheMeanOfTheLastTen) {
  ForceAverage average;
  EXPECT_EQ(average.add({4.f, -2.f}).x, 4.f);
  for (int i = 0; i < 9; ++i) average.add({14.f, 8.f});
  const ImageForce now = average.add({14.f, 8.f});
  EXPECT_FLOAT_EQ(now.x, 14.f);  // the first has left
  EXPECT_FLOAT_EQ(now.y, 8.f);
  EXPECT_FLOAT_EQ(average.add({std::nanf(""), 8.f}).x, 12.6f);
}

Obstacles one(float x_px, float y_px, int cells = 10, float depth_m = 2.f) {
  Obstacles o;
  o.count = 1;
  o.obstacle[0] = {x_px, y_px, cells, depth_m};
  return o;
}

TEST(FineForce, IsThePrintedProductAwayFromTheCluster) {
  const ImageForce f = fine_force({}, one(kFoeX + 50, kFoeY - 30), kFoeX, kFoeY, {});
  EXPECT_FLOAT_EQ(f.x, -50.f * 10 * 5 * 3 * 10);
  EXPECT_FLOAT_EQ(f.y, 30.f * 10 * 5 * 3 * 10);
}

TEST(FineForce, GatesSmallFarAndAsideClusters) {
  EXPECT_EQ(fine_force({}, one(kFoeX + 50, kFoeY, 3), kFoeX, kFoeY, {}).x, 0.f);
  EXPECT_EQ(fine_force({}, one(kFoeX + 301, kFoeY), kFoeX, kFoeY, {}).x, 0.f);
  EXPECT_EQ(fine_force({}, one(kFoeX + 50, kFoeY, 10, 6.f), kFoeX, kFoeY, {}).x, 0.f);
  EXPECT_EQ(fine_force({}, one(kFoeX + 50, kFoeY, 10, std::nanf("")), kFoeX, kFoeY, {}).x, 0.f);
  EXPECT_EQ(fine_force({}, one(std::nanf(""), kFoeY), kFoeX, kFoeY, {}).x, 0.f);
}

TEST(FineForce, BreaksTheTieAtTheFocusTheSameWayEveryTime) {
  const ImageForce right = fine_force({}, one(kFoeX, kFoeY), kFoeX, kFoeY, {});
  EXPECT_GT(right.x, 0.f);
  EXPECT_EQ(right.x, fine_force({}, one(kFoeX, kFoeY), kFoeX, kFoeY, {}).x);
  const ImageForce with_gross = fine_force({}, one(kFoeX, kFoeY), kFoeX, kFoeY, {-0.1f, 0.f});
  EXPECT_LT(with_gross.x, 0.f);
  EXPECT_NEAR(std::abs(with_gross.x), right.x, 1e-3f * right.x);
  EXPECT_LT(fine_force({}, one(kFoeX + 1, kFoeY), kFoeX, kFoeY, {}).x, -0.9f * right.x);  // own direction first
}

TEST(FineForce, ObstaclesAreTheClustersOfCells) {
  std::vector<float> depth_u, depth_v, x, y;
  for (int i = 0; i < 30; ++i) {
    const bool near = i < 10;
    depth_u.push_back(near ? 1.f : 4.f);
    depth_v.push_back(near ? 1.2f : 4.2f);
    x.push_back(near ? 400.f : 100.f + static_cast<float>(i));
    y.push_back(near ? 200.f + static_cast<float>(i) : 240.f);
  }
  const Clusters clusters = cluster_points({.clusters = 2}, depth_u, depth_v);
  const Obstacles o = obstacles_of(clusters, x, y);
  ASSERT_EQ(o.count, 2);
  EXPECT_EQ(o.obstacle[0].cells, 10);
  EXPECT_FLOAT_EQ(o.obstacle[0].x_px, 400.f);
  EXPECT_FLOAT_EQ(o.obstacle[0].y_px, 204.5f);
  EXPECT_NEAR(o.obstacle[0].depth_m, 1.1f, 1e-5f);
  EXPECT_LT(fine_force({.max_depth_m = 3.f}, o, kFoeX, kFoeY, {}).x, 0.f);  // away from the near one on the right
  x.pop_back();
  EXPECT_EQ(obstacles_of(clusters, x, y).count, 0);
  EXPECT_EQ(obstacles_of({}, {}, {}).count, 0);
}

TEST(BalanceTemplate, AllocatesNothing) {
  const FlowField flow = field([](float dx, float dy) { return std::pair{0.02f * dx, 0.02f * dy}; });
  ForceAverage average;
  const test::MallocCount count;
  {
    const rt::RealtimeSection section;
    const ImageForce gross = average.add(gross_force({}, flow, kFoeX, kFoeY).force);
    fine_force({}, one(kFoeX, kFoeY), kFoeX, kFoeY, gross);
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
