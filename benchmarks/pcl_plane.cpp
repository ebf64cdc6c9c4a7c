#include "benchmarks/pcl_plane.h"

#include <pcl/console/print.h>
#include <pcl/pcl_config.h>
#include <pcl/segmentation/sac_segmentation.h>

#include <memory>

namespace wasp::bench {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

Cloud::Ptr cloud_of(const DepthView& depth, const Intrinsics& k, int step) {
  Cloud::Ptr cloud(new Cloud);
  for (int v = 0; v < depth.height_px; v += step)
    for (int u = 0; u < depth.width_px; u += step) {
      const int mm = depth.row(v)[u];
      if (mm < 300 || mm > 8000) continue;
      const float z = static_cast<float>(mm) * 1e-3f;
      cloud->push_back(
          {(static_cast<float>(u) - k.cx_px) / k.fx_px * z, (static_cast<float>(v) - k.cy_px) / k.fy_px * z, z});
    }
  return cloud;
}

}  // namespace

std::function<void(int)> pcl_plane(const VisionData& data, int step) {
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // it complains of frames without a plane
  auto clouds = std::make_shared<std::vector<Cloud::Ptr>>();
  for (const DepthFrame& frame : data.depth) clouds->push_back(cloud_of(frame.view(), data.depth_intrinsics, step));
  return [clouds](int i) {
    pcl::SACSegmentation<pcl::PointXYZ> segmentation;
    segmentation.setModelType(pcl::SACMODEL_PLANE);
    segmentation.setMethodType(pcl::SAC_RANSAC);
    segmentation.setDistanceThreshold(0.02);
    segmentation.setOptimizeCoefficients(true);
    segmentation.setInputCloud((*clouds)[static_cast<std::size_t>(i)]);
    pcl::PointIndices inliers;
    pcl::ModelCoefficients plane;
    segmentation.segment(inliers, plane);
  };
}

std::string pcl_version() { return PCL_VERSION_PRETTY; }

}  // namespace wasp::bench
