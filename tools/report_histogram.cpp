#include "tools/report_histogram.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "tools/report_plot.h"

namespace wasp::tools {
namespace {

constexpr double kWidth = 520, kHeight = 210, kLeft = 46, kRight = 14, kTop = 44, kBottom = 38;
constexpr std::size_t kBars = 92;
using Out = std::back_insert_iterator<std::string>;

struct Axes {
  double log_low, log_high, log_top;
  [[nodiscard]] double px(double ns) const {
    const double at = (std::log10(std::max(ns, 1.0)) - log_low) / (log_high - log_low);
    return kLeft + std::clamp(at, 0.0, 1.0) * (kWidth - kLeft - kRight);
  }
  /// Counts start at 0.7 so that one sample shows.
  [[nodiscard]] double py(double count) const {
    const double base = std::log10(0.7);
    return kHeight - kBottom -
           (std::log10(std::max(count, 0.7)) - base) / (log_top - base) * (kHeight - kTop - kBottom);
  }
};

/// Histogram buckets gathered into the bars of the panel.
std::array<double, kBars> bars_of(const StageSummary& stage, const Axes& axes) {
  std::array<double, kBars> bars{};
  for (const auto& [low_ns, count] : stage.buckets) {
    const double share = (axes.px(static_cast<double>(low_ns)) - kLeft) / (kWidth - kLeft - kRight);
    bars[std::min(kBars - 1, static_cast<std::size_t>(share * kBars))] += static_cast<double>(count);
  }
  return bars;
}

void draw_axes(const Axes& axes, Out out) {
  const double bottom = kHeight - kBottom;
  for (int d = static_cast<int>(axes.log_low); d <= static_cast<int>(axes.log_high); ++d) {
    const double x = axes.px(std::pow(10.0, d));
    fmt::format_to(out, "<path class='grid' d='M{0:.1f} {1}V{2}'/><text class='mid' x='{0:.1f}' y='{3}'>{4}</text>", x,
                   kTop, bottom, bottom + 16, decade_text(d));
  }
  const int step = axes.log_top > 4 ? 2 : 1;
  for (int d = 0; d <= static_cast<int>(axes.log_top); d += step) {
    const double y = axes.py(std::pow(10.0, d));
    fmt::format_to(out, "<path class='grid' d='M{0} {1:.1f}H{2}'/><text class='end' x='{3}' y='{4:.1f}'>{5:.0f}</text>",
                   kLeft, y, kWidth - kRight, kLeft - 5, y + 4, std::pow(10.0, d));
  }
  fmt::format_to(out, "<path class='axis' d='M{0} {1}V{2}H{3}'/>", kLeft, kTop, bottom, kWidth - kRight);
  fmt::format_to(out, "<text class='mid name' x='{}' y='{}'>duration (logarithmic)</text>",
                 0.5 * (kLeft + kWidth - kRight), kHeight - 5);
  fmt::format_to(out, "<text class='mid name' transform='translate(10 {}) rotate(-90)'>samples</text>",
                 0.5 * (kTop + bottom));
}

void draw_bars(const StageSummary& stage, const Axes& axes, Out out) {
  const auto bars = bars_of(stage, axes);
  const double wide = (kWidth - kLeft - kRight) / static_cast<double>(kBars);
  fmt::format_to(out, "<path class='bar' d='");
  for (std::size_t i = 0; i < kBars; ++i)
    if (bars[i] > 0)
      fmt::format_to(out, "M{:.1f} {}V{:.1f}h{:.1f}V{}z", kLeft + static_cast<double>(i) * wide, kHeight - kBottom,
                     axes.py(bars[i]), wide - 0.6, kHeight - kBottom);
  fmt::format_to(out, "'/>");
}

struct QuantileMark {
  std::string name;
  double x;
};

/// p50, p99, p99.9 and max from left to right; those that fall together share a name.
std::vector<QuantileMark> marks_of(const StageSummary& s, const Axes& axes) {
  const std::array<std::pair<const char*, std::int64_t>, 4> all = {
      {{"p50", s.p50_ns}, {"p99", s.p99_ns}, {"p99.9", s.p999_ns}, {"max", s.max_ns}}};
  std::vector<QuantileMark> marks;
  for (const auto& [name, ns] : all) {
    const double x = axes.px(static_cast<double>(ns));
    if (!marks.empty() && x - marks.back().x < 3) {
      marks.back().name.append(", ").append(name);
      marks.back().x = x;
    } else {
      marks.push_back({name, x});
    }
  }
  return marks;
}

/// A label that would touch the one before it goes one row up, of three.
void draw_marks(const StageSummary& s, const Axes& axes, Out out) {
  std::array<double, 3> row_end = {-1e9, -1e9, -1e9};
  for (const auto& [name, x] : marks_of(s, axes)) {
    const double half = 0.5 * text_width(name);
    const double centre = std::clamp(x, half + 2, kWidth - half - 2);
    std::size_t row = 0;
    while (row + 1 < row_end.size() && centre - half < row_end[row] + 3) ++row;
    row_end[row] = centre + half;
    fmt::format_to(out, "<path class='quantile' d='M{:.1f} {}V{}'/><text class='mid' x='{:.1f}' y='{}'>{}</text>", x,
                   kTop - 2, kHeight - kBottom, centre, kTop - 4 - 13 * static_cast<double>(row), name);
  }
  if (s.budget_ns <= 0) return;
  const double x = axes.px(static_cast<double>(s.budget_ns));
  const bool left = x > kWidth - 70;
  fmt::format_to(
      out,
      "<path class='budget' d='M{0:.1f} {1}V{2}'/><text class='budget-text halo {5}' x='{3:.1f}' y='{4}'>budget</text>",
      x, kTop, kHeight - kBottom, left ? x - 4 : x + 4, kTop + 12, left ? "end" : "");
}

}  // namespace

LogRange log_range_of(const std::vector<StageSummary>& stages) {
  double low = 1e18, high = 1;
  for (const auto& s : stages) {
    if (s.count == 0) continue;
    low = std::min(low, static_cast<double>(std::max<std::int64_t>(s.min_ns, 1)));
    high = std::max({high, static_cast<double>(s.max_ns), static_cast<double>(s.budget_ns)});
  }
  if (low > high) return {};
  const double low_decade = std::floor(std::log10(low) + 1e-12), high_decade = std::ceil(std::log10(high) - 1e-12);
  return {std::pow(10.0, low_decade), std::pow(10.0, std::max(high_decade, low_decade + 1))};
}

std::string histogram_svg(const StageSummary& stage, const LogRange& range) {
  Axes axes{std::round(std::log10(range.low_ns)), std::round(std::log10(range.high_ns)), 1};
  const auto bars = bars_of(stage, axes);
  axes.log_top = std::max(1.0, std::log10(*std::max_element(bars.begin(), bars.end())) + 0.1);
  std::string text;
  const Out out(text);
  fmt::format_to(out, "<svg viewBox='0 0 {} {}' role='img' aria-label='Latency histogram of {} {}'>", kWidth, kHeight,
                 escape_html(stage.owner), escape_html(stage.stage));
  draw_axes(axes, out);
  draw_bars(stage, axes, out);
  draw_marks(stage, axes, out);
  text += "</svg>";
  return text;
}

}  // namespace wasp::tools
