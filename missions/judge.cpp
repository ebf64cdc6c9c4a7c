#include "missions/judge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "missions/measures.h"
#include "tools/quantiles.h"

namespace wasp::missions {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr bool kAtMost = true, kAtLeast = false;

Bar flown() { return {"flown to its end", Over::kWorstLow, "", kAtLeast, 1}; }
Bar no_collision() { return {"collisions", Over::kSum, "", kAtMost, 0}; }

std::vector<Bar> yaw_bars(double correlation) {
  return {flown(),
          {"yaw rate correlation", Over::kWorstLow, "", kAtLeast, correlation},
          {"yaw rate RMS error", Over::kMean, "rad/s", kAtMost, kNone},
          {"share of frames with a yaw rate", Over::kMean, "", kAtMost, kNone}};
}

std::vector<Bar> city_bars() {
  return {no_collision(),
          {"least distance to a box", Over::kWorstLow, "m", kAtLeast, kNone},
          {"mean height over obstacles", Over::kMean, "m", kAtMost, kNone},
          {"mean height", Over::kMean, "m", kAtMost, kNone},
          {"overshoot above the setpoint", Over::kWorstHigh, "m", kAtMost, kNone},
          {"way flown", Over::kWorstLow, "m", kAtLeast, kNone}};
}

const std::vector<Judge>& judges() {
  static const std::vector<Judge> kJudges{
      {"hover", &measure_hover, {flown(), {"RMS height error", Over::kWorstHigh, "m", kAtMost, 0.03},
                                 {"greatest excursion", Over::kWorstHigh, "m", kAtMost, 0.15}}},
      {"turntable", &measure_yaw, yaw_bars(0.98)},
      {"hover-yaw", &measure_yaw, yaw_bars(0.95)},
      {"aggressive", &measure_yaw, yaw_bars(0.90)},
      {"wall", &measure_wall, {no_collision(),
                               {"frames from avoid to impact", Over::kWorstLow, "", kAtLeast, 15},
                               {"closest approach", Over::kWorstLow, "m", kAtLeast, kNone}}},
      {"corridor-empty", &measure_corridor, {no_collision(),
                                             {"false avoids", Over::kSum, "", kAtMost, 0},
                                             {"lateral RMS by width", Over::kWorstHigh, "", kAtMost, 0.10},
                                             {"way flown", Over::kWorstLow, "m", kAtLeast, 20}}},
      {"corridor", &measure_corridor, {{"collisions", Over::kMean, "", kAtMost, 0.01},
                                       {"least distance", Over::kWorstLow, "m", kAtLeast, kNone},
                                       {"lateral RMS by width", Over::kMean, "", kAtMost, kNone},
                                       {"way flown", Over::kWorstLow, "m", kAtLeast, kNone}}},
      {"arena", &measure_arena, {{"height follows the edge", Over::kWorstLow, "", kAtLeast, 1},
                                 {"share of the step followed", Over::kWorstLow, "", kAtLeast, kNone},
                                 {"time to follow half the step", Over::kWorstHigh, "s", kAtMost, kNone}}},
      {"city-max", &measure_city, city_bars()},
      {"city-near", &measure_city, city_bars()},
      {"city-defocus", &measure_city, city_bars()},
      {"edge-height", &measure_edge_height, {flown(),
                                             {"lambda estimated", Over::kMedian, "1/m", kAtMost, kNone},
                                             {"lambda of the ground", Over::kMedian, "1/m", kAtMost, kNone},
                                             {"height error once lambda is known, median share", Over::kMedian, "", kAtMost, kNone}}},
      {"landing", &measure_landing, {{"ventral flow held, mean error", Over::kWorstHigh, "", kAtMost, kNone},
                                     {"height at the end", Over::kWorstHigh, "m", kAtMost, kNone},
                                     {"sink rate at the end", Over::kWorstHigh, "m/s", kAtMost, kNone}}},
      {"all", &measure_all, {flown(), no_collision(),
                             {"behaviours that ran", Over::kWorstLow, "", kAtLeast, kNone},
                             {"share of steps over budget", Over::kWorstHigh, "", kAtMost, 0.001}}},
  };
  return kJudges;
}

double combine(Over over, const std::vector<double>& v) {
  if (v.empty() || std::any_of(v.begin(), v.end(), [](double x) { return std::isnan(x); })) return kNone;
  switch (over) {
    case Over::kWorstHigh:
      return *std::max_element(v.begin(), v.end());
    case Over::kWorstLow:
      return *std::min_element(v.begin(), v.end());
    case Over::kMedian:
      return tools::median(v);
    case Over::kSum:
      return std::accumulate(v.begin(), v.end(), 0.0);
    case Over::kMean:
      break;
  }
  return std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
}

const char* word(Over over, std::size_t runs) {
  if (runs < 2) return "";
  constexpr std::array kWords{", greatest", ", least", ", mean", ", median", ", in all"};
  return kWords[static_cast<std::size_t>(over)];
}

}  // namespace

const Judge* judge_of(const std::string& mission) {
  for (const Judge& j : judges())
    if (mission == j.mission) return &j;
  return nullptr;
}

double value_of(const Measures& measures, const std::string& name) {
  for (const auto& [n, v] : measures)
    if (n == name) return v;
  return kNone;
}

std::vector<tools::Result> verdict(const Judge& judge, const std::vector<Measures>& runs) {
  std::vector<tools::Result> results;
  for (const Bar& bar : judge.bars) {
    std::vector<double> values;
    for (const Measures& m : runs) values.push_back(value_of(m, bar.measure));
    const double value = combine(bar.over, values);
    tools::Result r{std::string(bar.measure) + word(bar.over, runs.size()), value, bar.unit, "", true};
    if (!std::isnan(bar.bound)) {
      r.bar = (bar.at_most ? "<= " : ">= ") + nlohmann::json(bar.bound).dump();
      r.ok = bar.at_most ? value <= bar.bound : value >= bar.bound;
    }
    results.push_back(std::move(r));
  }
  return results;
}

}  // namespace wasp::missions
