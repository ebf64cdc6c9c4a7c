// Raw 11-bit values of a first-generation Kinect to depth through a table of 2,048 entries (appendix A.3.2). Two
// models: the thesis' sum of two Gaussians, whose result is in centimetres, and the tangent of a linear function of the
// raw value that later drivers use (Magnenat 2010, as documented by the OpenKinect project). Against the geometry of
// the sensor the tangent is within 3 % from 0.6 to 3.9 m; the Gaussians are within 11 % beyond 0.8 m and a third short
// at 0.6 m (tests/vision/kinect_depth_test.cpp). Use the tangent unless a recording was made with the other.
#pragma once

#include <array>
#include <cstdint>

#include "types/image_view.h"
#include "types/realtime.h"

namespace wasp::vision {

enum class KinectModel : std::uint8_t { kTwoGaussians, kTangent };

inline constexpr int kKinectRawValues = 2048;
inline constexpr int kKinectNoReading = 2047;

struct KinectRange {
  float min_m = 0.4f, max_m = 7.f;
};

/// What `model` makes of one raw value [m]; 0 for 2047, a value that is not 11 bit, or a depth outside the range.
/// Not for pixels: it works out exponentials. Realtime-safe: yes.
float kinect_depth_m(KinectModel model, int raw, const KinectRange& range = {}) WASP_REALTIME;

struct KinectTable {
  std::array<std::uint16_t, kKinectRawValues> mm{};  ///< rounded; 0 = invalid
};

/// All 2,048 values, at start-up. A range that is not finite, positive and rising gives a table of zeros.
KinectTable make_kinect_table(KinectModel model, const KinectRange& range = {}) WASP_REALTIME;

/// Fills `out_mm` (the shape of `raw`, `out_stride_px` elements from row to row; `out_mm` may be raw.data itself) with
/// millimetres, 0 = invalid. Raw values above 11 bits are invalid. False, with nothing written, for a bad view, null,
/// or a short stride. Time: one look-up a pixel. Realtime-safe: yes.
bool kinect_depth(const KinectTable& table, const ImageView<std::uint16_t>& raw, std::uint16_t* out_mm,
                  int out_stride_px) WASP_REALTIME;

}  // namespace wasp::vision
