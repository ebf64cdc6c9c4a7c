#include "missions/judge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
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

Bar only_told(const char* measure, Over over, const char* unit) { return {measure, over, unit, kAtMost, kNone}; }

std::vector<Bar> yaw_bars(double correlation) {
  return {flown(),
          {"yaw rate correlation", Over::kWorstLow, "", kAtLeast, correlation},
          {"share of frames with a yaw rate", Over::kWorstLow, "", kAtLeast, 0.8},
          only_told("yaw rate RMS error", Over::kMean, "rad/s"),
          only_told("correlation by log-polar maps", Over::kMean, "")};
}

std::vector<Bar> city_bars() {
  return {flown(),
          no_collision(),
          {"way flown", Over::kWorstLow, "m", kAtLeast, 60},
          only_told("least distance to a box", Over::kWorstLow, "m"),
          only_told("mean height over obstacles", Over::kMean, "m"),
          only_told("mean height", Over::kMean, "m"),
          only_told("overshoot above the setpoint", Over::kWorstHigh, "m")};
}

std::vector<Bar> corridor_bars(double collisions) {
  return {flown(),
          {"collisions", Over::kMean, "", kAtMost, collisions},
          {"way flown", Over::kWorstLow, "m", kAtLeast, 20},
          only_told("least distance", Over::kWorstLow, "m")};
}

std::vector<Bar> with(std::vector<Bar> bars, std::initializer_list<Bar> more) {
  bars.insert(bars.end(), more);
  return bars;
}

const std::vector<Judge>& judges() {
  static const Bar kStill{"lateral RMS by width", Over::kWorstHigh, "", kAtMost, 0.10};
  static const Bar kNoFalseAvoid{"false avoids", Over::kSum, "", kAtMost, 0};
  static const std::vector<Bar> kHover{flown(),
                                       {"RMS height error", Over::kWorstHigh, "m", kAtMost, 0.03},
                                       {"greatest excursion", Over::kWorstHigh, "m", kAtMost, 0.15}};
  static const std::vector<Judge> kJudges{
      {"hover", &measure_hover, kHover},
      {"turntable", &measure_yaw, yaw_bars(0.98)},
      {"hover-yaw", &measure_yaw, yaw_bars(0.95)},
      {"aggressive", &measure_yaw, yaw_bars(0.90)},
      {"wall",
       &measure_wall,
       {flown(),
        no_collision(),
        {"frames from avoid to impact", Over::kWorstLow, "", kAtLeast, 15},
        {"ticks with avoid before the approach", Over::kSum, "", kAtMost, 0},
        {"speed at avoid", Over::kWorstLow, "m/s", kAtLeast, 0.5},
        {"closest approach", Over::kWorstHigh, "m", kAtMost, 2.5},
        only_told("frames from avoid to impact", Over::kWorstHigh, ""),
        only_told("closest approach", Over::kWorstLow, "m")}},
      {"corridor-empty", &measure_corridor, with(corridor_bars(0), {kStill, kNoFalseAvoid})},
      {"bee", &measure_corridor,
       with(corridor_bars(0), {kStill, kNoFalseAvoid, only_told("mean speed", Over::kMean, "m/s")})},
      {"corridor", &measure_corridor,
       with(corridor_bars(0.01),
            {only_told("lateral RMS by width", Over::kMean, ""), only_told("false avoids", Over::kSum, "")})},
      {"arena",
       &measure_arena,
       {flown(),
        {"height follows the edge", Over::kWorstLow, "", kAtLeast, 1},
        only_told("share of the step followed", Over::kWorstLow, ""),
        only_told("share of the step followed", Over::kWorstHigh, ""),
        only_told("time to follow half the step", Over::kWorstHigh, "s")}},
      {"city-max", &measure_city, city_bars()},
      {"city-near", &measure_city, city_bars()},
      {"city-defocus", &measure_city, city_bars()},
      {"edge-height",
       &measure_edge_height,
       {flown(),
        {"height error once lambda is known, median share", Over::kMedian, "", kAtMost, 0.35},
        only_told("lambda estimated", Over::kMedian, "1/m"),
        only_told("lambda of the ground", Over::kMedian, "1/m")}},
      {"landing",
       &measure_landing,
       {flown(),
        {"height at the end", Over::kWorstHigh, "m", kAtMost, 0.5},
        {"sink rate at the end", Over::kWorstHigh, "m/s", kAtMost, 0.2},
        {"ventral flow off its setpoint, RMS share", Over::kWorstHigh, "", kAtMost, 0.3}}},
      {"all", &measure_all,
       with(kHover, {no_collision(),
                     {"enabled behaviours that were silent", Over::kSum, "", kAtMost, 0},
                     {"share of steps over budget", Over::kWorstHigh, "", kAtMost, 0.001, true}})},
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

const Judge& judge_of(const std::string& mission) {
  static const Judge kAnother{"", &measure_flight, {flown()}};
  for (const Judge& j : judges())
    if (mission == j.mission) return j;
  return kAnother;
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
    if (bar.if_told && std::isnan(value)) continue;
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
