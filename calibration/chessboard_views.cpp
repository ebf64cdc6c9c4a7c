#include "calibration/chessboard_views.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "drivers/recording.h"

namespace wasp::calibration {
namespace {

namespace fs = std::filesystem;

constexpr int kGuessImages = 12;

bool is_image(const fs::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](char c) { return static_cast<char>(std::tolower(c)); });
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg" || ending == ".pgm" || ending == ".bmp" ||
         ending == ".tif" || ending == ".tiff";
}

std::vector<fs::path> frames_of_recording(const fs::path& folder) {
  std::vector<fs::path> files;
  const auto recording = drivers::Recording::open(folder);
  for (const auto& entry : recording.entries())
    if (entry.has_gray()) files.push_back(entry.gray_file);
  return files;
}

/// 8-bit grey; empty when the file is no image, or holds depth.
cv::Mat load(const fs::path& file) {
  const cv::Mat image = cv::imread(file.string(), cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH);
  return image.depth() == CV_8U ? image : cv::Mat{};
}

constexpr int kFlags = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_ACCURACY;

/// The sector-based detector (Duda and Frese 2018) first, then the old one with its corners refined.
bool find_corners(const cv::Mat& image, cv::Size board, std::vector<cv::Point2f>& corners) {
  if (cv::findChessboardCornersSB(image, board, corners, kFlags)) return true;
  if (!cv::findChessboardCorners(image, board, corners,
                                 cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK))
    return false;
  double least = 1e9;  // half of the smallest distance of neighbours, so that no other corner is in the window
  for (std::size_t i = 1; i < corners.size(); ++i)
    if (i % static_cast<std::size_t>(board.width) != 0) least = std::min(least, cv::norm(corners[i] - corners[i - 1]));
  const int half = std::clamp(static_cast<int>(least * 0.4), 2, 11);
  cv::cornerSubPix(image, corners, {half, half}, {-1, -1}, {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 60, 1e-3});
  return true;
}

/// The size of the board in one image; 0 x 0 when none is seen. The longer side counts as the row.
cv::Size size_in(const cv::Mat& image) {
  std::vector<cv::Point2f> corners;
  cv::Mat meta;
  if (!cv::findChessboardCornersSB(image, {3, 3}, corners, kFlags | cv::CALIB_CB_LARGER, meta)) return {};
  return {std::max(meta.cols, meta.rows), std::min(meta.cols, meta.rows)};
}

cv::Size guess_board(const std::vector<fs::path>& files, const std::function<void(double, const std::string&)>& told) {
  std::map<std::pair<int, int>, int> votes;
  const std::size_t step = std::max<std::size_t>(1, files.size() / kGuessImages);
  for (std::size_t i = 0; i < files.size(); i += step) {
    told(0.2 * static_cast<double>(i) / static_cast<double>(files.size()),
         "size of the board in " + files[i].filename().string());
    const cv::Mat image = load(files[i]);
    if (image.empty()) continue;
    if (const cv::Size size = size_in(image); size.width > 0) ++votes[{size.width, size.height}];
  }
  std::pair<int, int> best{};
  int most = 0;
  for (const auto& [size, count] : votes)  // of equals the larger: parts of a board are boards too
    if (count >= most) most = count, best = size;
  return {best.first, best.second};
}

/// True when all corners lie in the image and no two are one.
bool plausible(const std::vector<cv::Point2f>& corners, cv::Size image) {
  return std::all_of(corners.begin(), corners.end(), [&](const cv::Point2f& p) {
    return p.x >= 0 && p.y >= 0 && p.x < static_cast<float>(image.width) && p.y < static_cast<float>(image.height);
  });
}

}  // namespace

std::vector<fs::path> chessboard_images(const fs::path& folder) {
  if (!fs::is_directory(folder)) throw std::runtime_error(folder.string() + ": no such folder");
  for (const fs::path& recording : {folder, folder / "recording"})
    if (fs::exists(recording / "rgb.txt")) return frames_of_recording(recording);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && is_image(entry.path())) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  if (files.empty()) throw std::runtime_error(folder.string() + ": no images (png, jpg, pgm, bmp, tif) in it");
  return files;
}

std::vector<cv::Point3f> board_points(cv::Size board, double square_mm) {
  std::vector<cv::Point3f> points;
  for (int row = 0; row < board.height; ++row)
    for (int column = 0; column < board.width; ++column)
      points.emplace_back(static_cast<float>(column * square_mm), static_cast<float>(row * square_mm), 0.f);
  return points;
}

BoardViews find_boards(const std::vector<fs::path>& files, cv::Size board,
                       const std::function<void(double, const std::string&)>& told) {
  BoardViews out;
  out.board = board.width > 0 ? board : guess_board(files, told);
  const double from = board.width > 0 ? 0 : 0.2;
  for (std::size_t i = 0; i < files.size(); ++i) {
    told(from + (1 - from) * static_cast<double>(i) / static_cast<double>(files.size()), files[i].filename().string());
    const cv::Mat image = load(files[i]);
    if (image.empty()) {
      out.problems.push_back(files[i].string() + ": no 8-bit image");
      continue;
    }
    if (out.image.width == 0) out.image = image.size();
    if (image.size() != out.image) {
      out.problems.push_back(fmt::format("{}: {}x{} pixels, the images before it have {}x{}", files[i].string(),
                                         image.cols, image.rows, out.image.width, out.image.height));
      continue;
    }
    ++out.images;
    BoardView view{files[i].filename().string(), {}};
    if (out.board.width > 0 && find_corners(image, out.board, view.corners) && plausible(view.corners, out.image))
      out.views.push_back(std::move(view));
  }
  if (out.images == 0)
    throw std::runtime_error(out.problems.empty() ? "no images" : "no usable image; first: " + out.problems[0]);
  return out;
}

}  // namespace wasp::calibration
