// The study's figures. Mean thick, one standard deviation thin, models and truth dashed.
#include <algorithm>
#include <string>
#include <utility>

#include "tools/edge_study.h"
#include "tools/report_plot.h"

namespace wasp::tools {
namespace {

std::string colour(std::size_t i) { return std::string("c").append(std::to_string(i % 6)); }
std::string number(double x) { return tick_text(x, x == static_cast<int>(x) ? 1 : 0.01); }
std::string degrees(double fov) { return number(fov) + " degrees"; }

Plot titled(std::string title, std::string x_label, std::string y_label) {
  Plot plot;
  plot.title = std::move(title);
  plot.x_label = std::move(x_label);
  plot.y_label = std::move(y_label);
  return plot;
}

Curve truth(const EdgeStudyOptions& o) {
  Curve c{"true", {"ink", "dashed"}, {}};
  c.series.add(o.heights_m.front(), o.heights_m.front());
  c.series.add(o.heights_m.back(), o.heights_m.back());
  return c;
}

/// Mean and mean +- deviation of something in each EdgeError of a field of view.
void add_band(const EdgeStudy& study, std::size_t fov_index, double EdgeError::*mean, double EdgeError::*deviation,
              Plot& plot) {
  const double fov = study.options.fovs_deg[fov_index];
  Curve middle{degrees(fov), {colour(fov_index), "thick"}, {}}, low{"", {colour(fov_index), "thin"}, {}}, high = low;
  for (const EdgeError& e : study.errors) {
    if (e.fov_deg != fov || e.valid == 0) continue;
    middle.series.add(e.height_m, e.*mean);
    low.series.add(e.height_m, e.*mean - e.*deviation);
    high.series.add(e.height_m, e.*mean + e.*deviation);
  }
  for (Curve* c : {&middle, &low, &high}) plot.curves.push_back(std::move(*c));
}

}  // namespace

std::string edge_figure_7_8(const EdgeStudy& study) {
  const EdgeStudyOptions& o = study.options;
  Plot plot = titled("estimated against true height, several lambda", "height [m]", "estimated [m]");
  for (std::size_t i = 0; i < o.assumed_per_m.size(); ++i) {
    Curve c{"lambda " + number(o.assumed_per_m[i]) + " /m", {colour(i), "thick"}, {}};
    for (const EdgeError& e : study.errors)
      if (e.fov_deg == o.fovs_deg.front() && e.valid > 0)
        c.series.add(e.height_m, e.mean_m * o.edges_per_m / o.assumed_per_m[i]);
    plot.curves.push_back(std::move(c));
  }
  plot.curves.push_back(truth(o));
  return plot.svg();
}

std::string edge_figure_7_9(const EdgeStudy& study, double fov_deg) {
  Plot plot = titled("share of edges above a row, " + degrees(fov_deg), "row below the horizon [px]", "share");
  std::size_t i = 0;
  for (const EdgeDistribution& d : study.distributions) {
    if (d.fov_deg != fov_deg) continue;
    plot.curves.push_back({number(d.height_m) + " m", {colour(i), "thick"}, {d.row_px, d.measured_cdf}});
    plot.curves.push_back({"model", {colour(i++), "dashed"}, {d.row_px, d.model_cdf}});
  }
  return plot.svg();
}  // namespace wasp::tools

std::string edge_figure_7_10(const EdgeStudy& study) {
  Plot plot = titled("estimated against true height, fields of view", "height [m]", "estimated [m]");
  for (std::size_t i = 0; i < study.options.fovs_deg.size(); ++i)
    add_band(study, i, &EdgeError::mean_m, &EdgeError::std_m, plot);
  plot.curves.push_back(truth(study.options));
  return plot.svg();
}

std::string edge_figure_7_11(const EdgeStudy& study) {
  Plot plot = titled("row of most edges against height", "height [m]", "row below the horizon [px]");
  for (std::size_t i = 0; i < study.options.fovs_deg.size(); ++i)
    add_band(study, i, &EdgeError::mean_row_px, &EdgeError::std_row_px, plot);
  return plot.svg();
}

std::string edge_figure_7_12(const EdgeStudy& study, double fov_deg) {
  Plot plot = titled("modelled density of edges, " + degrees(fov_deg), "row below the horizon [px]", "density [1/px]");
  std::size_t i = 0;
  for (const EdgeDistribution& d : study.distributions)
    if (d.fov_deg == fov_deg)
      plot.curves.push_back({number(d.height_m) + " m", {colour(i++), "thick"}, {d.row_px, d.model_pdf}});
  return plot.svg();
}

std::string edge_figure_lambda(const EdgeStudy& study) {
  Plot plot = titled("lambda found by climbs", "climb", "lambda [1/m]");
  for (std::size_t i = 0; i < study.options.fovs_deg.size(); ++i) {
    const double fov = study.options.fovs_deg[i];
    Curve middle{degrees(fov), {colour(i), "thick"}, {}}, low{"", {colour(i), "thin"}, {}}, high = low;
    int climb = 0;
    for (const EdgeClimb& c : study.climbs) {
      if (c.fov_deg != fov) continue;
      ++climb;
      if (!c.found) continue;
      middle.series.add(climb, c.edges_per_m);
      low.series.add(climb, c.edges_per_m - c.sigma_per_m);
      high.series.add(climb, c.edges_per_m + c.sigma_per_m);
    }
    for (Curve* c : {&middle, &low, &high}) plot.curves.push_back(std::move(*c));
  }
  Curve truth{"true", {"ink", "dashed"}, {}};
  truth.series.add(1, study.options.edges_per_m);
  truth.series.add(std::max(study.options.climbs, 2), study.options.edges_per_m);
  plot.curves.push_back(std::move(truth));
  return plot.svg();
}

}  // namespace wasp::tools
