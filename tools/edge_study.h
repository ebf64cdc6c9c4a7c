// Height from edge statistics on known ground (thesis figs 7.8 to 7.12): Poisson strips in lanes are drawn by the
// simulator's renderer at known heights, and the edge kernels say what they make of them. And what the thesis leaves
// for later (8.1.3): lambda found from a climb, by the behaviour itself, with the simulator's accelerometer.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "sim/world.h"

namespace wasp::tools {

struct EdgeStudyOptions {
  double edges_per_m = 0.35;                          ///< of the ground: the thesis' virtual world
  std::vector<double> assumed_per_m{0.2, 0.35, 0.6};  ///< fig 7.8
  std::vector<double> fovs_deg{60, 90, 120};          ///< horizontal
  std::vector<double> heights_m{1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  std::vector<double> shown_heights_m{1, 3, 10};  ///< figs 7.9 and 7.12; must be among heights_m
  int seeds = 20;                                 ///< worlds a height
  int width_px = 640, height_px = 480;
  int columns_px = 160;        ///< drawn across the whole width: strips lie across the image, only rows matter
  double resolution_px = 1.4;  ///< delta: with it the fit has the right scale on these images
  double lane_m = 1;           ///< width of a lane with edges of its own; 0: strips reach from side to side
  double climb_from_m = 2, climb_m = 1.5, climb_takes_s = 4, climb_window_s = 10;
  double climb_speed_mps = 1.0;                    ///< forward, so that the strips in view change
  int climbs = 10;                                 ///< for each field of view; 0: none
  std::function<void(int done, int of)> progress;  ///< may be empty
};

/// One image.
struct EdgeSample {
  double fov_deg = 0, height_m = 0;
  int seed = 0;
  bool valid = false;
  double edges_per_height = 0;  ///< mu as fitted: the estimated height is mu / lambda
  double peak_row_px = 0;       ///< row of most edges, below the horizon
  double misfit = 0;
};

/// Distributions over the rows below the horizon; `measured` is the mean over the seeds.
struct EdgeDistribution {
  double fov_deg = 0, height_m = 0;
  std::vector<double> row_px, measured_cdf, model_cdf, model_pdf;
};

/// Estimated against true height with lambda known, for one field of view and height.
struct EdgeError {
  double fov_deg = 0, height_m = 0;
  int images = 0, valid = 0;
  double mean_m = 0, std_m = 0;  ///< of the estimate
  double rms_share = 0;          ///< rms error / height
  double rms_fitted_share = 0;   ///< the same with the EdgeFit's lambda
  double mean_row_px = 0, std_row_px = 0;
};

/// The lambda of least relative error over all heights of one field of view, as the thesis chose 0.35 for its world
/// ("found to best estimate the height"). It is not quite the ground's own: rows see edges closer than delta, or do
/// not.
struct EdgeFit {
  double fov_deg = 0, edges_per_m = 0, rms_share = 0;
};

/// One climb with lambda unknown; `guess` was 1.5 times too high or too low, in turn.
struct EdgeClimb {
  double fov_deg = 0;
  int seed = 0;
  double guess_per_m = 0;
  bool found = false;
  double edges_per_m = 0, sigma_per_m = 0;
  double rms_known_m = 0, rms_estimated_m = 0, rms_guess_m = 0;  ///< height errors after the climb, in hover
};

struct EdgeStudy {
  EdgeStudyOptions options;
  std::vector<EdgeSample> samples;
  std::vector<EdgeDistribution> distributions;
  std::vector<EdgeError> errors;
  std::vector<EdgeFit> fits;
  std::vector<EdgeClimb> climbs;
};

/// Grey strips across the ground, edges a Poisson process along the way (north), `edges_per_m` of them a metre,
/// independent from lane to lane. 500 m ahead, 900 m to each side.
sim::World poisson_strips(std::uint32_t seed, double edges_per_m, double lane_m);

/// The model (7.31) of a level camera: density of detected edges over rows 1 ... rows below the horizon, sum 1.
std::vector<double> edge_row_density(double edges_per_m, double height_m, double focal_px, double resolution_px,
                                     int rows);

/// Deterministic for its options. Throws std::invalid_argument for options out of range. Realtime-safe: no.
EdgeStudy run_edge_study(const EdgeStudyOptions& options);

/// edge_samples.csv, edge_distributions.csv, edge_errors.csv, edge_fits.csv, edge_climbs.csv. Throws std::runtime_error
/// when a file cannot be written.
void write_edge_study(const EdgeStudy& study, const std::filesystem::path& folder);

/// SVG elements (tools/report_plot.h). 7.8: estimate against height for several lambda, at the first field of view.
/// 7.9 and 7.12: distributions of one field of view. 7.10: estimate against height, 7.11: row of most edges against
/// height, mean and one deviation, for all fields of view.
std::string edge_figure_7_8(const EdgeStudy& study);
std::string edge_figure_7_9(const EdgeStudy& study, double fov_deg);
std::string edge_figure_7_10(const EdgeStudy& study);
std::string edge_figure_7_11(const EdgeStudy& study);
std::string edge_figure_7_12(const EdgeStudy& study, double fov_deg);
/// Not in the thesis: lambda found by each climb, with its sigma, over the climb's number.
std::string edge_figure_lambda(const EdgeStudy& study);

}  // namespace wasp::tools
