// depth_median beside cv::medianBlur, whole image and at the samples the plane finder looks at.
#include <memory>
#include <opencv2/imgproc.hpp>

#include "benchmarks/vision_rows.h"
#include "vision/kernels/depth_median.h"

namespace wasp::bench {
namespace {

/// Columns and rows of samples spread over the image, the outermost at its border.
struct Samples {
  std::vector<vision::DepthPixel> pixels;
  std::vector<std::uint16_t> mm;

  Samples(int columns, int rows) : mm(static_cast<std::size_t>(columns * rows)) {
    for (int i = 0; i < columns * rows; ++i)
      pixels.push_back({static_cast<std::int16_t>(i % columns * (kVisionWidth - 1) / (columns - 1)),
                        static_cast<std::int16_t>(i / columns * (kVisionHeight - 1) / (rows - 1))});
  }
};

struct Buffers {
  std::vector<std::uint16_t> dense = std::vector<std::uint16_t>(static_cast<std::size_t>(kVisionWidth) * kVisionHeight);
  cv::Mat theirs;
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

/// The bar is for the few hundred samples a plane needs; the time grows with their number, the peer's does not.
VisionRow sampled_row(const VisionData& data, const std::shared_ptr<Buffers>& buffers, int columns, int rows,
                      double bar) {
  const auto samples = std::make_shared<Samples>(columns, rows);
  const std::string n = std::to_string(samples->pixels.size());
  VisionRow row{.name = "depth_median.at_" + n,
                .what = "5x5 median of valid values at " + n + " pixels; the peer filters the whole image",
                .inputs = data.names(data.depth),
                .ours = {},
                .peers = {opencv(data, buffers, bar)},
                .trips = [samples](int) { return static_cast<int>(samples->pixels.size()); },
                .bound = "trips are windows; one network, no branch on the data"};
  row.fresh = [&data](int i) { read_through(data.depth[static_cast<std::size_t>(i)].pixels); };
  row.ours = [&data, samples](int i) {
    vision::median_5x5_at(data.depth[static_cast<std::size_t>(i)].view(), samples->pixels, 1, samples->mm);
    keep(samples->mm);
  };
  return row;
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
                  .trips = [](int) { return kVisionWidth * kVisionHeight; },
                  .bound = "trips are pixels; one network, no branch on the data"};
  dense.fresh = [&data](int i) { read_through(data.depth[static_cast<std::size_t>(i)].pixels); };
  dense.ours = [&data, buffers](int i) {
    vision::median_5x5(data.depth[static_cast<std::size_t>(i)].view(), buffers->dense.data(), kVisionWidth);
    keep(buffers->dense);
  };
  return {dense, sampled_row(data, buffers, 20, 15, 300), sampled_row(data, buffers, 40, 25, 0)};
}

}  // namespace wasp::bench
