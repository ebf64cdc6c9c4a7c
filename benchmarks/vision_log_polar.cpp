// log_polar beside OpenCV's two ways: warpPolar (makes its map each time) and remap with a map made once, in float and
// in OpenCV's own fixed point. All cover the same disc: the largest that fits into the image.
#include <memory>
#include <opencv2/imgproc.hpp>

#include "benchmarks/vision_rows.h"
#include "vision/kernels/log_polar.h"

namespace wasp::bench {
namespace {

constexpr int kSide = 256;

struct OpenCvLogPolar {
  cv::Mat x = cv::Mat(kSide, kSide, CV_32F), y = cv::Mat(kSide, kSide, CV_32F), fixed, fractions, out;
  cv::Point2f centre;
  double radius_px;

  explicit OpenCvLogPolar(const vision::LogPolarGeometry& g)
      : centre(g.fovea_x_px, g.fovea_y_px), radius_px(static_cast<double>(g.r_max_px)) {
    for (int r = 0; r < kSide; ++r)
      for (int c = 0; c < kSide; ++c) {
        const auto p = g.to_image({static_cast<float>(c), static_cast<float>(r)});
        x.at<float>(r, c) = p.x_px, y.at<float>(r, c) = p.y_px;
      }
    cv::convertMaps(x, y, fixed, fractions, CV_16SC2);
  }
  static cv::Mat mat(const GrayView& image) {
    return cv::Mat(image.height_px, image.width_px, CV_8U, const_cast<std::uint8_t*>(image.data));
  }
};

}  // namespace

std::vector<VisionRow> log_polar_rows(const VisionData& data) {
  const auto map = std::make_shared<vision::LogPolarMap>(vision::LogPolarParams{.angles = kSide, .radii = kSide},
                                                         kVisionWidth, kVisionHeight, kVisionWidth,
                                                         0.5f * (kVisionWidth - 1), 0.5f * (kVisionHeight - 1));
  const auto out = std::make_shared<std::vector<std::uint8_t>>(static_cast<std::size_t>(kSide * kSide));
  const auto theirs = std::make_shared<OpenCvLogPolar>(map->geometry());
  const auto image = [&data](int i) { return data.gray[static_cast<std::size_t>(i)].view(); };
  VisionRow row;
  row.name = "log_polar";
  row.what = std::string("256x256 log-polar map of 640x480, bilinear, ") + vision::remap_target();
  row.floor_us = 36;
  row.inputs = data.names(data.gray);
  row.fresh = [&data](int i) { read_through(data.gray[static_cast<std::size_t>(i)].pixels); };
  row.trips = [](int) { return kSide * kSide; };
  row.bound = "trips are pixels of the map, no branch on the data";
  row.ours = [=](int i) {
    map->transform(image(i), out->data());
    keep(*out);
  };
  row.peers.push_back({"cv::warpPolar",
                       [=](int i) {
                         cv::warpPolar(theirs->mat(image(i)), theirs->out, {kSide, kSide}, theirs->centre,
                                       theirs->radius_px,
                                       static_cast<int>(cv::INTER_LINEAR) | static_cast<int>(cv::WARP_POLAR_LOG));
                         keep(theirs->out);
                       },
                       6});
  row.peers.push_back({"cv::remap",
                       [=](int i) {
                         cv::remap(theirs->mat(image(i)), theirs->out, theirs->x, theirs->y, cv::INTER_LINEAR);
                         keep(theirs->out);
                       },
                       4});
  row.peers.push_back({"cv::remap.fixed", [=](int i) {
                         cv::remap(theirs->mat(image(i)), theirs->out, theirs->fixed, theirs->fractions,
                                   cv::INTER_LINEAR);
                         keep(theirs->out);
                       }});
  return {row};
}

}  // namespace wasp::bench
