#include "drivers/kinect_images.h"

#include <cstddef>
#include <cstring>

namespace wasp::drivers {

void rgb_to_gray(const std::uint8_t* rgb, int pixels, std::uint8_t* gray) noexcept {
  for (int i = 0; i < pixels; ++i)
    gray[i] = static_cast<std::uint8_t>((77u * rgb[3 * i] + 150u * rgb[3 * i + 1] + 29u * rgb[3 * i + 2] + 128u) >> 8);
}

void crop_infrared(const std::uint8_t* infrared, std::uint8_t* gray) noexcept {
  std::memcpy(gray, infrared + std::ptrdiff_t{kInfraredFirstRow} * kKinectWidth, kKinectPixels);
}

}  // namespace wasp::drivers
