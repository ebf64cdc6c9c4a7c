#include "scheduling/fault_points.h"

namespace wasp::scheduling {
namespace {

constexpr FaultUse kAny = FaultUse::kAnyFlight, kLive = FaultUse::kLiveCamera, kAimed = FaultUse::kBehaviour,
                   kAtOnce = FaultUse::kMoment;

/// In the order of FaultPoint.
constexpr std::array<FaultRow, kFaultPoints> kRows = {{
    {"camera.freeze", kLive, 0, 0, 0, "", "the same image again and again, in frames with new headers"},
    {"camera.drop", kLive, 0.5f, 0, 1, "share", "frames are lost at random"},
    {"camera.slow", kLive, 5, 0.1f, 1000, "Hz", "no more frames than this"},
    {"camera.disconnect", kLive, 0, 0, 0, "", "no frame comes; reopened when it ends"},
    {"camera.error", kLive, 100, 1, 60'000, "ms",
     "a read fails (EIO) and the camera is closed for so long, again and again"},
    {"camera.late", kLive, 120, 0, 400, "ms", "frames come so much later, in order"},
    {"camera.reorder", kLive, 0, 0, 0, "", "two exposures come in each other's place, pair by pair"},
    {"camera.duplicate", kLive, 1, 1, 6, "times", "each frame comes so many times more"},
    {"camera.size", kLive, 0.5f, 0.01f, 100, "factor", "the header says so much of the true width"},
    {"camera.torn_header", kLive, 0, 0, 0, "", "format, width, height and stride are noise"},
    {"camera.stamp_ahead", kLive, 500, 0, 1e9f, "ms", "exposures stamped in the future"},
    {"camera.stamp_back", kLive, 500, 0, 1e9f, "ms", "exposures stamped in the past"},
    {"camera.stamp_stuck", kLive, 0, 0, 0, "", "every exposure bears the stamp of the first"},
    {"camera.sequence_wrap", kLive, 2, 0, 1e6f, "frames", "the count jumps to so many frames before 2^32 and wraps"},
    {"camera.sequence_restart", kLive, 0, 0, 0, "", "the count begins at 0 again"},
    {"image.black", kLive, 0, 0, 255, "grey level", "every pixel of this level"},
    {"image.white", kLive, 255, 0, 255, "grey level", "every pixel of this level: saturated"},
    {"image.blur", kLive, 6, 1, 32, "px", "mean over a square of this radius"},
    {"image.noise", kLive, 40, 0, 255, "grey levels", "noise of this standard deviation"},
    {"image.band", kLive, 0.25f, 0, 1, "share", "a band of dead rows in the middle"},
    {"image.tear", kLive, 0.5f, 0, 1, "share", "from this row on the image before"},
    {"image.gain", kLive, 3, 0, 100, "factor", "exposed so many times as long"},
    {"depth.holes", kLive, 0.5f, 0, 1, "share", "blocks of 8 x 8 pixels without a measurement"},
    {"depth.none", kLive, 0, 0, 0, "", "frames come, but no pixel measures"},
    {"depth.bias", kLive, 300, -10'000, 10'000, "mm", "added to every measurement"},
    {"depth.quantise", kLive, 250, 1, 10'000, "mm", "measurements in steps"},
    {"depth.noise", kLive, 200, 0, 10'000, "mm", "noise of this standard deviation"},
    {"depth.zero", kLive, 1, 1, 65'535, "mm", "every measurement is this: something on the lens"},
    {"depth.far", kLive, 65'535, 1, 65'535, "mm", "every pixel, also a hole, measures this"},
    {"depth.freeze", kLive, 0, 0, 0, "", "the same depth image again and again; grey images go on"},
    {"depth.drop", kLive, 1, 0, 1, "share", "depth frames are lost at random; grey images go on"},
    {"attitude.stop", kAny, 0, 0, 0, "", "no sample comes; the link goes on"},
    {"attitude.freeze", kAny, 0, 0, 0, "", "old values under new stamps"},
    {"attitude.spike", kAny, 120, 0, 180, "deg", "one sample in ten is rolled by this, its rates to match"},
    {"attitude.nan", kAny, 0, 0, 0, "", "quaternion and rates are not numbers"},
    {"attitude.bias", kAny, 5, -180, 180, "deg", "rolled by this"},
    {"attitude.slow", kAny, 10, 0.1f, 1000, "Hz", "no more samples than this"},
    {"attitude.stamp_ahead", kAny, 500, 0, 1e9f, "ms", "stamped in the future"},
    {"attitude.stamp_back", kAny, 500, 0, 1e9f, "ms", "stamped in the past"},
    {"imu.stop", kAny, 0, 0, 0, "", "no sample comes; the link goes on"},
    {"imu.freeze", kAny, 0, 0, 0, "", "old values under new stamps"},
    {"imu.spike", kAny, 1000, 0, 1e9f, "m/s2, rad/s",
     "one sample in ten has this on one axis of accelerometer and gyroscope"},
    {"imu.nan", kAny, 0, 0, 0, "", "accelerometer, gyroscope and pressure are not numbers"},
    {"imu.bias", kAny, 2, -100, 100, "m/s2", "added to the vertical axis"},
    {"imu.slow", kAny, 10, 0.1f, 1000, "Hz", "no more samples than this"},
    {"behaviour.spin", kAimed, 20, 0, 10'000, "ms", "each step takes so much longer, busy"},
    {"behaviour.endless", kAimed, 0, 0, 0, "", "the step does not return until the fault is over"},
    {"behaviour.nan_cue", kAimed, 0, 0, 0, "", "every number of its cues is not a number"},
    {"behaviour.huge_cue", kAimed, 1e30f, -3e38f, 3e38f, "", "every number of its cues is this"},
    {"behaviour.denormal", kAimed, 0, 0, 1, "",
     "attitude and specific force it is given are denormal (0) or not numbers (1)"},
    {"behaviour.stuck_cue", kAimed, 0, 0, 0, "", "the same cue again and again, under new stamps"},
    {"behaviour.future_cue", kAimed, 500, 0, 1e9f, "ms", "its cues rest on exposures in the future"},
    {"behaviour.silent", kAimed, 0, 0, 0, "", "it steps and says nothing"},
    {"control.stall", kAny, 100, 0, 60'000, "ms", "each tick sleeps so long before its write"},
    {"control.spin", kAny, 100, 0, 10'000, "ms", "each tick is busy for so long before its write"},
    {"process.abort", kAtOnce, 0, 0, 0, "", "the process ends itself with SIGABRT"},
    {"process.segv", kAtOnce, 0, 0, 0, "", "the process writes where it has no memory: SIGSEGV"},
    {"process.descriptors", kAny, 0, 0, 1000, "left", "the process has no more file descriptors than this left"},
}};

constexpr bool complete() {
  for (const FaultRow& row : kRows)
    if (row.name.empty() || row.effect.empty() || row.value < row.low || row.value > row.high) return false;
  return true;
}
static_assert(complete(), "a row is missing, or its default is out of its range");

}  // namespace

const FaultRow& row_of(FaultPoint point) noexcept { return kRows[static_cast<std::size_t>(point)]; }

std::string_view name_of(FaultPoint point) noexcept {
  return static_cast<std::size_t>(point) < kFaultPoints ? row_of(point).name : "unknown";
}

std::optional<FaultPoint> fault_point_named(std::string_view name) noexcept {
  for (std::size_t i = 0; i < kFaultPoints; ++i)
    if (kRows[i].name == name) return static_cast<FaultPoint>(i);
  return std::nullopt;
}

}  // namespace wasp::scheduling
