#include "tools/eval_image_shift_scenes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "drivers/image_file.h"

namespace wasp::tools {

std::vector<cv::Mat> shift_scenes(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const auto kind = entry.path().extension();
    if (kind == ".png" || kind == ".pgm") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<cv::Mat> scenes;
  for (const auto& file : files) {
    auto loaded = drivers::load_gray8(file);
    cv::Mat scene;
    cv::Mat(loaded.height_px, loaded.width_px, CV_8U, loaded.pixels.data()).convertTo(scene, CV_32F);
    scenes.push_back(std::move(scene));
  }
  return scenes;
}

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

cv::Mat turned(const cv::Mat& image, cv::Rect at, double angle_deg, double zoom, double x) {
  const cv::Point2f middle(static_cast<float>(at.x) + 0.5f * static_cast<float>(at.width - 1),
                           static_cast<float>(at.y) + 0.5f * static_cast<float>(at.height - 1));
  cv::Mat map = cv::getRotationMatrix2D(middle, angle_deg, zoom), moved;
  map.at<double>(0, 2) += x - at.x;
  map.at<double>(1, 2) -= at.y;
  cv::warpAffine(image, moved, map, at.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  return moved;
}

cv::Mat sensed(const cv::Mat& window, double sigma, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, 1.0);
  cv::Mat out(window.size(), CV_8U);
  for (int v = 0; v < out.rows; ++v)
    for (int u = 0; u < out.cols; ++u)
      out.at<std::uint8_t>(v, u) =
          cv::saturate_cast<std::uint8_t>(static_cast<double>(window.at<float>(v, u)) + sigma * noise(random));
  return out;
}

cv::Rect window_place(const cv::Mat& image, int side, std::mt19937& random) {
  const auto draw = [&](int length) {
    return std::uniform_int_distribution<int>(kShiftMargin_px, length - side - kShiftMargin_px)(random);
  };
  const int x = draw(image.cols);
  return {x, draw(image.rows), side, side};
}

}  // namespace wasp::tools
