// edge_rows beside what one writes with OpenCV: Sobel, RMS of the gradient, threshold, row sums.
#include <cmath>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "benchmarks/vision_rows.h"
#include "vision/kernels/edge_rows.h"

namespace wasp::bench {
namespace {

struct OpenCvEdges {
  cv::Mat gradient, magnitude, binary, counts;

  void run(const GrayView& image) {
    const cv::Mat view(image.height_px, image.width_px, CV_8U, const_cast<std::uint8_t*>(image.data));
    cv::Sobel(view, gradient, CV_16S, 0, 1);
    const double rms = cv::norm(gradient, cv::NORM_L2) / std::sqrt(static_cast<double>(gradient.total()));
    magnitude = cv::abs(gradient);
    cv::threshold(magnitude, binary, rms, 1, cv::THRESH_BINARY);
    cv::reduce(binary, counts, 1, cv::REDUCE_SUM, CV_32F);
    keep(counts);
  }
};

}  // namespace

std::vector<VisionRow> edge_rows_rows(const VisionData& data) {
  const auto rows = std::make_shared<vision::EdgeRows>();
  const auto theirs = std::make_shared<OpenCvEdges>();
  VisionRow row;
  row.name = "edge_rows";
  row.what = "signed-blind horizontal edges of 640x480: Sobel, RMS threshold, row histogram";
  row.floor_us = 13;
  row.inputs = data.names(data.gray);
  row.bound = "fixed trip counts";
  row.fresh = [&data](int i) { read_through(data.gray[static_cast<std::size_t>(i)].pixels); };
  row.ours = [&data, rows](int i) {
    vision::count_edge_rows({}, data.gray[static_cast<std::size_t>(i)].view(), {}, *rows);
    keep(*rows);
  };
  row.peers.push_back(
      {"opencv", [&data, theirs](int i) { theirs->run(data.gray[static_cast<std::size_t>(i)].view()); }, 15});
  return {row};
}

}  // namespace wasp::bench
