// Pairs of windows for `wasp eval image_shift`: real crops of still images, the second from the moved image, so that
// borders are not shared.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

namespace wasp::tools {

inline constexpr int kShiftMargin_px = 24;  ///< the moved image is not used nearer to its border: it wraps there

/// The PNG and PGM images of a folder, CV_32F, by name.
std::vector<cv::Mat> shift_scenes(const std::filesystem::path& folder);

/// The whole image moved by (x, y), exactly, but round its border.
cv::Mat fourier_shifted(const cv::Mat& image, double x, double y);

/// The window `at` of the image turned by `angle_deg` and grown by `zoom` about the window's middle, then moved right.
cv::Mat turned(const cv::Mat& image, cv::Rect at, double angle_deg, double zoom, double x);

/// To 8 bits, with white noise.
cv::Mat sensed(const cv::Mat& window, double sigma, std::mt19937& random);

/// A window's place, drawn so that the moved window stays clear of the border.
cv::Rect window_place(const cv::Mat& image, int side, std::mt19937& random);

}  // namespace wasp::tools
