// The account of a camera as text and JSON: for its own process, wasp top and wasp record.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "drivers/camera_status.h"
#include "shm/region.h"

namespace wasp::tools {

/// CameraStatus by value; durations in ns.
struct CameraFigures {
  std::string topic;  ///< "camera" or "camera.down"
  std::string driver, name;
  drivers::CameraState state = drivers::CameraState::kStarting;
  bool real_time = false;
  std::uint64_t frames = 0, dropped = 0, corrupt = 0, timeouts = 0, reopened = 0, estimated = 0;
  std::int64_t interval_p50_ns = 0, interval_p99_ns = 0, interval_max_ns = 0;
  std::int64_t latency_p50_ns = 0, latency_p99_ns = 0, latency_p999_ns = 0, latency_max_ns = 0;
};

CameraFigures figures_of(const std::string& topic, const drivers::CameraStatus& status);
/// Of every camera of a region; empty for the simulator's.
std::vector<CameraFigures> read_cameras(const shm::Region& region);

/// "camera v4l2 streaming: 900 frames, 2 dropped, ...".
std::string counts_text(const CameraFigures& figures);
/// "every 33.3 ms (p99 34.1, max 40.2); exposure to publication p50 ..., p99, p99.9, max".
std::string times_text(const CameraFigures& figures);
nlohmann::json to_json(const CameraFigures& figures);

}  // namespace wasp::tools
