#include "drivers/dc1394_settings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <span>

namespace wasp::drivers {
namespace {

constexpr double kCycle_s = 125e-6;  // a packet of a camera's stream in every cycle of the bus
constexpr double kRateSlack = 0.97;  // of what was asked for

struct FixedMode {
  dc1394video_mode_t mode;
  int width_px, height_px;
};
constexpr std::array kFixed{
    FixedMode{DC1394_VIDEO_MODE_640x480_MONO8, 640, 480}, FixedMode{DC1394_VIDEO_MODE_800x600_MONO8, 800, 600},
    FixedMode{DC1394_VIDEO_MODE_1024x768_MONO8, 1024, 768}, FixedMode{DC1394_VIDEO_MODE_1280x960_MONO8, 1280, 960},
    FixedMode{DC1394_VIDEO_MODE_1600x1200_MONO8, 1600, 1200}};

double hz_of(dc1394framerate_t rate) { return 1.875 * std::pow(2.0, static_cast<int>(rate - DC1394_FRAMERATE_1_875)); }

std::string number(const char* format, double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

std::string format7_name(dc1394video_mode_t mode) {
  return "F7_" + std::to_string(static_cast<int>(mode - DC1394_VIDEO_MODE_FORMAT7_0));
}

std::vector<dc1394video_mode_t> modes_of(const Dc1394Device& device) {
  dc1394video_modes_t modes{};
  device.demand(dc1394_video_get_supported_modes(device.get(), &modes), "ask for its video modes");
  return {modes.modes, modes.modes + std::min<std::uint32_t>(modes.num, DC1394_VIDEO_MODE_NUM)};
}

std::vector<dc1394framerate_t> rates_of(const Dc1394Device& device, dc1394video_mode_t mode) {
  dc1394framerates_t rates{};
  if (dc1394_video_get_supported_framerates(device.get(), mode, &rates) != DC1394_SUCCESS) return {};
  return {rates.framerates, rates.framerates + std::min<std::uint32_t>(rates.num, DC1394_FRAMERATE_NUM)};
}

/// The slowest rate that is fast enough.
std::optional<dc1394framerate_t> choose_rate(const std::vector<dc1394framerate_t>& rates, double rate_hz) {
  std::optional<dc1394framerate_t> best;
  for (const auto rate : rates)
    if (hz_of(rate) >= kRateSlack * rate_hz && (!best || rate < *best)) best = rate;
  return best;
}

std::optional<Dc1394Mode> try_fixed(const Dc1394Device& device, const CameraRequest& request,
                                    std::span<const dc1394video_mode_t> offered) {
  for (const FixedMode& fixed : kFixed) {
    if (fixed.width_px != request.width_px || fixed.height_px != request.height_px) continue;
    if (std::ranges::find(offered, fixed.mode) == offered.end()) continue;
    const auto rate = choose_rate(rates_of(device, fixed.mode), request.rate_hz);
    if (!rate) continue;
    device.demand(dc1394_video_set_mode(device.get(), fixed.mode), "set its video mode");
    device.demand(dc1394_video_set_framerate(device.get(), *rate), "set its frame rate");
    dc1394framerate_t back = *rate;
    device.demand(dc1394_video_get_framerate(device.get(), &back), "read its frame rate");
    return Dc1394Mode{fixed.mode, "MONO8", fixed.width_px, fixed.height_px, hz_of(back)};
  }
  return std::nullopt;
}

bool has_mono8(const Dc1394Device& device, dc1394video_mode_t mode) {
  dc1394color_codings_t codings{};
  if (dc1394_format7_get_color_codings(device.get(), mode, &codings) != DC1394_SUCCESS) return false;
  return std::ranges::count(std::span(codings.codings, codings.num), DC1394_COLOR_CODING_MONO8) > 0;
}

std::uint32_t middle(std::uint32_t whole, int part, std::uint32_t unit) {
  const std::uint32_t room = (whole - static_cast<std::uint32_t>(part)) / 2;
  return unit == 0 ? room : room / unit * unit;
}

/// Bytes a packet needs so that a frame takes no longer than the rate allows.
std::uint32_t packet_bytes(double frame_bytes, double rate_hz, std::uint32_t unit, std::uint32_t most) {
  const double packets = std::max(1.0, std::floor(1 / (rate_hz * kCycle_s)));
  const std::uint32_t step = std::max(unit, 1u);
  const auto bytes = static_cast<std::uint32_t>(std::ceil(frame_bytes / packets / step)) * step;
  return std::min(bytes, most / step * step);
}

std::optional<Dc1394Mode> try_format7(const Dc1394Device& device, const CameraRequest& request,
                                      dc1394video_mode_t mode) {
  dc1394camera_t* const camera = device.get();
  std::uint32_t width = 0, height = 0, unit_w = 1, unit_h = 1, unit_x = 0, unit_y = 0, unit_bytes = 0, max_bytes = 0;
  if (!has_mono8(device, mode) || dc1394_format7_get_max_image_size(camera, mode, &width, &height) != DC1394_SUCCESS)
    return std::nullopt;
  dc1394_format7_get_unit_size(camera, mode, &unit_w, &unit_h);
  dc1394_format7_get_unit_position(camera, mode, &unit_x, &unit_y);
  const auto w = static_cast<std::uint32_t>(request.width_px), h = static_cast<std::uint32_t>(request.height_px);
  if (w > width || h > height || (unit_w > 0 && w % unit_w != 0) || (unit_h > 0 && h % unit_h != 0))
    return std::nullopt;
  device.demand(dc1394_video_set_mode(camera, mode), "set its video mode");
  const auto set_region = [&](std::int32_t bytes) {
    device.demand(dc1394_format7_set_roi(camera, mode, DC1394_COLOR_CODING_MONO8, bytes,
                                         static_cast<std::int32_t>(middle(width, request.width_px, unit_x)),
                                         static_cast<std::int32_t>(middle(height, request.height_px, unit_y)),
                                         request.width_px, request.height_px),
                  "set its region of Format 7");
  };
  set_region(DC1394_USE_MAX_AVAIL);  // the limits of a packet depend on the region
  if (dc1394_format7_get_packet_parameters(camera, mode, &unit_bytes, &max_bytes) == DC1394_SUCCESS && max_bytes > 0)
    set_region(
        static_cast<std::int32_t>(packet_bytes(static_cast<double>(w) * h, request.rate_hz, unit_bytes, max_bytes)));
  std::uint32_t packets = 0;
  dc1394_format7_get_packets_per_frame(camera, mode, &packets);
  return Dc1394Mode{mode, format7_name(mode), request.width_px, request.height_px,
                    packets > 0 ? 1 / (packets * kCycle_s) : 0};
}

bool is_format7(dc1394video_mode_t mode) {
  return mode >= DC1394_VIDEO_MODE_FORMAT7_MIN && mode <= DC1394_VIDEO_MODE_FORMAT7_MAX;
}

bool can(const Dc1394Device& device, dc1394feature_t feature, dc1394feature_mode_t wanted) {
  dc1394feature_modes_t modes{};
  return dc1394_feature_get_modes(device.get(), feature, &modes) == DC1394_SUCCESS &&
         std::ranges::count(std::span(modes.modes, modes.num), wanted) > 0;
}

bool has_absolute(const Dc1394Device& device, dc1394feature_t feature) {
  dc1394bool_t has = DC1394_FALSE;
  return dc1394_feature_has_absolute_control(device.get(), feature, &has) == DC1394_SUCCESS && has == DC1394_TRUE;
}

void set_absolute(const Dc1394Device& device, dc1394feature_t feature, double value, const std::string& what) {
  float low = 0, high = 0;
  device.demand(dc1394_feature_set_mode(device.get(), feature, DC1394_FEATURE_MODE_MANUAL), "set its " + what);
  device.demand(dc1394_feature_set_absolute_control(device.get(), feature, DC1394_ON), "set its " + what);
  device.demand(dc1394_feature_get_absolute_boundaries(device.get(), feature, &low, &high), "ask for its " + what);
  const float wanted = std::clamp(static_cast<float>(value), low, high);
  device.demand(dc1394_feature_set_absolute_value(device.get(), feature, wanted), "set its " + what);
}

void set_raw(const Dc1394Device& device, dc1394feature_t feature, double value, const std::string& what) {
  std::uint32_t low = 0, high = 0;
  device.demand(dc1394_feature_set_mode(device.get(), feature, DC1394_FEATURE_MODE_MANUAL), "set its " + what);
  device.demand(dc1394_feature_get_boundaries(device.get(), feature, &low, &high), "ask for its " + what);
  const auto wanted = std::clamp(static_cast<std::uint32_t>(std::lround(std::max(0.0, value))), low, high);
  device.demand(dc1394_feature_set_value(device.get(), feature, wanted), "set its " + what);
}

void set_shutter(const Dc1394Device& device, double exposure_us) {
  if (exposure_us <= 0) {
    if (can(device, DC1394_FEATURE_SHUTTER, DC1394_FEATURE_MODE_AUTO))
      dc1394_feature_set_mode(device.get(), DC1394_FEATURE_SHUTTER, DC1394_FEATURE_MODE_AUTO);
    return;
  }
  if (!has_absolute(device, DC1394_FEATURE_SHUTTER))
    throw CameraError("dc1394 " + guid_text(device.get()->guid), "knows no shutter in seconds",
                      "set [camera] exposure_us = 0");
  set_absolute(device, DC1394_FEATURE_SHUTTER, exposure_us * 1e-6, "shutter");
}

void set_gain(const Dc1394Device& device, double gain) {
  if (gain < 0) {
    if (can(device, DC1394_FEATURE_GAIN, DC1394_FEATURE_MODE_AUTO))
      dc1394_feature_set_mode(device.get(), DC1394_FEATURE_GAIN, DC1394_FEATURE_MODE_AUTO);
  } else if (has_absolute(device, DC1394_FEATURE_GAIN)) {
    set_absolute(device, DC1394_FEATURE_GAIN, gain, "gain");
  } else {
    set_raw(device, DC1394_FEATURE_GAIN, gain, "gain");
  }
}

/// Mode 0: the edge starts an exposure of the shutter's length.
void set_trigger(const Dc1394Device& device, const std::string& trigger) {
  const bool external = trigger == "external";
  const dc1394error_t error = dc1394_external_trigger_set_power(device.get(), external ? DC1394_ON : DC1394_OFF);
  if (!external) return;  // a camera that has none is as good as one whose is off
  device.demand(error, "switch its external trigger on");
  device.demand(dc1394_external_trigger_set_mode(device.get(), DC1394_TRIGGER_MODE_0), "set its trigger to mode 0");
}

}  // namespace

Dc1394Mode set_mode(const Dc1394Device& device, const CameraRequest& request) {
  const std::string& only = request.settings.pixel_format;
  const auto offered = modes_of(device);
  dc1394_video_set_iso_speed(device.get(), DC1394_ISO_SPEED_400);
  if (only.empty() || only == "MONO8")
    if (const auto mode = try_fixed(device, request, offered)) return *mode;
  for (const auto mode : offered)
    if (is_format7(mode) && (only.empty() || only == format7_name(mode)))
      if (const auto region = try_format7(device, request, mode)) return *region;
  std::string lines;
  for (const auto& line : mode_lines(device)) lines += (lines.empty() ? "" : ", ") + line;
  throw CameraError("dc1394 " + guid_text(device.get()->guid),
                    "offers no mono8 pictures of " + std::to_string(request.width_px) + "x" +
                        std::to_string(request.height_px) + " at " + number("%.4g Hz", request.rate_hz) +
                        (only.empty() ? "" : " as " + only),
                    "set width_px, height_px, rate_hz and pixel_format of [camera], and its intrinsics, to what it "
                    "offers: " +
                        (lines.empty() ? "nothing" : lines));
}

Dc1394Features set_features(const Dc1394Device& device, const CameraRequest& request) {
  set_shutter(device, request.settings.exposure_us);
  set_gain(device, request.settings.gain);
  set_trigger(device, request.settings.trigger);
  Dc1394Features out;
  float seconds = 0, decibel = 0;
  if (has_absolute(device, DC1394_FEATURE_SHUTTER) &&
      dc1394_feature_get_absolute_value(device.get(), DC1394_FEATURE_SHUTTER, &seconds) == DC1394_SUCCESS &&
      seconds > 0) {
    out.exposure_ns = from_seconds(static_cast<double>(seconds));
    out.text = number("shutter %.0f us", static_cast<double>(seconds) * 1e6);
    if (request.settings.exposure_us <= 0) out.text += " (automatic)";
  } else {
    out.text = "shutter not known";
  }
  std::uint32_t raw = 0;
  if (has_absolute(device, DC1394_FEATURE_GAIN) &&
      dc1394_feature_get_absolute_value(device.get(), DC1394_FEATURE_GAIN, &decibel) == DC1394_SUCCESS)
    out.text += number(", gain %.2f dB", static_cast<double>(decibel));
  else if (dc1394_feature_get_value(device.get(), DC1394_FEATURE_GAIN, &raw) == DC1394_SUCCESS)
    out.text += number(", gain %.0f", raw);
  return out;
}

std::vector<std::string> mode_lines(const Dc1394Device& device) {
  std::vector<std::string> lines;
  for (const auto mode : modes_of(device)) {
    if (const auto fixed = std::ranges::find(kFixed, mode, &FixedMode::mode); fixed != kFixed.end()) {
      std::string line = "MONO8 " + std::to_string(fixed->width_px) + "x" + std::to_string(fixed->height_px);
      for (const auto rate : rates_of(device, mode)) line += number(" %.4g", hz_of(rate));
      lines.push_back(line + " Hz");
    } else if (std::uint32_t w = 0, h = 0;
               is_format7(mode) && has_mono8(device, mode) &&
               dc1394_format7_get_max_image_size(device.get(), mode, &w, &h) == DC1394_SUCCESS) {
      lines.push_back(format7_name(mode) + " up to " + std::to_string(w) + "x" + std::to_string(h));
    }
  }
  return lines;
}

}  // namespace wasp::drivers
