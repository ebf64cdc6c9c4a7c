#include "drivers/v4l2_mode.h"

#include <algorithm>
#include <array>
#include <cstdio>

namespace wasp::drivers {
namespace {

/// Best first: nothing to convert, then the fewest bytes to touch, JPEG last.
constexpr std::array kPixels {
  V4l2Pixels{V4L2_PIX_FMT_GREY, "GREY", false, {1, 0}}, V4l2Pixels{V4L2_PIX_FMT_NV12, "NV12", false, {1, 0}},
      V4l2Pixels{V4L2_PIX_FMT_YUV420, "YU12", false, {1, 0}}, V4l2Pixels{V4L2_PIX_FMT_YUYV, "YUYV", false, {2, 0}},
      V4l2Pixels{V4L2_PIX_FMT_UYVY, "UYVY", false, {2, 1}},
#if WASP_HAVE_JPEG
      V4l2Pixels{V4L2_PIX_FMT_MJPEG, "MJPG", true, {1, 0}}, V4l2Pixels{V4L2_PIX_FMT_JPEG, "JPEG", true, {1, 0}},
#endif
};

constexpr double kRateSlack = 0.97;  // 29.97 is 30

bool fast_enough(const V4l2Mode& mode, double rate_hz) {
  return mode.rates_hz.empty() ||
         std::ranges::any_of(mode.rates_hz, [&](double r) { return r >= kRateSlack * rate_hz; });
}

std::string known_names() {
  std::string names;
  for (const auto& p : kPixels) names += (names.empty() ? "" : ", ") + std::string(p.name);
  return names;
}

std::string offer_text(const std::vector<V4l2Mode>& offered) {
  std::string text;
  for (const auto& mode : offered) text += (text.empty() ? "" : ", ") + mode_text(mode);
  return text.empty() ? "nothing" : text;
}

}  // namespace

const V4l2Pixels* find_pixels(std::uint32_t fourcc) {
  const auto it = std::ranges::find(kPixels, fourcc, &V4l2Pixels::fourcc);
  return it == kPixels.end() ? nullptr : &*it;
}

std::string mode_text(const V4l2Mode& mode) {
  std::string text =
      fourcc_text(mode.fourcc) + " " + std::to_string(mode.width_px) + "x" + std::to_string(mode.height_px);
  for (const double rate : mode.rates_hz) {
    std::array<char, 32> number{};
    std::snprintf(number.data(), number.size(), " %.4g", rate);
    text += number.data();
  }
  return mode.rates_hz.empty() ? text : text + " Hz";
}

V4l2Mode choose_mode(const std::vector<V4l2Mode>& offered, const CameraRequest& request, const std::string& device) {
  const std::string& only = request.settings.pixel_format;
  if (!only.empty() && std::ranges::none_of(kPixels, [&](const auto& p) { return only == p.name; }))
    throw CameraError(device, "pixel format '" + only + "' is not supported",
                      "[camera] pixel_format is one of " + known_names());
  for (const bool at_rate : {true, false})
    for (const auto& pixels : kPixels) {
      if (!only.empty() && only != pixels.name) continue;
      for (const auto& mode : offered)
        if (mode.fourcc == pixels.fourcc && mode.width_px == request.width_px && mode.height_px == request.height_px &&
            (!at_rate || fast_enough(mode, request.rate_hz)))
          return mode;
    }
  const bool any = std::ranges::any_of(offered, [&](const V4l2Mode& m) {
    const V4l2Pixels* pixels = find_pixels(m.fourcc);
    return pixels != nullptr && (only.empty() || only == pixels->name);
  });
  const std::string size = std::to_string(request.width_px) + "x" + std::to_string(request.height_px);
  throw CameraError(device,
                    any ? "offers no pictures of " + size + (only.empty() ? "" : " as " + only)
                        : "offers no pixel format that can be used (" + (only.empty() ? known_names() : only) + ")",
                    "set width_px, height_px and pixel_format of [camera], and its intrinsics, to what it offers: " +
                        offer_text(offered));
}

}  // namespace wasp::drivers
