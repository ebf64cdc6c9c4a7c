// Pictures: for each load the share of releases that came later than x, both axes logarithmic, so that one in ten
// thousand is as plain as the median; and the same from exposure to byte for every behaviour.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>

#include "benchmarks/latency_report.h"
#include "rt/process.h"
#include "tools/report_page.h"
#include "tools/report_plot.h"

namespace wasp::bench {
namespace {

namespace fs = std::filesystem;

/// Decimal logarithms of (latency, share of samples at least that late): at most a few hundred points, the tail whole.
tools::Series tail_of(std::vector<std::int64_t> samples_ns) {
  tools::Series series;
  std::sort(samples_ns.begin(), samples_ns.end());
  const std::size_t n = samples_ns.size();
  double last_y = 1e9;
  for (std::size_t i = 0; i < n; ++i) {
    const double y = std::log10(static_cast<double>(n - i) / static_cast<double>(n));
    if (last_y - y < 0.01 && i + 20 < n) continue;
    last_y = y;
    series.add(std::log10(static_cast<double>(std::max<std::int64_t>(samples_ns[i], 1))), y);
  }
  return series;
}

tools::Plot tail_plot(const std::string& title, const std::string& x_label) {
  tools::Plot plot;
  plot.title = title;
  plot.x_label = x_label;
  plot.y_label = "share at least this late";
  plot.x_scale = tools::Scale::kLogDuration;
  plot.y_scale = tools::Scale::kLog;
  return plot;
}

void append(std::vector<std::int64_t>& all, const std::vector<std::int64_t>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

tools::Plot wakeup_plot(const LatencyRun& run, const std::string& load) {
  std::vector<std::int64_t> ours, theirs;
  tools::Plot plot = tail_plot("wake-up under " + load, "wake-up latency, from the intended release");
  for (const auto& p : run.pairs) {
    if (p.setup.load != load) continue;
    append(ours, p.ours.late_ns);
    append(theirs, p.theirs.late_ns);
  }
  plot.curves.push_back({fmt::format("control (n {})", ours.size()), {"c0", "thick"}, tail_of(ours)});
  plot.curves.push_back({fmt::format("reference beside it (n {})", theirs.size()), {"c1", "thick"}, tail_of(theirs)});
  return plot;
}

tools::Plot chain_plot(const LatencyRun& run, const std::string& load) {
  std::map<std::string, std::vector<std::int64_t>> by_name;
  for (const auto& p : run.pairs)
    if (p.setup.load == load)
      for (const auto& b : p.behaviours)
        for (const auto& c : b.chains) by_name[b.name].push_back(c.total_ns);
  tools::Plot plot = tail_plot("exposure to byte under " + load, "exposure to the command's last byte");
  int colour = 0;
  for (auto& [name, samples] : by_name)
    plot.curves.push_back({fmt::format("{} (n {})", name, samples.size()),
                           {fmt::format("c{}", colour++ % 6), "thick"},
                           tail_of(std::move(samples))});
  return plot;
}

void write(const fs::path& path, const std::string& text) {
  std::ofstream out(path);
  out << text;
  if (!out.flush()) throw std::runtime_error("cannot write " + path.string());
}

}  // namespace

void write_plots(const LatencyRun& run, const fs::path& folder) {
  fs::create_directories(folder);
  std::string page = fmt::format(
      "<!doctype html><html lang='en'><meta charset='utf-8'><title>wasp bench latency</title><style>{}</style><main>"
      "<h1>Latency</h1><p class='soft'>{}, {}</p>",
      tools::report_style(), tools::escape_html(rt::kernel_description()), tools::escape_html(rt::host_description()));
  for (const auto& v : run.verdicts) {
    page += fmt::format("<h2>{}</h2>", tools::escape_html(v.load));
    for (const auto& [stem, plot] :
         {std::pair{"wakeup", wakeup_plot(run, v.load)}, {"chain", chain_plot(run, v.load)}}) {
      const std::string svg = plot.svg();
      write(folder / fmt::format("{}_{}.svg", stem, v.load), tools::standalone_svg(svg));
      page += fmt::format("<h3>{}</h3><div class='card wide scroll'>{}</div>", tools::escape_html(plot.title), svg);
    }
    page += fmt::format("<div class='card'><pre class='scroll small'>{}</pre></div>",
                        tools::escape_html(load_text(run, v)));
  }
  write(folder / "latency.html", page + "</main></html>\n");
}

}  // namespace wasp::bench
