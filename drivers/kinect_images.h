// What a Kinect's video stream holds, made the grey image of the ring. Realtime-safe: yes, all of it.
#pragma once

#include <cstdint>

#include "types/realtime.h"

namespace wasp::drivers {

inline constexpr int kKinectWidth = 640, kKinectHeight = 480;
inline constexpr int kKinectPixels = kKinectWidth * kKinectHeight;
/// The infrared image has eight rows more. Its row v + 4 lies on the depth image's row v (to a tenth of a pixel), its
/// column u + 4.8 on column u: the depth sensor correlates in windows and says nothing of the border.
inline constexpr int kInfraredRows = 488, kInfraredFirstRow = 4;

/// Luminance of `pixels` RGB triples by the weights of BT.601 in 8 bits, rounded; grey (r = g = b) stays what it is.
void rgb_to_gray(const std::uint8_t* rgb, int pixels, std::uint8_t* gray) WASP_REALTIME;

/// The 480 rows of a 640 x 488 infrared image that the depth image covers.
void crop_infrared(const std::uint8_t* infrared, std::uint8_t* gray) WASP_REALTIME;

}  // namespace wasp::drivers
