#include "tools/camera_figures.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "shm/topics.h"
#include "tools/latency_summary.h"

namespace wasp::tools {
namespace {

const char* state_name(drivers::CameraState state) {
  switch (state) {
    case drivers::CameraState::kStreaming:
      return "streaming";
    case drivers::CameraState::kGone:
      return "GONE";
    default:
      return "starting";
  }
}

}  // namespace

CameraFigures figures_of(const std::string& topic, const drivers::CameraStatus& s) {
  CameraFigures f;
  f.topic = topic;
  f.driver = s.driver_view();
  f.name = s.name_view();
  f.state = static_cast<drivers::CameraState>(s.state.load());
  f.real_time = s.real_time != 0;
  f.frames = s.frames, f.dropped = s.dropped, f.corrupt = s.corrupt;
  f.timeouts = s.timeouts, f.reopened = s.reopened, f.estimated = s.estimated;
  f.interval_p50_ns = s.interval.quantile_ns(0.5);
  f.interval_p99_ns = s.interval.quantile_ns(0.99);
  f.interval_max_ns = s.interval.max_ns();
  f.latency_p50_ns = s.latency.quantile_ns(0.5);
  f.latency_p99_ns = s.latency.quantile_ns(0.99);
  f.latency_p999_ns = s.latency.quantile_ns(0.999);
  f.latency_max_ns = s.latency.max_ns();
  return f;
}

std::vector<CameraFigures> read_cameras(const shm::Region& region) {
  std::vector<CameraFigures> cameras;
  for (const char* topic : {shm::kCamera, shm::kCameraDown})
    if (const auto* status = find_block<drivers::CameraStatus>(region, topic, drivers::kCameraStatusType))
      cameras.push_back(figures_of(topic, *status));
  return cameras;
}

std::string counts_text(const CameraFigures& f) {
  return fmt::format("{} {} {}: {} frames, {} dropped, {} corrupt, {} timeouts, {} times reopened{}{}", f.topic,
                     f.driver, state_name(f.state), f.frames, f.dropped, f.corrupt, f.timeouts, f.reopened,
                     f.estimated > 0 ? fmt::format(", {} without a believable time stamp", f.estimated) : "",
                     f.real_time ? "" : ", NOT REAL TIME");
}

std::string times_text(const CameraFigures& f) {
  return fmt::format("every {} (p99 {}, max {}); exposure to publication p50 {}, p99 {}, p99.9 {}, max {}",
                     duration_text(f.interval_p50_ns), duration_text(f.interval_p99_ns),
                     duration_text(f.interval_max_ns), duration_text(f.latency_p50_ns), duration_text(f.latency_p99_ns),
                     duration_text(f.latency_p999_ns), duration_text(f.latency_max_ns));
}

nlohmann::json to_json(const CameraFigures& f) {
  return {{"topic", f.topic},
          {"driver", f.driver},
          {"name", f.name},
          {"state", state_name(f.state)},
          {"real_time", f.real_time},
          {"frames", f.frames},
          {"dropped", f.dropped},
          {"corrupt", f.corrupt},
          {"timeouts", f.timeouts},
          {"reopened", f.reopened},
          {"estimated", f.estimated},
          {"interval_p50_ns", f.interval_p50_ns},
          {"interval_p99_ns", f.interval_p99_ns},
          {"interval_max_ns", f.interval_max_ns},
          {"latency_p50_ns", f.latency_p50_ns},
          {"latency_p99_ns", f.latency_p99_ns},
          {"latency_p999_ns", f.latency_p999_ns},
          {"latency_max_ns", f.latency_max_ns}};
}

}  // namespace wasp::tools
