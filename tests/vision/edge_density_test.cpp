#include "vision/kernels/edge_density.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"

namespace wasp::vision {
namespace {

/// A flight: hover, `climb_m` up with a smooth ramp of three seconds from t = 4 s, hover, for 12 s.
struct Flight {
  double lambda = 1.5, height_m = 1.2, climb_m = 1.0, bias_mps2 = 0.02, noise_share = 0.04, start_climb_mps = 0.0;
  int copies = 1;  ///< how often in a row, up and down in turn

  [[nodiscard]] double risen(double t) const {
    double sum = start_climb_mps * t;
    for (int i = 0; i < copies; ++i) {
      const double s = std::clamp((t - 4.0 - 12.0 * i) / 3.0, 0.0, 1.0);
      sum += (i % 2 == 0 ? climb_m : -climb_m) * s * s * (3 - 2 * s);
    }
    return sum;
  }
};

EdgeDensityState fly(const Flight& f, const EdgeDensityParams& params, unsigned seed, float guess) {
  EdgeDensityState state;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const double dt = 0.04;
  double error = 0;
  const auto speed = [&](double t) { return (f.risen(t + 1e-4) - f.risen(t - 1e-4)) / 2e-4; };
  for (int i = 0; i < 300 * f.copies; ++i) {
    const double t = i * dt;
    error = 0.9 * error + std::sqrt(1 - 0.81) * f.noise_share * normal(random);  // correlated over ten frames
    const double mu = f.lambda * (f.height_m + f.risen(t)) * (1 + error);
    const double up = (speed(t) - speed(t - dt)) / dt + f.bias_mps2 + 0.03 * normal(random);
    observe_edge_density(params, static_cast<TimeNs>(t * 1e9), mu, true, up, guess, state);
  }
  return state;
}

TEST(EdgeDensity, IsFoundFromOneClimbWhateverTheFirstGuess) {
  for (const double lambda : {0.35, 1.5, 3.1})
    for (const float guess : {0.7f, 2.f}) {
      int found = 0;
      for (unsigned seed = 0; seed < 10; ++seed) {
        const EdgeDensityState s = fly({.lambda = lambda}, {}, seed, guess);
        if (s.density.accepted == 0) continue;
        ++found;
        EXPECT_NEAR(static_cast<double>(s.density.edges_per_m), lambda, 0.35 * lambda) << seed;
        EXPECT_LE(static_cast<double>(s.density.sigma), 0.15 * 1.01 * static_cast<double>(s.density.edges_per_m));
      }
      EXPECT_GE(found, 7) << lambda << " " << guess;
    }
}

TEST(EdgeDensity, SigmaTellsTheError) {
  double squares = 0;
  int n = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    const EdgeDensityState s = fly({}, {}, seed, 1.f);
    if (s.density.accepted == 0) continue;
    const double z = (static_cast<double>(s.density.edges_per_m) - 1.5) / static_cast<double>(s.density.sigma);
    squares += z * z;
    ++n;
  }
  ASSERT_GT(n, 25);
  EXPECT_LT(std::sqrt(squares / n), 2.0);
  EXPECT_GT(std::sqrt(squares / n), 0.3);
}

TEST(EdgeDensity, MoreClimbsRefineIt) {
  const EdgeDensityState once = fly({}, {}, 1, 1.f), often = fly({.copies = 6}, {}, 1, 1.f);
  ASSERT_GT(often.density.accepted, once.density.accepted);
  EXPECT_LT(often.density.sigma, once.density.sigma);
  EXPECT_NEAR(often.density.edges_per_m, 1.5f, 0.2f);
}

TEST(EdgeDensity, HoverSteadyClimbAndBiasSayNothing) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    EXPECT_EQ(fly({.climb_m = 0.0}, {}, seed, 1.f).density.accepted, 0);
    EXPECT_EQ(fly({.climb_m = 0.1}, {}, seed, 1.f).density.accepted, 0);
    EXPECT_EQ(fly({.climb_m = 0.0, .bias_mps2 = 0.15}, {}, seed, 1.f).density.accepted, 0);
    EXPECT_EQ(fly({.climb_m = 0.0, .start_climb_mps = 0.2}, {}, seed, 1.f).density.accepted, 0);
  }
}

TEST(EdgeDensity, GapsTimeBackwardsAndLostAccelerationStartANewWindow) {
  EdgeDensityState state;
  const auto feed = [&](TimeNs t, double up, bool valid = true) {
    observe_edge_density({}, t, 1.0, valid, up, 1.f, state);
    return state.count;
  };
  EXPECT_EQ(feed(0, 0.1), 0);
  EXPECT_EQ(feed(100 * kMillisecond, 0.1), 1);
  EXPECT_EQ(feed(200 * kMillisecond, 0.1), 2);
  EXPECT_EQ(feed(900 * kMillisecond, 0.1), 0);  // a gap
  EXPECT_EQ(feed(1000 * kMillisecond, 0.1), 1);
  EXPECT_EQ(feed(1100 * kMillisecond, 0.1, false), 0);
  EXPECT_EQ(feed(1200 * kMillisecond, 0.1), 1);
  EXPECT_EQ(feed(500 * kMillisecond, 0.1), 0);
  EXPECT_EQ(feed(600 * kMillisecond, std::numeric_limits<double>::quiet_NaN()), 0);
  for (const TimeNs t : {kNever, std::numeric_limits<TimeNs>::max(), TimeNs{0}}) EXPECT_EQ(feed(t, 0.0), 0);
  EdgeDensityParams odd;
  odd.window_s = std::numeric_limits<float>::quiet_NaN();
  for (int i = 1; i < 200; ++i) observe_edge_density(odd, i * 50 * kMillisecond, 1.0, true, 0.1, 1.f, state);
  EXPECT_EQ(state.density.accepted, 0);
}

TEST(EdgeDensity, TakesNoMemory) {
  const wasp::test::MallocCount count;
  {
    const rt::RealtimeSection section;
    EdgeDensityState state;
    for (int i = 0; i < 200; ++i)
      observe_edge_density({}, i * 50 * kMillisecond, 1.0 + 0.01 * i, true, 0.1, 1.f, state);
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
