// image_shift beside cv::phaseCorrelate on the same windows of successive frames. OpenCV gets its Hann window ready
// made and its images already as floats; ours starts from the 8-bit image.
#include <algorithm>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "benchmarks/vision_rows.h"
#include "vision/kernels/image_shift_projections.h"

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
  vision::ShiftProjections projections;
  cv::Mat window;

  Setting(const VisionData& data, int side) : plan(side, side), projections(side, side) {
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

std::pair<GrayView, GrayView> views(const Setting& setting, int side, int i) {
  const Pair& p = setting.pairs[static_cast<std::size_t>(i)];
  return {{p.first.data(), side, side, side}, {p.second.data(), side, side, side}};
}

VisionRow row_of(const VisionData& data, const std::shared_ptr<Setting>& setting, int side, double bar) {
  VisionRow row;
  row.name = "image_shift." + std::to_string(side);
  row.what = "sub-pixel shift between two windows of " + std::to_string(side) + "x" + std::to_string(side);
  row.floor_us = 15.0 * side * side / (kPicture * kPicture);
  for (const GrayPair& pair : data.pairs) row.inputs.push_back(data.gray[static_cast<std::size_t>(pair.first)].name);
  row.bound = "trips: candidates + affine fits, at most " +
              std::to_string(vision::ImageShiftPlan::kCandidates + vision::shift::kMostFits) +
              "; besides at most 2 passes of 5 Newton steps";
  row.ours = [setting, side](int i) {
    const auto [first, second] = views(*setting, side, i);
    keep(setting->plan.estimate(first, second));
  };
  row.trips = [setting, side](int i) {
    const auto [first, second] = views(*setting, side, i);
    const auto shift = setting->plan.estimate(first, second);
    return shift.candidates + shift.fits;
  };
  row.peers.push_back({"cv::phaseCorrelate",
                       [setting](int i) {
                         const Pair& p = setting->pairs[static_cast<std::size_t>(i)];
                         keep(cv::phaseCorrelate(p.first_float, p.second_float, setting->window));
                       },
                       bar});
  return row;
}

/// The projections variant against the same peer: no bar of its own.
VisionRow projections_row_of(const VisionData& data, const std::shared_ptr<Setting>& setting, int side) {
  VisionRow row = row_of(data, setting, side, 0);
  row.name = "image_shift_projections." + std::to_string(side);
  row.what = "the same from row and column sums";
  row.bound = "fixed work";
  row.trips = nullptr;
  row.ours = [setting, side](int i) {
    const auto [first, second] = views(*setting, side, i);
    keep(setting->projections.estimate(first, second));
  };
  return row;
}

}  // namespace

std::vector<VisionRow> image_shift_rows(const VisionData& data) {
  std::vector<VisionRow> rows;
  for (const auto& [side, bar] : {std::pair{512, 50.0}, {256, 20.0}, {128, 4.0}, {64, 3.5}}) {
    const auto setting = std::make_shared<Setting>(data, side);
    rows.push_back(row_of(data, setting, side, bar));
    rows.push_back(projections_row_of(data, setting, side));
  }
  return rows;
}

}  // namespace wasp::bench
