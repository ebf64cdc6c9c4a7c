// Raw 11-bit values of a first-generation Kinect to depth through a table of 2,048 entries (appendix A.3.2). Three
// models: the thesis' sum of two Gaussians, whose result is in centimetres; the tangent of a linear function of the raw
// value (Magnenat 2010, as documented by the OpenKinect project); and what triangulation says, 1/z linear in the raw
// value (Burrus 2010). docs/kinect.md has them side by side. `wasp calibrate kinect-depth` fits each to one's own
// sensor.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "types/image_view.h"
#include "types/realtime.h"

namespace wasp::drivers {

enum class KinectModel : std::uint8_t {
  kTwoGaussians,  ///< z [cm] = a1 exp(-((x - b1)/c1)^2) + a2 exp(-((x - b2)/c2)^2), (A.4); a1 b1 c1 a2 b2 c2
  kTangent,       ///< z [m] = k3 tan(x/k2 + k1); k1 k2 k3
  kLinear,        ///< z [m] = 1/(a x + b); a b
};

inline constexpr int kKinectRawValues = 2048;
inline constexpr int kKinectNoReading = 2047;

/// What a model was fitted to: it speaks of no other depths.
struct KinectRange {
  float min_m = 0.4f, max_m = 7.f;
};

/// A model with its coefficients in the order that KinectModel names them; those it has not are not read.
struct KinectDepthModel {
  KinectModel kind = KinectModel::kTangent;
  std::array<double, 6> coefficients{};
  KinectRange range;
};

inline constexpr KinectDepthModel kThesisGaussians{
    KinectModel::kTwoGaussians, {3.169e4, 1338.0, 140.4, 6.334e18, 2.035e4, 3154.0}, {}};
inline constexpr KinectDepthModel kMagnenatTangent{KinectModel::kTangent, {1.1863, 2842.5, 0.1236}, {}};
inline constexpr KinectDepthModel kBurrusLinear{KinectModel::kLinear, {-0.0030711016, 3.3309495161}, {}};

/// How many coefficients it has: 6, 3, 2.
int coefficient_count(KinectModel kind) WASP_REALTIME;
/// "two-gaussians", "tangent", "linear".
std::string_view name_of(KinectModel kind) WASP_REALTIME;
/// The published model of that name; false, and `out` untouched, if there is none.
bool published_model(std::string_view name, KinectDepthModel& out) WASP_REALTIME;

/// The formula alone, whatever the range [m]; may be negative, infinite or not a number beyond its poles.
double model_depth_m(const KinectDepthModel& model, double raw) WASP_REALTIME;

/// What `model` makes of one raw value [m]; 0 for 2047, a value that is not 11 bit, or a depth outside the range.
/// Not for pixels: it works out exponentials. Realtime-safe: yes.
float kinect_depth_m(const KinectDepthModel& model, int raw) WASP_REALTIME;

struct KinectTable {
  std::array<std::uint16_t, kKinectRawValues> mm{};  ///< rounded; 0 = invalid
};

/// All 2,048 values, at start-up. A range that is not finite, positive and rising gives a table of zeros.
KinectTable make_kinect_table(const KinectDepthModel& model) WASP_REALTIME;

/// The raw value whose depth is nearest to `depth_mm`; kKinectNoReading for 0 and what the table does not reach (more
/// than a step beyond its ends). Needs a table whose valid entries rise. Realtime-safe: yes (binary search).
std::uint16_t kinect_raw(const KinectTable& table, int depth_mm) WASP_REALTIME;

/// Fills `out_mm` (the shape of `raw`, `out_stride_px` elements from row to row; `out_mm` may be raw.data itself) with
/// millimetres, 0 = invalid. Raw values above 11 bits are invalid. False, with nothing written, for a bad view, null,
/// or a short stride. Time: one look-up a pixel. Realtime-safe: yes.
bool kinect_depth(const KinectTable& table, const ImageView<std::uint16_t>& raw, std::uint16_t* out_mm,
                  int out_stride_px) WASP_REALTIME;

}  // namespace wasp::drivers
