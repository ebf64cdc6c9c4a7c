#include "tools/report_series.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace wasp::tools {
namespace {

void add_slice(const Series& from, std::size_t begin, std::size_t end, Series& to) {
  std::size_t least = end, greatest = end, gap = end;
  for (std::size_t i = begin; i < end; ++i) {
    if (std::isnan(from.y[i])) {
      gap = i;
      continue;
    }
    if (least == end || from.y[i] < from.y[least]) least = i;
    if (greatest == end || from.y[i] > from.y[greatest]) greatest = i;
  }
  std::vector<std::size_t> keep = {least, greatest, gap};
  std::sort(keep.begin(), keep.end());
  keep.erase(std::unique(keep.begin(), keep.end()), keep.end());
  for (const std::size_t i : keep)
    if (i != end) to.add(from.x[i], from.y[i]);
}

}  // namespace

Series thin_envelope(const Series& series, std::size_t slices) {
  if (series.size() <= 3 * slices) return series;
  Series thin;
  for (std::size_t s = 0; s < slices; ++s)
    add_slice(series, s * series.size() / slices, (s + 1) * series.size() / slices, thin);
  return thin;
}

Series thin_path(const Series& series, double distance) {
  Series thin;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const bool last = i + 1 == series.size();
    if (last || thin.size() == 0 || std::hypot(series.x[i] - thin.x.back(), series.y[i] - thin.y.back()) >= distance)
      thin.add(series.x[i], series.y[i]);
  }
  return thin;
}

Range range_of(const std::vector<const std::vector<double>*>& values) {
  Range range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const auto* vector : values)
    for (const double v : *vector)
      if (std::isfinite(v)) {
        range.low = std::min(range.low, v);
        range.high = std::max(range.high, v);
      }
  return range.low <= range.high ? range : Range{};
}

std::vector<double> nice_ticks(Range range, int wanted) {
  if (!(range.span() > 0) || !std::isfinite(range.span())) return {range.low};
  const double raw = range.span() / wanted;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10 * power;
  for (const double multiple : {1.0, 2.0, 5.0})
    if (multiple * power >= raw * 0.7) {
      step = multiple * power;
      break;
    }
  std::vector<double> ticks;
  for (double k = std::ceil(range.low / step - 1e-9); k * step <= range.high + 1e-9 * step && ticks.size() < 100;
       k += 1)
    ticks.push_back(k * step == 0 ? 0.0 : k * step);
  return ticks;
}

}  // namespace wasp::tools
