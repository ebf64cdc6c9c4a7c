// JpegGray of a build without libjpeg (WASP_FLIGHT_ONLY where it is absent); v4l2_mode.cpp never chooses JPEG then.
#include "drivers/jpeg_gray.h"

namespace wasp::drivers {

struct JpegGray::Decoder {};

JpegGray::JpegGray() : why_("this build has no JPEG") {}
JpegGray::~JpegGray() = default;

bool JpegGray::decode(std::span<const std::uint8_t>, int, int, std::uint8_t*, const std::function<void()>&) {
  return false;
}

}  // namespace wasp::drivers
