// image_shift beside cv::phaseCorrelate on the same windows of successive frames. OpenCV gets its Hann window ready
// made and its images already as floats; ours starts from the 8-bit image.
#include <algorithm>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "benchmarks/vision_rows.h"
#include "vision/kernels/image_shift.h"

namespace wasp::bench {
namespace {

constexpr int kPicture = 512;  ///< 640x480 frames have no 512x512 window: the frame is repeated below itself

struct Pair {
  std::vector<std::uint8_t> first, second;
  cv::Mat first_float, second_float;
};

std::vector<std::uint8_t> cut(const GrayFrame& frame, int side) {
  std::vector<std::uint8_t> pixels;
  for (int v = 0; v < side; ++v)
    for (int u = 0; u < side; ++u) pixels.push_back(frame.view().row((v + 40) % kVisionHeight)[u + 40]);
  return pixels;
}

cv::Mat floats(std::vector<std::uint8_t>& pixels, int side) {
  cv::Mat out;
  cv::Mat(side, side, CV_8U, pixels.data()).convertTo(out, CV_32F);
  return out;
}

struct Setting {
  std::vector<Pair> pairs;
  vision::ImageShiftPlan plan;
  cv::Mat window;

  Setting(const VisionData& data, int side) : plan(side, side) {
    for (const GrayPair& pair : data.pairs) {
      Pair p{cut(data.gray[static_cast<std::size_t>(pair.first)], side),
             cut(data.gray[static_cast<std::size_t>(pair.second)], side),
             {},
             {}};
      p.first_float = floats(p.first, side);
      p.second_float = floats(p.second, side);
      pairs.push_back(std::move(p));
    }
    cv::createHanningWindow(window, {side, side}, CV_32F);
  }
};

VisionRow row_of(const VisionData& data, int side, double bar) {
  const auto setting = std::make_shared<Setting>(data, side);
  VisionRow row;
  row.name = "image_shift." + std::to_string(side);
  row.what = "sub-pixel shift between two windows of " + std::to_string(side) + "x" + std::to_string(side);
  row.floor_us = 15.0 * side * side / (kPicture * kPicture);
  for (const GrayPair& pair : data.pairs) row.inputs.push_back(data.gray[static_cast<std::size_t>(pair.first)].name);
  row.bound = "3 candidates, at most 2 passes of 5 Newton steps";
  row.ours = [setting, side](int i) {
    const Pair& p = setting->pairs[static_cast<std::size_t>(i)];
    keep(setting->plan.estimate({p.first.data(), side, side, side}, {p.second.data(), side, side, side}));
  };
  row.peers.push_back({"cv::phaseCorrelate",
                       [setting](int i) {
                         const Pair& p = setting->pairs[static_cast<std::size_t>(i)];
                         keep(cv::phaseCorrelate(p.first_float, p.second_float, setting->window));
                       },
                       bar});
  return row;
}

}  // namespace

std::vector<VisionRow> image_shift_rows(const VisionData& data) {
  return {row_of(data, 512, 50), row_of(data, 256, 20), row_of(data, 128, 4), row_of(data, 64, 3.5)};
}

}  // namespace wasp::bench
