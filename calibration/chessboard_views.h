// Chessboards found in a folder of images: the measurements of a camera calibration.
#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace wasp::calibration {

/// Inner corners of one image, row by row of the board, to a fraction of a pixel.
struct BoardView {
  std::string name;
  std::vector<cv::Point2f> corners;
};

struct BoardViews {
  cv::Size board;  ///< inner corners a row, a column
  cv::Size image;
  std::vector<BoardView> views;
  std::size_t images = 0;             ///< looked at
  std::vector<std::string> problems;  ///< files that could not be read, or are of another size
};

/// Grey images of a folder: PNG, JPEG, PGM, BMP, TIFF by name, or the grey frames of a wasp or TUM recording (also one
/// level down, in recording/). Throws std::runtime_error naming the folder.
std::vector<std::filesystem::path> chessboard_images(const std::filesystem::path& folder);

/// `board` {0, 0}: guessed, the size found whole in most images. `told(share, file)` is called before every image.
/// Throws std::runtime_error when no image can be read.
BoardViews find_boards(const std::vector<std::filesystem::path>& files, cv::Size board,
                       const std::function<void(double, const std::string&)>& told);

/// The board's corners in its own plane, z = 0 [mm].
std::vector<cv::Point3f> board_points(cv::Size board, double square_mm);

}  // namespace wasp::calibration
