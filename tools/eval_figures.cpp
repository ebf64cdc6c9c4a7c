// Statistics on small vectors, and printing.
#include "tools/eval_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>

namespace wasp::tools {
namespace {

double quantile(const std::vector<double>& sorted, double q) {
  const auto i = static_cast<std::size_t>(std::ceil(q * static_cast<double>(sorted.size())));
  return sorted[std::clamp<std::size_t>(i, 1, sorted.size()) - 1];
}

/// Ranks, ties share their mean rank.
std::vector<double> ranks(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return values[i] < values[j]; });
  std::vector<double> out(values.size());
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    while (end < order.size() && !(values[order[begin]] < values[order[end]])) ++end;
    for (std::size_t i = begin; i < end; ++i) out[order[i]] = 0.5 * static_cast<double>(begin + end - 1);
  }
  return out;
}

}  // namespace

bool Figure::ok() const {
  if (!bar) return true;
  return bar->at_least ? value >= bar->value : value <= bar->value;  // false for NaN
}

Spread spread(std::vector<double> values) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  if (values.empty()) return {kNan, kNan, kNan, kNan};
  std::sort(values.begin(), values.end());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  return {mean, quantile(values, 0.5), quantile(values, 0.95), values.back()};
}

void add_spread(std::vector<Figure>& figures, const std::string& prefix, const std::string& unit,
                const std::vector<double>& values, std::optional<Bar> bar) {
  const Spread s = spread(values);
  figures.push_back({prefix + "_mean", s.mean, unit});
  figures.push_back({prefix + "_median", s.median, unit});
  figures.push_back({prefix + "_p95", s.p95, unit});
  figures.push_back({prefix + "_max", s.max, unit, bar});
}

void add_times(std::vector<Figure>& figures, std::vector<double> times_us) {
  if (times_us.empty()) return;
  std::sort(times_us.begin(), times_us.end());
  figures.push_back({"time_p50", quantile(times_us, 0.5), "us"});
  figures.push_back({"time_p999", quantile(times_us, 0.999), "us"});
  figures.push_back({"time_max", times_us.back(), "us"});
}

bool print(const std::vector<Figure>& figures, bool json) {
  for (const Figure& f : figures) {
    if (json) {
      nlohmann::ordered_json line = {{"name", f.name}, {"value", f.value}, {"unit", f.unit}, {"bar", nullptr}};
      if (f.bar) line["bar"] = f.bar->value;
      line["ok"] = f.ok();
      fmt::print("{}\n", line.dump());
      continue;
    }
    const std::string bar =
        f.bar ? fmt::format("  {} {:g}  {}", f.bar->at_least ? ">=" : "<=", f.bar->value, f.ok() ? "ok" : "NOT MET")
              : "";
    fmt::print("{:<28}{:>12.4f} {:<6}{}\n", f.name, f.value, f.unit, bar);
  }
  return std::all_of(figures.begin(), figures.end(), [](const Figure& f) { return f.ok(); });
}

double rank_correlation(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() < 2 || a.size() != b.size()) return std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> x = ranks(a), y = ranks(b);
  const double middle = 0.5 * static_cast<double>(a.size() - 1);
  double xy = 0, xx = 0, yy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xy += (x[i] - middle) * (y[i] - middle);
    xx += (x[i] - middle) * (x[i] - middle);
    yy += (y[i] - middle) * (y[i] - middle);
  }
  return xy / std::sqrt(xx * yy);
}

}  // namespace wasp::tools
