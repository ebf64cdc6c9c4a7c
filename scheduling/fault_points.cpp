#include "scheduling/fault_points.h"

namespace wasp::scheduling {
namespace {

constexpr std::array<std::string_view, kFaultPoints> kNames = {
    "camera.freeze",
    "camera.drop",
    "camera.slow",
    "camera.disconnect",
    "camera.error",
    "camera.late",
    "camera.reorder",
    "camera.duplicate",
    "camera.size",
    "camera.torn_header",
    "camera.stamp_ahead",
    "camera.stamp_back",
    "camera.stamp_stuck",
    "camera.sequence_wrap",
    "camera.sequence_restart",
    "image.black",
    "image.white",
    "image.blur",
    "image.noise",
    "image.band",
    "image.tear",
    "image.gain",
    "depth.holes",
    "depth.none",
    "depth.bias",
    "depth.quantise",
    "depth.noise",
    "depth.zero",
    "depth.far",
    "depth.freeze",
    "depth.drop",
    "attitude.stop",
    "attitude.freeze",
    "attitude.spike",
    "attitude.nan",
    "attitude.bias",
    "attitude.slow",
    "attitude.stamp_ahead",
    "attitude.stamp_back",
    "imu.stop",
    "imu.freeze",
    "imu.spike",
    "imu.nan",
    "imu.bias",
    "imu.slow",
    "behaviour.spin",
    "behaviour.endless",
    "behaviour.nan_cue",
    "behaviour.huge_cue",
    "behaviour.denormal",
    "behaviour.stuck_cue",
    "behaviour.future_cue",
    "behaviour.silent",
    "control.stall",
    "control.spin",
    "process.abort",
    "process.segv",
    "process.descriptors",
};

}  // namespace

std::string_view name_of(FaultPoint point) noexcept {
  const auto i = static_cast<std::size_t>(point);
  return i < kNames.size() ? kNames[i] : "unknown";
}

std::optional<FaultPoint> fault_point_named(std::string_view name) noexcept {
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (kNames[i] == name) return static_cast<FaultPoint>(i);
  return std::nullopt;
}

}  // namespace wasp::scheduling
