// depth_median beside cv::medianBlur, whole image and at the samples the plane finder looks at.
#include <memory>
#include <opencv2/imgproc.hpp>

#include "benchmarks/vision_rows.h"
#include "vision/kernels/depth_median.h"

namespace wasp::bench {
namespace {

constexpr int kSamples = 1000;

struct Buffers {
  std::vector<std::uint16_t> dense, sampled;
  std::vector<vision::DepthPixel> pixels;
  cv::Mat theirs;

  /// 40 x 25 pixels spread over the image, the outermost at its border.
  Buffers() : dense(static_cast<std::size_t>(kVisionWidth) * kVisionHeight), sampled(kSamples), pixels(kSamples) {
    for (int i = 0; i < kSamples; ++i)
      pixels[static_cast<std::size_t>(i)] = {static_cast<std::int16_t>(i % 40 * (kVisionWidth - 1) / 39),
                                             static_cast<std::int16_t>(i / 40 * (kVisionHeight - 1) / 24)};
  }
};

VisionPeer opencv(const VisionData& data, const std::shared_ptr<Buffers>& buffers, double bar) {
  return {"cv::medianBlur",
          [&data, buffers](int i) {
            const DepthView view = data.depth[static_cast<std::size_t>(i)].view();
            const cv::Mat image(view.height_px, view.width_px, CV_16U, const_cast<std::uint16_t*>(view.data));
            cv::medianBlur(image, buffers->theirs, 5);
            keep(buffers->theirs);
          },
          bar};
}

}  // namespace

std::vector<VisionRow> depth_median_rows(const VisionData& data) {
  const auto buffers = std::make_shared<Buffers>();
  VisionRow dense{.name = "depth_median.dense",
                  .what = "5x5 median of 640x480 uint16",
                  .floor_us = 584,
                  .inputs = data.names(data.depth),
                  .ours = {},
                  .peers = {opencv(data, buffers, 4.4)},
                  .bound = "one network, fixed trip counts"};
  dense.ours = [&data, buffers](int i) {
    vision::median_5x5(data.depth[static_cast<std::size_t>(i)].view(), buffers->dense.data(), kVisionWidth);
    keep(buffers->dense);
  };
  VisionRow sampled = dense;
  sampled.name = "depth_median.at_samples";
  sampled.what = "5x5 median of valid values at 1,000 pixels; the peer filters the whole image";
  sampled.floor_us = 0;
  sampled.peers = {opencv(data, buffers, 300)};
  sampled.ours = [&data, buffers](int i) {
    vision::median_5x5_at(data.depth[static_cast<std::size_t>(i)].view(), buffers->pixels, 1, buffers->sampled);
    keep(buffers->sampled);
  };
  return {dense, sampled};
}

}  // namespace wasp::bench
