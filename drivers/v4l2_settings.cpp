#include "drivers/v4l2_settings.h"

#include <cmath>
#include <cstdio>

namespace wasp::drivers {
namespace {

constexpr double kExposureUnit_us = 100;  // V4L2_CID_EXPOSURE_ABSOLUTE

std::string number(const char* format, double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

/// Cameras without one of the two automatic modes refuse it: any will do.
void automatic_exposure(const V4l2Device& device) {
  if (!device.set_control(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY))
    device.set_control(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_AUTO);
  device.set_control(V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0);  // the dark must not lower the frame rate
}

void fixed_exposure(const V4l2Device& device, double exposure_us) {
  device.set_control(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL);
  if (!device.set_control(V4L2_CID_EXPOSURE_ABSOLUTE, static_cast<int>(std::lround(exposure_us / kExposureUnit_us))))
    throw CameraError(device.identity().node, "takes no fixed exposure", "set [camera] exposure_us = 0");
}

void set_gain(const V4l2Device& device, double gain) {
  device.set_control(V4L2_CID_AUTOGAIN, gain < 0 ? 1 : 0);
  if (gain >= 0 && !device.set_control(V4L2_CID_GAIN, static_cast<int>(std::lround(gain))))
    throw CameraError(device.identity().node, "takes no fixed gain", "set [camera] gain = -1");
}

double set_rate(const V4l2Device& device, double rate_hz) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (device.call(VIDIOC_G_PARM, &parameters) != 0) return 0;
  v4l2_fract& period = parameters.parm.capture.timeperframe;
  if ((parameters.parm.capture.capability & V4L2_CAP_TIMEPERFRAME) != 0) {
    period = {1000, static_cast<__u32>(std::lround(rate_hz * 1000))};
    device.call(VIDIOC_S_PARM, &parameters);
    if (device.call(VIDIOC_G_PARM, &parameters) != 0) return 0;
  }
  return period.numerator == 0 ? 0 : static_cast<double>(period.denominator) / period.numerator;
}

}  // namespace

V4l2Settings apply_settings(const V4l2Device& device, const CameraRequest& request) {
  const CameraSettings& s = request.settings;
  if (s.trigger != "off")
    throw CameraError(device.identity().node, "V4L2 has no external trigger", "set [camera] trigger = \"off\"");
  V4l2Settings out;
  if (s.exposure_us > 0)
    fixed_exposure(device, s.exposure_us);
  else
    automatic_exposure(device);
  set_gain(device, s.gain);
  out.rate_hz = set_rate(device, request.rate_hz);
  int exposure = 0, gain = 0;
  if (device.control(V4L2_CID_EXPOSURE_ABSOLUTE, exposure) && exposure > 0) {
    out.exposure_ns = static_cast<DurationNs>(exposure * kExposureUnit_us) * kMicrosecond;
    out.text = number("exposure %.0f us", static_cast<double>(out.exposure_ns) * 1e-3);
    if (s.exposure_us <= 0) out.text += " (automatic)";
  } else {
    out.text = "exposure not known";
  }
  if (device.control(V4L2_CID_GAIN, gain)) out.text += number(", gain %.0f", gain) + (s.gain < 0 ? " (automatic)" : "");
  out.text += out.rate_hz > 0 ? number(", %.4g Hz", out.rate_hz) : std::string(", rate not known");
  return out;
}

}  // namespace wasp::drivers
