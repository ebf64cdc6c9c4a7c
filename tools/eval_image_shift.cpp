// The cells of figures 3.6 and 3.7 on every still image of the folder, real crops: the second window is cut from the
// image moved (Fourier shift, or rotated about the window's centre and moved), so borders are not shared. Each cell
// gives the RMS error of the default, the references and cv::phaseCorrelate, in pixels.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>
#include <stdexcept>

#include "drivers/image_file.h"
#include "tools/eval_kernels.h"
#include "vision/kernels/image_shift_reference.h"

namespace wasp::tools {
namespace {

constexpr double kShifts_px[] = {2, 5, 10, 15}, kSnrs_db[] = {15, 20, 25, 30, 40, 50};
constexpr double kRotations_deg[] = {-5, -4, -3, -2, -1, 0, 1, 2, 3, 4, 5};
constexpr int kMargin_px = 24;  // the moved image is not used nearer to its border: it wraps there
constexpr double kFailure_px = 1;
constexpr const char* kMethodNames[] = {"shear_average", "cross_correlation", "cross_correlation_subpixel",
                                        "kuglin_hines", "foroosh"};

/// What can be cut from one image, whatever the shift.
struct Scene {
  cv::Mat image;  // CV_32F
};

cv::Mat fourier_shifted(const cv::Mat& image, double x, double y) {
  cv::Mat spectrum, moved;
  cv::dft(image, spectrum, cv::DFT_COMPLEX_OUTPUT);
  for (int v = 0; v < spectrum.rows; ++v)
    for (int u = 0; u < spectrum.cols; ++u) {
      const double kv = v <= spectrum.rows / 2 ? v : v - spectrum.rows,
                   ku = u <= spectrum.cols / 2 ? u : u - spectrum.cols;
      const double phase = -2 * std::numbers::pi * (ku * x / spectrum.cols + kv * y / spectrum.rows);
      auto& z = spectrum.at<cv::Vec2f>(v, u);
      const float c = static_cast<float>(std::cos(phase)), s = static_cast<float>(std::sin(phase));
      z = {z[0] * c - z[1] * s, z[0] * s + z[1] * c};
    }
  cv::dft(spectrum, moved, cv::DFT_INVERSE | cv::DFT_SCALE | cv::DFT_REAL_OUTPUT);
  return moved;
}

cv::Mat rotated(const cv::Mat& image, cv::Point2f centre, double angle_deg, double x) {
  cv::Mat map = cv::getRotationMatrix2D(centre, angle_deg, 1.0), moved;
  map.at<double>(0, 2) += x;
  cv::warpAffine(image, moved, map, image.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  return moved;
}

/// To 8 bits, with white noise of the window's variance over the SNR.
cv::Mat sensed(const cv::Mat& window, double sigma, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, 1.0);
  cv::Mat out(window.size(), CV_8U);
  for (int v = 0; v < out.rows; ++v)
    for (int u = 0; u < out.cols; ++u)
      out.at<std::uint8_t>(v, u) =
          cv::saturate_cast<std::uint8_t>(static_cast<double>(window.at<float>(v, u)) + sigma * noise(random));
  return out;
}

struct Errors {
  double square = 0, sum = 0, worst = 0;
  int count = 0;
  void add(double error) { square += error * error, sum += error, worst = std::max(worst, error), ++count; }
  [[nodiscard]] double rms() const { return std::sqrt(square / count); }
};

struct Cell {
  Errors ours, ours_valid, opencv;
  Errors references[std::size(kMethodNames)];
  int refused = 0, silent = 0;
};

class Contest {
 public:
  explicit Contest(int side) : side_(side), plan_(side, side), reference_(side, side) {
    cv::createHanningWindow(hann_, {side, side}, CV_32F);
  }

  void run(const cv::Mat& first, const cv::Mat& second, double x, double y, Cell& cell) {
    const GrayView a{first.data, side_, side_, side_}, b{second.data, side_, side_, side_};
    const auto begin = std::chrono::steady_clock::now();
    const auto ours = plan_.estimate(a, b);
    times_us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
    const auto error = [&](double u, double v) { return std::hypot(u - x, v - y); };
    const double mine = error(static_cast<double>(ours.x_px), static_cast<double>(ours.y_px));
    cell.ours.add(mine);
    if (ours.valid) cell.ours_valid.add(mine);
    cell.refused += ours.valid ? 0 : 1;
    cell.silent += ours.valid && mine > kFailure_px ? 1 : 0;
    for (std::size_t m = 0; m < std::size(kMethodNames); ++m) {
      const auto r = reference_.estimate(vision::kShiftMethods[m], a, b);
      cell.references[m].add(error(static_cast<double>(r.x_px), static_cast<double>(r.y_px)));
    }
    cv::Mat fa, fb;
    first.convertTo(fa, CV_32F);
    second.convertTo(fb, CV_32F);
    const cv::Point2d peer = cv::phaseCorrelate(fa, fb, hann_);
    cell.opencv.add(error(peer.x, peer.y));
  }

  std::vector<double> times_us;

 private:
  int side_;
  vision::ImageShiftPlan plan_;
  vision::ShiftReference reference_;
  cv::Mat hann_;
};

/// A window's place, drawn so that the moved window stays clear of the border.
cv::Rect place(const cv::Mat& image, int side, std::mt19937& random) {
  const auto draw = [&](int length) {
    return std::uniform_int_distribution<int>(kMargin_px, length - side - kMargin_px)(random);
  };
  const int x = draw(image.cols);
  return {x, draw(image.rows), side, side};
}

void add_cell(std::vector<Figure>& figures, const std::string& name, const Cell& cell, std::optional<double> bar) {
  // Bars: never worse than OpenCV, and the figure of the issue where it names one.
  const double most = std::min(cell.opencv.rms(), bar.value_or(std::numeric_limits<double>::infinity()));
  figures.push_back({name + "_default", cell.ours.rms(), "px rms", Bar{most}});
  if (cell.ours_valid.count > 0) figures.push_back({name + "_default_if_valid", cell.ours_valid.rms(), "px rms"});
  figures.push_back({name + "_opencv", cell.opencv.rms(), "px rms"});
  for (std::size_t m = 0; m < std::size(kMethodNames); ++m)
    figures.push_back({name + "_" + kMethodNames[m], cell.references[m].rms(), "px rms"});
  figures.push_back({name + "_refused", static_cast<double>(cell.refused) / cell.ours.count, ""});
  figures.push_back({name + "_silent_failures", static_cast<double>(cell.silent) / cell.ours.count, ""});
}

/// The accuracy bar for a cell, where there is one.
std::optional<double> bar_of(int side, double shift_px, double snr_db) {
  if (snr_db < 30) return {};
  if (side >= 128) return 0.05;
  return shift_px <= 5 ? std::optional(0.1) : std::nullopt;
}

void noise_cells(const std::vector<Scene>& scenes, int side, int runs, bool subpixel, std::vector<Figure>& figures,
                 Contest& contest) {
  std::mt19937 random(36);
  for (const double shift : kShifts_px) {
    const double x = subpixel ? shift + 0.37 : shift, y = subpixel ? -0.21 : 0.0;
    Cell cells[std::size(kSnrs_db)];
    for (const Scene& scene : scenes) {
      const cv::Mat moved = fourier_shifted(scene.image, x, y);
      for (std::size_t k = 0; k < std::size(kSnrs_db); ++k)
        for (int run = 0; run < runs; ++run) {
          const cv::Rect at = place(scene.image, side, random);
          cv::Scalar mean, deviation;
          cv::meanStdDev(scene.image(at), mean, deviation);
          const double sigma = deviation[0] * std::pow(10.0, -kSnrs_db[k] / 20);
          contest.run(sensed(scene.image(at), sigma, random), sensed(moved(at), sigma, random), x, y, cells[k]);
        }
    }
    for (std::size_t k = 0; k < std::size(kSnrs_db); ++k)
      add_cell(figures, fmt::format("n{}_shift{}{}_snr{}dB", side, shift, subpixel ? "_subpixel" : "", kSnrs_db[k]),
               cells[k], bar_of(side, shift, kSnrs_db[k]));
  }
}

void rotation_cells(const std::vector<Scene>& scenes, int side, int runs, std::vector<Figure>& figures,
                    Contest& contest) {
  std::mt19937 random(37);
  for (const double shift : kShifts_px)
    for (const double angle : kRotations_deg) {
      Cell cell;
      for (const Scene& scene : scenes)
        for (int run = 0; run < runs; ++run) {
          const cv::Rect at = place(scene.image, side, random);
          const float half = 0.5f * static_cast<float>(side - 1);
          const cv::Point2f centre(static_cast<float>(at.x) + half, static_cast<float>(at.y) + half);
          const cv::Mat moved = rotated(scene.image, centre, angle, shift);
          contest.run(sensed(scene.image(at), 0, random), sensed(moved(at), 0, random), shift, 0, cell);
        }
      add_cell(figures, fmt::format("n{}_shift{}_rotation{}deg", side, shift, angle), cell, {});
    }
}

std::vector<Scene> scenes_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const auto kind = entry.path().extension();
    if (kind == ".png" || kind == ".pgm") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<Scene> scenes;
  for (const auto& file : files) {
    auto loaded = drivers::load_gray8(file);
    Scene scene;
    cv::Mat(loaded.height_px, loaded.width_px, CV_8U, loaded.pixels.data()).convertTo(scene.image, CV_32F);
    scenes.push_back(std::move(scene));
  }
  return scenes;
}

}  // namespace

std::vector<Figure> eval_image_shift(const std::filesystem::path& folder, const EvalOptions& options) {
  const auto scenes = scenes_of(folder);
  if (scenes.empty()) throw std::runtime_error(folder.string() + ": no PNG or PGM images");
  int shortest = std::numeric_limits<int>::max();
  for (const Scene& scene : scenes) shortest = std::min({shortest, scene.image.rows, scene.image.cols});
  std::vector<Figure> figures{{"images", static_cast<double>(scenes.size()), ""}};
  std::vector<double> times_us;
  for (const int side : {64, 128, 256}) {
    if (shortest < side + 2 * kMargin_px) continue;
    Contest contest(side);
    noise_cells(scenes, side, options.repeat, false, figures, contest);
    noise_cells(scenes, side, options.repeat, true, figures, contest);
    rotation_cells(scenes, side, options.repeat, figures, contest);
    std::sort(contest.times_us.begin(), contest.times_us.end());
    figures.push_back({fmt::format("n{}_time_p50", side), contest.times_us[contest.times_us.size() / 2], "us"});
    figures.push_back({fmt::format("n{}_time_max", side), contest.times_us.back(), "us"});
  }
  return figures;
}

}  // namespace wasp::tools
