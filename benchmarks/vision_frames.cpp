// Kernels of whole frames that have no library peer: Reichardt correlators, heading by log-polar maps, the Kinect's
// table.
#include <memory>

#include "benchmarks/vision_rows.h"
#include "drivers/kinect_depth.h"
#include "vision/kernels/emd_grid.h"
#include "vision/kernels/heading_log_polar.h"

namespace wasp::bench {

std::vector<VisionRow> frame_rows(const VisionData& data) {
  const auto image = [&data](int i) { return data.gray[static_cast<std::size_t>(i)].view(); };
  const auto emd = std::make_shared<vision::EmdGrid>(kVisionWidth, kVisionHeight, vision::EmdParams{});
  const auto field = std::make_shared<vision::EmdField>();
  VisionRow correlators;
  correlators.name = "emd_grid";
  correlators.what = "Reichardt correlators over 640x480, pitch 8";
  correlators.inputs = data.names(data.gray);
  correlators.bound = "fixed trip counts";
  correlators.ours = [=](int i) {
    emd->step(image(i), *field);
    keep(*field);
  };
  const auto maps = std::make_shared<vision::HeadingLogPolar>(kVisionWidth, kVisionHeight, kVisionWidth);
  VisionRow heading;
  heading.name = "heading_log_polar";
  heading.what = "log-polar map, blur and at most 6 phase correlations of 64x64, one new frame";
  heading.inputs = correlators.inputs;
  heading.bound = "at most 6 regions";
  heading.ours = [=](int i) { keep(maps->step(image(i))); };
  const auto table = std::make_shared<drivers::KinectTable>(drivers::make_kinect_table(drivers::kMagnenatTangent));
  const auto depth = std::make_shared<std::vector<std::uint16_t>>(std::size_t{kVisionWidth} * kVisionHeight);
  VisionRow kinect;
  kinect.name = "kinect_depth";
  kinect.what = "640x480 raw values through the table";
  kinect.inputs = data.names(data.depth);
  kinect.bound = "fixed trip counts";
  kinect.ours = [=, &data](int i) {
    drivers::kinect_depth(*table, data.depth[static_cast<std::size_t>(i)].view(), depth->data(), kVisionWidth);
    keep(*depth);
  };
  return {correlators, heading, kinect};
}

}  // namespace wasp::bench
