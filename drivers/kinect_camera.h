// A first-generation Kinect through libfreenect. The library writes depth straight into the ring slot, where raw 11-bit
// values become millimetres in place; video it writes into memory of ours, because no format of it is the ring's. Depth
// is published when it comes, grey with it (drivers/exposure_pairs.h). The device's 60 MHz stamps become our time by
// drivers/device_clock.h. An image of which packets were lost holds pieces of the one before: it is not published.
//
// [camera] device: the serial number. pixel_format: "rgb" (default) or "ir". depth_mode, depth_model,
// depth_coefficients, depth_range_m: see config/wasp.toml. gain: of infrared, 1 ... 50. exposure_us is refused: the
// library sets none.
#pragma once

#include <memory>
#include <vector>

#include "drivers/camera_driver.h"

namespace wasp::drivers {

struct FreenectApi;

/// Throws CameraError for settings that no Kinect has; touches no device.
std::unique_ptr<CameraDriver> make_kinect_camera(const CameraRequest& request);
/// The same over a library that the caller brings, which outlives it.
std::unique_ptr<CameraDriver> make_kinect_camera(const CameraRequest& request, const FreenectApi& library);
std::vector<FoundCamera> list_kinect_cameras();

}  // namespace wasp::drivers
