#include "vision/kernels/flow_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"

namespace wasp::vision {
namespace {

struct Picture {
  int width_px = 0, height_px = 0, stride_px = 0;
  std::vector<std::uint8_t> pixels;
  [[nodiscard]] GrayView view() const { return {pixels.data(), width_px, height_px, stride_px}; }
};

/// A sum of waves: a texture whose value is known at any real position.
class Waves {
 public:
  explicit Waves(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> angle(0, 2 * M_PI), length(6, 90);
    for (auto& w : waves_) {
      const double direction = angle(random), k = 2 * M_PI / length(random);
      w = {k * std::cos(direction), k * std::sin(direction), angle(random)};
    }
  }
  [[nodiscard]] double at(double u, double v) const {
    double sum = 0;
    for (const auto& w : waves_) sum += std::sin(w.ku * u + w.kv * v + w.phase);
    return 128 + 16 * sum;
  }

 private:
  struct Wave {
    double ku = 0, kv = 0, phase = 0;
  };
  std::array<Wave, 24> waves_;
};

/// Motion of the whole image: x moves to centre + gain R(turn) (x - centre) + shift.
struct Warp {
  double shift_u = 0, shift_v = 0, gain = 1, turn = 0;
};

struct Point {
  double u, v;
};

Point forward(const Warp& w, Point p, Point centre) {
  const double c = w.gain * std::cos(w.turn), s = w.gain * std::sin(w.turn);
  const double x = p.u - centre.u, y = p.v - centre.v;
  return {centre.u + c * x - s * y + w.shift_u, centre.v + s * x + c * y + w.shift_v};
}

Point backward(const Warp& w, Point p, Point centre) {
  const double c = std::cos(w.turn) / w.gain, s = std::sin(w.turn) / w.gain;
  const double x = p.u - centre.u - w.shift_u, y = p.v - centre.v - w.shift_v;
  return {centre.u + c * x + s * y, centre.v - s * x + c * y};
}

Picture render(const Waves& waves, const Warp& warp, int width_px, int height_px, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> grain(0, 1);
  Picture p{width_px, height_px, width_px + 3, {}};
  p.pixels.resize(static_cast<std::size_t>(p.stride_px * height_px));
  const Point centre{width_px / 2.0, height_px / 2.0};
  for (int v = 0; v < height_px; ++v)
    for (int u = 0; u < width_px; ++u) {
      const Point from = backward(warp, {static_cast<double>(u), static_cast<double>(v)}, centre);
      const double value = waves.at(from.u, from.v) + (noise > 0 ? noise * grain(random) : 0.0);
      p.pixels[static_cast<std::size_t>(v * p.stride_px + u)] =
          static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
    }
  return p;
}

struct Outcome {
  int valid = 0;
  double median_px = 0, p95_px = 0;
};

Outcome outcome(const FlowField& field, const Warp& warp, int width_px, int height_px) {
  std::vector<double> errors;
  for (int i = 0; i < field.count(); ++i) {
    const FlowCell& cell = field.cells[static_cast<std::size_t>(i)];
    const Point from{static_cast<double>(cell.x_px), static_cast<double>(cell.y_px)};
    const Point to = forward(warp, from, {width_px / 2.0, height_px / 2.0});
    if (cell.valid == 0) continue;
    errors.push_back(
        std::hypot(from.u + static_cast<double>(cell.u_px) - to.u, from.v + static_cast<double>(cell.v_px) - to.v));
  }
  std::sort(errors.begin(), errors.end());
  if (errors.empty()) return {};
  return {static_cast<int>(errors.size()), errors[errors.size() / 2], errors[errors.size() * 95 / 100]};
}

Outcome track(const Warp& warp, int width_px, int height_px, double noise, const FlowGridParams& params,
              unsigned seed) {
  const Waves waves(seed);
  const Picture first = render(waves, {}, width_px, height_px, noise, seed + 1);
  const Picture second = render(waves, warp, width_px, height_px, noise, seed + 2);
  FlowGrid grid(width_px, height_px, params);
  FlowField field;
  grid.track(first.view(), second.view(), field);
  EXPECT_LE(grid.trips().passes, grid.worst_case().passes);
  EXPECT_LE(grid.trips().guesses, grid.worst_case().guesses);
  EXPECT_LE(grid.trips().blocks, grid.worst_case().blocks);
  return outcome(field, warp, width_px, height_px);
}

TEST(FlowGrid, FollowsShiftZoomAndRotation) {
  const Warp warps[] = {{0, 0},       {0.4, -0.3},  {3.2, 1.7},      {-9.4, 6.1},
                        {0, 0, 1.02}, {1, 0, 0.97}, {0, 0, 1, 0.03}, {2, 1, 1.03, -0.04}};
  unsigned seed = 10;
  for (const Warp& warp : warps) {
    SCOPED_TRACE(testing::Message() << warp.shift_u << " " << warp.shift_v << " " << warp.gain << " " << warp.turn);
    const Outcome o = track(warp, 640, 480, 0, {}, seed += 10);
    EXPECT_GE(o.valid, 100);
    EXPECT_LT(o.median_px, 0.05);
    EXPECT_LT(o.p95_px, 0.2);
  }
}

TEST(FlowGrid, BearsNoise) {
  const Outcome o = track({2.3, -1.6, 1.01, 0.01}, 640, 480, 8, {}, 3);
  EXPECT_GE(o.valid, 100);
  EXPECT_LT(o.median_px, 0.15);
  EXPECT_LT(o.p95_px, 0.5);
}

TEST(FlowGrid, WorksOnOddAndSmallSizesAndOtherGrids) {
  for (const auto& [w, h] : {std::pair{316, 252}, {61, 47}, {752, 480}, {40, 200}}) {
    SCOPED_TRACE(testing::Message() << w << "x" << h);
    const Outcome o = track({1.3, 0.6}, w, h, 0, {.columns = 5, .rows = 4}, 77);
    EXPECT_GE(o.valid, 15);
    EXPECT_LT(o.median_px, 0.05);
  }
}

TEST(FlowGrid, BackwardCheckKeepsTrueFlowAndDropsNoise) {
  const FlowGridParams params{.max_backward_px = 0.5f};
  EXPECT_GE(track({2.5, -1.5}, 640, 480, 0, params, 8).valid, 95);
  Picture a{640, 480, 640, std::vector<std::uint8_t>(640 * 480)}, b = a;
  std::mt19937 random(4);
  for (auto& x : a.pixels) x = static_cast<std::uint8_t>(random());
  for (auto& x : b.pixels) x = static_cast<std::uint8_t>(random());
  FlowGrid grid(640, 480, params);
  FlowField field;
  grid.track(a.view(), b.view(), field);
  const auto valid =
      std::count_if(field.cells.begin(), field.cells.end(), [](const FlowCell& c) { return c.valid != 0; });
  EXPECT_LE(valid, 11);
}

TEST(FlowGrid, FlatCellsHaveNoFlow) {
  const Waves waves(5);
  Picture first = render(waves, {}, 640, 480, 0, 1);
  for (int v = 0; v < 240; ++v)
    std::fill_n(first.pixels.begin() + v * first.stride_px, first.width_px, std::uint8_t{90});
  FlowGrid grid(640, 480, {});
  FlowField field;
  grid.track(first.view(), first.view(), field);
  for (int c = 0; c < field.columns; ++c) {
    EXPECT_EQ(field.at(c, 0).valid, 0);
    EXPECT_EQ(field.at(c, 8).valid, 1);
    EXPECT_NEAR(field.at(c, 8).u_px, 0.f, 1e-3f);
  }
}

TEST(FlowGrid, BadViewsAndSizes) {
  const Picture good{640, 480, 640, std::vector<std::uint8_t>(640 * 480, 7)};
  FlowGrid grid(640, 480, {});
  FlowField field;
  const GrayView ok = good.view();
  for (const GrayView& bad : {GrayView{}, GrayView{ok.data, 640, 480, 320}, GrayView{ok.data, 320, 240, 640},
                              GrayView{nullptr, 640, 480, 640}, GrayView{ok.data, -1, 480, 640}}) {
    grid.track(bad, ok, field);
    for (const FlowCell& cell : field.cells) EXPECT_EQ(cell.valid, 0);
    grid.track(ok, bad, field);
    for (const FlowCell& cell : field.cells) EXPECT_EQ(cell.valid, 0);
  }
  EXPECT_THROW(FlowGrid(8, 8, {}), std::invalid_argument);
  EXPECT_THROW(FlowGrid(-5, 480, {}), std::invalid_argument);
  EXPECT_THROW(FlowGrid(640, 480, {.columns = 17}), std::invalid_argument);
  EXPECT_THROW(FlowGrid(640, 480, {.max_steps = 0}), std::invalid_argument);
}

TEST(FlowGrid, StaysWithinItsBoundOnHostileImages) {
  FlowGrid grid(640, 480, {});
  const FlowGridTrips worst = grid.worst_case();
  std::mt19937 random(6);
  const Waves waves(9);
  std::vector<Picture> pictures{render(waves, {}, 640, 480, 0, 1)};
  for (int kind = 0; kind < 4; ++kind) {
    Picture p{640, 480, 640, std::vector<std::uint8_t>(640 * 480)};
    for (int i = 0; i < 640 * 480; ++i) {
      const int checks = ((i % 640 / 8) + (i / 640 / 8)) % 2 * 255;
      const int values[] = {0, 255, checks, static_cast<int>(random() & 0xFF)};
      p.pixels[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(values[kind]);
    }
    pictures.push_back(std::move(p));
  }
  FlowField field;
  for (const Picture& a : pictures)
    for (const Picture& b : pictures) {
      grid.track(a.view(), b.view(), field);
      EXPECT_LE(grid.trips().passes, worst.passes);
      for (int i = 0; i < field.count(); ++i) {
        const FlowCell& cell = field.cells[static_cast<std::size_t>(i)];
        EXPECT_TRUE(std::isfinite(cell.u_px + cell.v_px + cell.quality + cell.residual));
        EXPECT_GE(cell.quality, 0.f);
        EXPECT_LE(cell.quality, 1.f);
      }
    }
}

TEST(FlowGrid, TakesNoMemory) {
  const Picture p = render(Waves(2), {}, 320, 240, 0, 1);
  FlowGrid grid(320, 240, {.max_backward_px = 1.f});
  FlowField field;
  grid.track(p.view(), p.view(), field);  // the SIMD dispatch chooses once
  const test::MallocCount count;
  {
    const rt::RealtimeSection section;
    grid.track(p.view(), p.view(), field);
  }
  EXPECT_EQ(count.violations(), 0u);
}

TEST(FlowGrid, FollowingAStreamEqualsTrackingPairs) {
  const Waves waves(31);
  std::vector<Picture> frames;
  for (int i = 0; i < 4; ++i) frames.push_back(render(waves, {1.7 * i, -0.9 * i * i}, 320, 240, 2, 50u + i));
  FlowGrid pairs(320, 240, {}), stream(320, 240, {});
  FlowField one, other;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    pairs.track(frames[i - 1].view(), frames[i].view(), one);
    stream.follow(frames[i - 1].view(), frames[i].view(), other);
    for (std::size_t k = 0; k < static_cast<std::size_t>(one.count()); ++k) {
      EXPECT_EQ(one.cells[k].u_px, other.cells[k].u_px);
      EXPECT_EQ(one.cells[k].v_px, other.cells[k].v_px);
      EXPECT_EQ(one.cells[k].valid, other.cells[k].valid);
    }
  }
  stream.follow(frames[3].view(), GrayView{}, other);
  EXPECT_EQ(other.at(5, 4).valid, 0);
  stream.follow(frames[0].view(), frames[1].view(), other);  // forgets what it kept
  pairs.track(frames[0].view(), frames[1].view(), one);
  EXPECT_EQ(one.at(5, 4).u_px, other.at(5, 4).u_px);
}

/// A wall moves by 4 px in front of a still background; its edge is 7 px beyond the centres of one column of cells.
TEST(FlowGrid, AtAnEdgeOfDepthTheSurfaceAtTheCentreWins) {
  const Waves wall(72);
  const Picture background = render(Waves(71), {}, 320, 240, 0, 1);
  const auto scene = [&](int shift) {
    Picture p = background;
    for (int v = 0; v < 240; ++v)
      for (int u = 0; u < 139 + 7 + shift; ++u)
        p.pixels[static_cast<std::size_t>(v * p.stride_px + u)] =
            static_cast<std::uint8_t>(std::clamp(std::lround(wall.at(u - shift, v)), 0L, 255L));
    return p;
  };
  const Picture first = scene(0), second = scene(4);
  FlowGrid grid(320, 240, {.columns = 8, .rows = 6});
  FlowField field;
  grid.track(first.view(), second.view(), field);
  ASSERT_EQ(field.at(3, 0).x_px, 139.5f);
  for (int r = 0; r < field.rows; ++r) {
    EXPECT_NEAR(field.at(3, r).u_px, 4.f, 0.2f);
    EXPECT_NEAR(field.at(3, r).v_px, 0.f, 0.2f);
    EXPECT_NEAR(field.at(5, r).u_px, 0.f, 0.1f);
  }
}

}  // namespace
}  // namespace wasp::vision
