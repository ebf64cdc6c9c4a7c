// depth_plane beside PCL's SACSegmentation, which is measured only where PCL was there when this was built.
#include <memory>

#include "benchmarks/vision_rows.h"
#include "vision/kernels/depth_plane.h"
#ifdef WASP_HAVE_PCL
#include "benchmarks/pcl_plane.h"
#endif

namespace wasp::bench {
namespace {

vision::GravityPrior prior() {
  vision::GravityPrior p;
  p.max_angle_rad = 0.7f;
  return p;
}

/// Cold: every call forgets the frame before, as after a cut. Warm: the state of a camera that stays on one scene.
VisionRow plane_row(const VisionData& data, bool cold) {
  const auto states = std::make_shared<std::vector<vision::DepthPlaneState>>(data.depth.size());
  VisionRow row{
      .name = cold ? "depth_plane.cold" : "depth_plane.warm",
      .what = cold ? "floor in a depth frame never seen before" : "floor in a depth frame, the next of a flight",
      .floor_us = 10,
      .inputs = data.names(data.depth),
      .ours = {},
      .peers = {},
      .bound = "trips are three-point draws, at most " + std::to_string(vision::kMaxPlaneDraws)};
  // A ratio needs both to find a plane: the bars are about frames with a floor in them, real ones and made rooms.
  // Noise, checkerboards and empty frames are in p99.9, max and the trip count.
  row.judged = [&data](int i) {
    const DepthFrame& frame = data.depth[static_cast<std::size_t>(i)];
    return frame.real || frame.name.starts_with("room");
  };
  row.ours = [&data, states, cold](int i) {
    const auto at = static_cast<std::size_t>(i);
    if (cold) (*states)[at].warm = false;
    keep(vision::estimate_floor({}, data.depth_intrinsics, data.depth[at].view(), prior(), (*states)[at]));
  };
  row.fresh = [&data](int i) { read_through(data.depth[static_cast<std::size_t>(i)].pixels); };
  row.trips = [&data, states, cold](int i) {
    const auto at = static_cast<std::size_t>(i);
    if (cold) (*states)[at].warm = false;
    return vision::estimate_floor({}, data.depth_intrinsics, data.depth[at].view(), prior(), (*states)[at]).draws;
  };
  return row;
}

}  // namespace

std::vector<VisionRow> depth_plane_rows(const VisionData& data) {
  std::vector<VisionRow> rows{plane_row(data, false), plane_row(data, true)};
#ifdef WASP_HAVE_PCL
  for (VisionRow& row : rows)
    row.peers = {{"pcl_sixteenth", pcl_plane(data, 4), 150}, {"pcl_full", pcl_plane(data, 1), 3000}};
#else
  for (VisionRow& row : rows) row.what += " (PCL was not there when this was built; no peer)";
#endif
  return rows;
}

}  // namespace wasp::bench
