#include "calibration/calibrate_kinect_pair.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <stdexcept>

#include "calibration/camera_result.h"
#include "calibration/kinect_pairs_fit.h"
#include "calibration/picture.h"
#include "tools/quantiles.h"

namespace wasp::calibration {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLeastPairs = 8;
constexpr double kLeastTilt_rad = 0.14;
constexpr double kLeastCells = 0.3;         ///< share of either image's cells with a corner
constexpr double kMostFocalSigma = 0.01;    ///< share of the focal length
constexpr double kMostRms_px = 1.0;
constexpr double kMostShiftSigma_mm = 3;
constexpr double kMostTurnSigma_rad = 0.005;

/// "rgb_0007.png" and "ir_0007.png" are a pair: files by what follows their prefix.
std::map<std::string, fs::path> by_suffix(const std::vector<fs::path>& files, const std::string& prefix) {
  std::map<std::string, fs::path> found;
  for (const auto& file : files)
    if (const std::string name = file.stem().string(); name.starts_with(prefix)) found[name.substr(prefix.size())] = file;
  return found;
}

struct PairFiles {
  std::vector<fs::path> rgb, ir;
  std::vector<std::string> alone;
};

PairFiles pair_files(const std::string& folder) {
  const std::vector<fs::path> files = chessboard_images(folder);
  const auto rgb = by_suffix(files, "rgb"), ir = by_suffix(files, "ir");
  PairFiles pairs;
  for (const auto& [suffix, file] : rgb) {
    const auto other = ir.find(suffix);
    if (other == ir.end()) {
      pairs.alone.push_back(file.filename().string());
      continue;
    }
    pairs.rgb.push_back(file);
    pairs.ir.push_back(other->second);
  }
  for (const auto& [suffix, file] : ir)
    if (!rgb.contains(suffix)) pairs.alone.push_back(file.filename().string());
  if (pairs.rgb.empty())
    throw std::runtime_error(folder + ": no pairs of images rgbNAME and irNAME (rgb_01.png and ir_01.png)");
  return pairs;
}

std::string suffix_of(const std::string& name, const std::string& prefix) {
  const std::string stem = fs::path(name).stem().string();
  return stem.starts_with(prefix) ? stem.substr(prefix.size()) : stem;
}

/// Views that were found in one image only, or in both but by different corner orders, do not count. A board seen
/// upside down by one detection has its corners in reverse: that one is turned round.
void keep_common(BoardPairs& pairs) {
  std::map<std::string, BoardView> ir;
  for (const auto& view : pairs.ir.views) ir[suffix_of(view.name, "ir")] = view;
  std::vector<BoardView> rgb_kept, ir_kept;
  for (const auto& view : pairs.rgb.views) {
    const auto other = ir.find(suffix_of(view.name, "rgb"));
    if (other == ir.end()) continue;
    BoardView partner = other->second;
    // The cameras stand side by side, upright: the first row of corners runs the same way in both.
    const cv::Point2f a = view.corners.back() - view.corners.front();
    const cv::Point2f b = partner.corners.back() - partner.corners.front();
    if (a.dot(b) < 0) std::reverse(partner.corners.begin(), partner.corners.end());
    rgb_kept.push_back(view);
    ir_kept.push_back(std::move(partner));
  }
  pairs.rgb.views = std::move(rgb_kept);
  pairs.ir.views = std::move(ir_kept);
}

cv::Size parse_board_size(const std::string& text) {
  if (text == "auto") return {};
  int columns = 0, rows = 0;
  char end = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &columns, &rows, &end) != 2 || columns < 3 || rows < 3)
    throw std::runtime_error("--board '" + text + "': wants inner corners as 9x6, or auto");
  return {columns, rows};
}

BoardPairs find_pairs(const KinectPairOptions& o, const PairFiles& files, ProgressBar& bar) {
  const cv::Size board = parse_board_size(o.board);
  BoardPairs pairs;
  pairs.rgb = find_boards(files.rgb, board, [&](double share, const std::string& f) { bar.show(0.35 * share, f); });
  pairs.ir = find_boards(files.ir, board == cv::Size() ? pairs.rgb.board : board,
                         [&](double share, const std::string& f) { bar.show(0.35 + 0.35 * share, f); });
  const std::size_t rgb = pairs.rgb.views.size(), ir = pairs.ir.views.size();
  keep_common(pairs);
  if (pairs.rgb.views.size() < kLeastPairs)
    throw Refusal(fmt::format("the board was found whole in {} RGB and {} infrared images of {}, in {} pairs in both; {} "
                              "pairs are the least (cover the projector and light the board for the infrared ones)",
                              rgb, ir, files.rgb.size(), pairs.rgb.views.size(), kLeastPairs));
  return pairs;
}

void check_lens(const char* which, const LensFit& fit, const BoardViews& views) {
  const double f_share = std::max(fit.sigma[0] / fit.K(0, 0), fit.sigma[1] / fit.K(1, 1));
  if (const double tilt = widest_tilt(fit); tilt < kLeastTilt_rad)
    throw Refusal(fmt::format("{}: all views are nearly parallel (within {:.1f} degrees): the focal length is not "
                              "determined; tilt the board",
                              which, tilt * 180 / CV_PI));
  const ImageCoverage coverage = image_coverage(views, fit);
  constexpr int kCells = ImageCoverage::kColumns * ImageCoverage::kRows;
  if (coverage.cells < kLeastCells * kCells)
    throw Refusal(fmt::format("{}: corners in {} of {} parts of the image, {:.0f} are the least", which, coverage.cells,
                              kCells, std::ceil(kLeastCells * kCells)));
  if (!(f_share <= kMostFocalSigma))
    throw Refusal(fmt::format("{}: the focal length is known to {:.1f} % only, {:.0f} % are allowed: more views, more tilt",
                              which, 100 * f_share, 100 * kMostFocalSigma));
  if (fit.rms > kMostRms_px)
    throw Refusal(fmt::format("{}: reprojection error {:.2f} px rms, {:.1f} are allowed", which, fit.rms, kMostRms_px));
}

void check_fit(const PairFit& fit, const BoardPairs& pairs) {
  check_lens("rgb", fit.rgb, pairs.rgb);
  check_lens("infrared", fit.ir, pairs.ir);
  if (fit.rms_px > kMostRms_px)
    throw Refusal(fmt::format("both lenses are good, but no one pose fits the pairs: {:.2f} px rms, {:.1f} are allowed; "
                              "did the board move between the two images of a pair?",
                              fit.rms_px, kMostRms_px));
  const double shift = std::max({fit.T_sigma_mm[0], fit.T_sigma_mm[1], fit.T_sigma_mm[2]});
  const double turn = std::max({fit.rotation_sigma_rad[0], fit.rotation_sigma_rad[1], fit.rotation_sigma_rad[2]});
  if (!(shift <= kMostShiftSigma_mm) || !(turn <= kMostTurnSigma_rad))
    throw Refusal(fmt::format("the pairs leave the translation open by {:.1f} mm and the rotation by {:.2f} degrees (one "
                              "standard deviation; {:.0f} mm and {:.2f} degrees are allowed): more pairs, closer",
                              shift, turn * 180 / CV_PI, kMostShiftSigma_mm, kMostTurnSigma_rad * 180 / CV_PI));
}

void add_lens(TomlSection& t, const std::string& name, const LensFit& fit) {
  constexpr std::array<const char*, 9> kKeys{"fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"};
  const Eigen::VectorXd p = fit.parameters();
  for (Eigen::Index i = 0; i < p.size(); ++i)
    t.number(name + "_" + kKeys[static_cast<std::size_t>(i)], p[i], fmt::format("+- {:.2g}", fit.sigma[i]));
  t.number(name + "_rms_px", fit.rms);
}

Picture residual_picture(const PairFit& fit) {
  tools::Plot plot = labelled_plot("corners seen minus projected", "x [px]", "y [px]");
  plot.equal_axes = true;
  const auto add = [&plot](const char* name, const char* colour, const LensFit& lens) {
    tools::Curve curve{name, {colour, "dots"}, {}};
    for (const auto& view : lens.residuals)
      for (const auto& r : view) curve.series.add(static_cast<double>(r.x), static_cast<double>(r.y));
    plot.curves.push_back(std::move(curve));
  };
  add("rgb", "c0", fit.rgb);
  add("infrared", "c1", fit.ir);
  return picture("residuals", plot);
}

}  // namespace

Solution solve_kinect_pair(const KinectPairOptions& o, ProgressBar& bar) {
  const PairFiles files = pair_files(o.folder);
  const BoardPairs pairs = find_pairs(o, files, bar);
  bar.show(0.75, "lenses and pose");
  const auto fit = fit_pairs(pairs, o.square_mm, false);
  if (!fit) throw Refusal("OpenCV finds no lenses or no pose for these pairs: tilt the board, fill both images");
  check_fit(*fit, pairs);

  Solution s;
  const LensFit& flown = o.camera == "ir" ? fit->ir : fit->rgb;
  s.flight.push_back(camera_section(o.camera == "ir" ? pairs.ir : pairs.rgb, flown, "camera"));
  std::vector<double> R(fit->R.val, fit->R.val + 9), T, T_sigma, turn_sigma;
  for (int k = 0; k < 3; ++k) {
    T.push_back(fit->T_mm[k] / 1000);
    T_sigma.push_back(fit->T_sigma_mm[k] / 1000);
    turn_sigma.push_back(fit->rotation_sigma_rad[k] * 180 / CV_PI);
  }
  TomlSection& t = s.evidence;
  t.text("board", fmt::format("{}x{}", pairs.rgb.board.width, pairs.rgb.board.height)).number("square_mm", o.square_mm);
  t.whole("pairs", static_cast<long long>(pairs.rgb.views.size()));
  t.numbers("R_rgb_ir", R, "row by row: p_rgb = R p_ir + T").numbers("T_rgb_ir_m", T);
  t.numbers("T_sigma_m", T_sigma, "one standard deviation").numbers("rotation_sigma_deg", turn_sigma);
  cv::Vec3d turn;
  cv::Rodrigues(fit->R, turn);
  t.number("rotation_deg", cv::norm(turn) * 180 / CV_PI, "angle of R").number("baseline_m", cv::norm(fit->T_mm) / 1000);
  add_lens(t, "rgb", fit->rgb);
  add_lens(t, "ir", fit->ir);
  t.number("stereo_rms_px", fit->rms_px).numbers("pair_rms_px", fit->pair_rms_px);
  s.source = fmt::format("{}, {} pairs of images", o.folder, files.rgb.size());
  s.samples = pairs.rgb.views.size() * pairs.rgb.views.front().corners.size();
  s.residual_rms = fit->rms_px;
  s.residual_unit = "px";
  for (const auto& one : files.alone) s.notes.push_back("skipped, no partner: " + one);
  s.pictures = {residual_picture(*fit)};
  return s;
}

std::function<Solution(ProgressBar&)> prepare_kinect_pair(CLI::App& app) {
  auto o = std::make_shared<KinectPairOptions>();
  app.add_option("FOLDER", o->folder, "images rgbNAME and irNAME of one board, taken without moving it in between")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--square-mm", o->square_mm, "side of a square: the translation's scale")
      ->required()
      ->check(CLI::Range(0.1, 1e4));
  app.add_option("--board", o->board, "inner corners, COLUMNSxROWS; auto: the size seen whole in most images");
  app.add_option("--camera", o->camera, "whose lens goes into [camera]: the one pixel_format names")
      ->check(CLI::IsMember({"rgb", "ir"}));
  return [o](ProgressBar& bar) { return solve_kinect_pair(*o, bar); };
}

}  // namespace wasp::calibration
