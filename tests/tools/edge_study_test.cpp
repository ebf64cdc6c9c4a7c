#include "tools/edge_study.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>
#include <stdexcept>

namespace wasp::tools {
namespace {

EdgeStudyOptions few() {
  EdgeStudyOptions o;
  o.edges_per_m = 1.5;
  o.fovs_deg = {60, 90};
  o.heights_m = {1, 2, 4};
  o.shown_heights_m = {2, 4};
  o.seeds = 3;
  o.width_px = 320;
  o.height_px = 240;
  o.columns_px = 80;
  o.climbs = 1;
  return o;
}

const EdgeStudy& study() {
  static const EdgeStudy s = run_edge_study(few());
  return s;
}

TEST(EdgeStudy, HasOneRowForEverythingAskedFor) {
  EXPECT_EQ(study().samples.size(), 2u * 3u * 3u);
  EXPECT_EQ(study().errors.size(), 2u * 3u);
  EXPECT_EQ(study().distributions.size(), 2u * 2u);
  EXPECT_EQ(study().fits.size(), 2u);
  EXPECT_EQ(study().climbs.size(), 2u);
  for (const EdgeError& e : study().errors) {
    EXPECT_EQ(e.images, 3);
    EXPECT_EQ(e.valid, 3);
  }
}

TEST(EdgeStudy, EstimatesRiseWithHeightAndTheFittedLambdaIsNearTheGroundsOwn) {
  for (std::size_t i = 1; i < study().errors.size(); ++i) {
    const EdgeError &before = study().errors[i - 1], &e = study().errors[i];
    if (e.fov_deg != before.fov_deg) continue;
    EXPECT_GT(e.mean_m, 1.2 * before.mean_m);
  }
  for (const EdgeFit& f : study().fits) {
    EXPECT_GT(f.edges_per_m, 0.75);
    EXPECT_LT(f.edges_per_m, 3.0);
    EXPECT_LT(f.rms_share, 0.5);
  }
  for (const EdgeError& e : study().errors) EXPECT_LT(e.rms_fitted_share, 0.6);
}

TEST(EdgeStudy, DistributionsAreDistributions) {
  for (const EdgeDistribution& d : study().distributions) {
    EXPECT_EQ(d.row_px.size(), 119u);
    EXPECT_NEAR(std::accumulate(d.model_pdf.begin(), d.model_pdf.end(), 0.0), 1.0, 1e-9);
    EXPECT_NEAR(d.model_cdf.back(), 1.0, 1e-9);
    EXPECT_NEAR(d.measured_cdf.back(), 1.0, 1e-9);
    for (std::size_t i = 1; i < d.measured_cdf.size(); ++i) EXPECT_GE(d.measured_cdf[i], d.measured_cdf[i - 1] - 1e-12);
  }
}

TEST(EdgeStudy, TheModelsModeIsWhereTheThesisHasIt) {
  const auto density = edge_row_density(0.35, 3, 554, 2, 240);  // (7.36): sqrt(k lambda delta)
  const auto mode = std::max_element(density.begin(), density.end()) - density.begin() + 1;
  EXPECT_NEAR(static_cast<double>(mode), std::sqrt(0.35 * 3 * 554 * 2), 2.0);
}

TEST(EdgeStudy, StripsAreAPoissonProcessOfTheGivenDensity) {
  const auto world = poisson_strips(3, 1.5, 0);
  double edges = 0;
  for (const auto& q : world.quads) edges += world.vertices_ned_m[q[0]].x() < 480 ? 1 : 0;
  EXPECT_NEAR(edges / 500, 1.5, 4 * std::sqrt(1.5 / 500));
  EXPECT_GT(poisson_strips(3, 1.5, 1).quads.size(), 20 * world.quads.size());
}

TEST(EdgeStudy, SameOptionsSameFigures) {
  EdgeStudyOptions o = few();
  o.fovs_deg = {60};
  int last = 0;
  o.progress = [&last](int done, int of) {
    EXPECT_EQ(done, ++last);
    EXPECT_EQ(of, 4);
  };
  const EdgeStudy again = run_edge_study(o);
  EXPECT_EQ(last, 4);
  for (std::size_t i = 0; i < again.samples.size(); ++i)
    EXPECT_EQ(again.samples[i].edges_per_height, study().samples[i].edges_per_height);
  EXPECT_EQ(again.climbs[0].edges_per_m, study().climbs[0].edges_per_m);
}

TEST(EdgeStudy, FiguresAreDrawnAndTablesWritten) {
  for (const std::string& svg :
       {edge_figure_7_8(study()), edge_figure_7_9(study(), 60), edge_figure_7_10(study()), edge_figure_7_11(study()),
        edge_figure_7_12(study(), 90), edge_figure_lambda(study())}) {
    EXPECT_NE(svg.find("<svg"), std::string::npos);
    EXPECT_NE(svg.find("<path"), std::string::npos);
  }
  const auto folder = std::filesystem::temp_directory_path() / "wasp_edge_study_test";
  write_edge_study(study(), folder);
  const auto lines = [&](const char* name) {
    std::ifstream in(folder / name);
    std::string line;
    std::size_t n = 0;
    while (std::getline(in, line)) ++n;
    return n;
  };
  EXPECT_EQ(lines("edge_samples.csv"), 1 + 18u);
  EXPECT_EQ(lines("edge_distributions.csv"), 1 + 4 * 119u);
  EXPECT_EQ(lines("edge_errors.csv"), 1 + 6u);
  EXPECT_EQ(lines("edge_fits.csv"), 1 + 2u);
  EXPECT_EQ(lines("edge_climbs.csv"), 1 + 2u);
  std::filesystem::remove_all(folder);
}

TEST(EdgeStudy, RefusesNonsense) {
  EdgeStudyOptions o = few();
  o.edges_per_m = 0;
  EXPECT_THROW(run_edge_study(o), std::invalid_argument);
  o = few();
  o.heights_m = {};
  EXPECT_THROW(run_edge_study(o), std::invalid_argument);
  o = few();
  o.columns_px = 30;
  EXPECT_THROW(run_edge_study(o), std::invalid_argument);
}

}  // namespace
}  // namespace wasp::tools
