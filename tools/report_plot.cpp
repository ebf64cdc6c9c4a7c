#include "tools/report_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "tools/report_page.h"

namespace wasp::tools {
namespace {

constexpr double kLeft = 54, kRight = 14, kBottom = 40, kLegendRow = 20, kCharacter = 6.4;

/// The rectangle of the axes and the ranges they show.
struct Frame {
  double x0, y0, x1, y1;  ///< pixels; y0 is the top
  Range x, y;
  [[nodiscard]] double px(double v) const { return x0 + (v - x.low) / x.span() * (x1 - x0); }
  [[nodiscard]] double py(double v) const { return y1 - (v - y.low) / y.span() * (y1 - y0); }
};

using Out = std::back_insert_iterator<std::string>;

Range widened(Range r, double least, double margin) {
  const double middle = 0.5 * (r.low + r.high);
  const double half = std::max(0.5 * r.span() * (1 + 2 * margin), 0.5 * (least > 0 ? least : 1e-3));
  return {middle - half, middle + half};
}

Range whole_decades(Range logs) {
  const double low = std::floor(logs.low + 1e-9);
  return {low, std::max(low + 1, std::ceil(logs.high - 1e-9))};
}

int legend_rows(const Plot& plot) {
  double x = kLeft;
  int rows = 1;
  for (const auto& c : plot.curves) {
    if (c.name.empty()) continue;
    const double wide = 34 + text_width(c.name);
    if (x > kLeft && x + wide > plot.width - kRight) {
      ++rows;
      x = kLeft;
    }
    x += wide;
  }
  return plot.curves.empty() ? 0 : rows;
}

void make_equal(Frame& f) {
  const double per_px = std::max(f.x.span() / (f.x1 - f.x0), f.y.span() / (f.y1 - f.y0));
  f.x = widened(f.x, per_px * (f.x1 - f.x0), 0);
  f.y = widened(f.y, per_px * (f.y1 - f.y0), 0);
}

Frame frame_of(const Plot& plot) {
  std::vector<const std::vector<double>*> xs, ys;
  for (const auto& c : plot.curves) {
    xs.push_back(&c.series.x);
    ys.push_back(&c.series.y);
  }
  Frame f{kLeft,
          8 + kLegendRow * legend_rows(plot) + (plot.spans.empty() ? 0 : 4),
          plot.width - kRight,
          plot.height - kBottom,
          {},
          {}};
  f.x = plot.equal_axes ? widened(range_of(xs), plot.least_y_span, 0.06) : widened(range_of(xs), 0, 0);
  f.y = widened(range_of(ys), plot.least_y_span, 0.06);
  if (plot.x_scale != Scale::kLinear) f.x = whole_decades(range_of(xs));
  if (plot.y_scale != Scale::kLinear) f.y = whole_decades(range_of(ys));
  if (plot.equal_axes) make_equal(f);
  return f;
}

void draw_spans(const Plot& plot, const Frame& f, Out out) {
  for (std::size_t i = 0; i < plot.spans.size(); ++i) {
    const Span& s = plot.spans[i];
    const double a = std::clamp(f.px(s.from), f.x0, f.x1), b = std::clamp(f.px(s.to), f.x0, f.x1);
    if (b <= a) continue;
    fmt::format_to(out,
                   "<rect class='span{}' x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}'><title>{}</title></rect>",
                   i % 2, a, f.y0, b - a, f.y1 - f.y0, escape_html(s.name));
  }
}

/// Names of the spans that have room for them, over the grid.
void draw_span_names(const Plot& plot, const Frame& f, Out out) {
  for (const Span& s : plot.spans) {
    const double a = std::clamp(f.px(s.from), f.x0, f.x1), b = std::clamp(f.px(s.to), f.x0, f.x1);
    if (text_width(s.name) + 8 < b - a)
      fmt::format_to(out, "<text class='faint halo' x='{:.1f}' y='{:.1f}'>{}</text>", a + 4, f.y0 + 13,
                     escape_html(s.name));
  }
}

struct Tick {
  double at;
  std::string text;
};

std::vector<Tick> ticks_of(Scale scale, Range range, int wanted) {
  std::vector<Tick> ticks;
  if (scale == Scale::kLinear) {
    const auto values = nice_ticks(range, wanted);
    const double step = values.size() > 1 ? values[1] - values[0] : 1;
    for (const double v : values) ticks.push_back({v, tick_text(v, step)});
    return ticks;
  }
  for (int d = static_cast<int>(std::ceil(range.low - 1e-9)); d <= std::floor(range.high + 1e-9); ++d)
    ticks.push_back(
        {static_cast<double>(d), scale == Scale::kLog ? fmt::format("{:g}", std::pow(10.0, d)) : decade_text(d)});
  return ticks;
}

void draw_axes(const Plot& plot, const Frame& f, Out out) {
  const auto xs = ticks_of(plot.x_scale, f.x, std::max(3, static_cast<int>((f.x1 - f.x0) / 90)));
  const auto ys = ticks_of(plot.y_scale, f.y, std::max(3, static_cast<int>((f.y1 - f.y0) / 45)));
  for (const auto& [v, text] : ys) {
    fmt::format_to(out, "<path class='grid' d='M{:.1f} {:.1f}H{:.1f}'/>", f.x0, f.py(v), f.x1);
    fmt::format_to(out, "<text class='end' x='{:.1f}' y='{:.1f}'>{}</text>", f.x0 - 6, f.py(v) + 4, text);
  }
  for (const auto& [v, text] : xs) {
    fmt::format_to(out, "<path class='grid' d='M{:.1f} {:.1f}V{:.1f}'/>", f.px(v), f.y0, f.y1);
    fmt::format_to(out, "<text class='mid' x='{:.1f}' y='{:.1f}'>{}</text>", f.px(v), f.y1 + 16, text);
  }
  fmt::format_to(out, "<path class='axis' d='M{0:.1f} {1:.1f}V{3:.1f}H{2:.1f}'/>", f.x0, f.y0, f.x1, f.y1);
  fmt::format_to(out, "<text class='mid name' x='{:.1f}' y='{}'>{}</text>", 0.5 * (f.x0 + f.x1), plot.height - 6,
                 escape_html(plot.x_label));
  fmt::format_to(out, "<text class='mid name' transform='translate(13 {:.1f}) rotate(-90)'>{}</text>",
                 0.5 * (f.y0 + f.y1), escape_html(plot.y_label));
}

void draw_curve(const Curve& curve, const Frame& f, Out out) {
  fmt::format_to(out, "<path class='line {} {}' d='", curve.style.colour, curve.style.stroke);
  bool pen_down = false;
  for (std::size_t i = 0; i < curve.series.size(); ++i) {
    const double x = curve.series.x[i], y = curve.series.y[i];
    const bool drawable = std::isfinite(x) && std::isfinite(y);
    if (drawable && curve.style.stroke == "dots")
      fmt::format_to(out, "M{:.1f} {:.1f}h.01", f.px(x), f.py(y));
    else if (drawable) fmt::format_to(out, "{}{:.1f} {:.1f}", pen_down ? 'L' : 'M', f.px(x), f.py(y));
    pen_down = drawable;
  }
  fmt::format_to(out, "'/>");
}

void draw_legend(const Plot& plot, Out out) {
  double x = kLeft, y = 14;
  for (const auto& c : plot.curves) {
    if (c.name.empty()) continue;
    const double wide = 34 + text_width(c.name);
    if (x > kLeft && x + wide > plot.width - kRight) {
      x = kLeft;
      y += kLegendRow;
    }
    fmt::format_to(out, "<path class='line {} {}' d='M{:.1f} {:.1f}h18'/><text x='{:.1f}' y='{:.1f}'>{}</text>",
                   c.style.colour, c.style.stroke, x, y - 4, x + 23, y, escape_html(c.name));
    x += wide;
  }
}

void draw_marks(const Plot& plot, const Frame& f, Out out) {
  for (const auto& m : plot.marks)
    fmt::format_to(out,
                   "<circle class='mark' cx='{0:.1f}' cy='{1:.1f}' r='4'/><text x='{2:.1f}' y='{3:.1f}'>{4}</text>",
                   f.px(m.x), f.py(m.y), f.px(m.x) + 7, f.py(m.y) - 6, escape_html(m.name));
}

}  // namespace

std::string escape_html(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else if (c == '\'')
      out += "&#39;";
    else
      out += c;
  }
  return out;
}

std::string decade_text(int decade) {
  constexpr std::array<const char*, 4> kUnits = {"ns", "us", "ms", "s"};
  const int unit = std::clamp(decade / 3, 0, 3);
  return fmt::format("{:g} {}", std::pow(10.0, decade - 3 * unit), kUnits[static_cast<std::size_t>(unit)]);
}

std::string standalone_svg(const std::string& svg) {
  const std::size_t head = svg.find('>') + 1;
  return fmt::format("<svg xmlns='http://www.w3.org/2000/svg'{}<style>{}svg{{background:var(--card)}}</style>{}\n",
                     svg.substr(4, head - 4), report_style(), svg.substr(head));
}

std::string tick_text(double value, double step) {
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 6);
  return fmt::format("{:.{}f}", value, decimals);
}

double text_width(std::string_view text) { return kCharacter * static_cast<double>(text.size()); }

std::string Plot::svg() const {
  std::string text;
  const Out out(text);
  fmt::format_to(out, "<svg viewBox='0 0 {} {}' role='img' aria-label='{}'>", width, height, escape_html(title));
  const Frame f = frame_of(*this);
  draw_spans(*this, f, out);
  draw_axes(*this, f, out);
  for (const auto& c : curves) draw_curve(c, f, out);
  draw_span_names(*this, f, out);
  draw_marks(*this, f, out);
  draw_legend(*this, out);
  text += "</svg>";
  return text;
}

}  // namespace wasp::tools
