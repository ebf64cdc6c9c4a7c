// Defocus of a thin lens, as a blur of the sharp image with each pixel's own radius.
//
// A point at distance z is imaged sharp at s' where 1/s' = 1/f - 1/z; the sensor stands where that of focus_m is. By
// similar triangles its cone of light, as wide as the aperture A at the lens, is |s_sensor - s'| / s' A wide on the
// sensor, and with the thin lens equation
//     c = A s_sensor |1/z - 1/focus_m|     (Potmesil and Chakravarty, SIGGRAPH 1981, eq. 2 and 3, rearranged).
// A camera's calibrated focal length in pixels is s_sensor over the pixel's width, so in pixels c = A fx |1/z -
// 1/focus_m|. A fisheye has no single image plane: there z is the distance along the ray and c that of its axis.
//
// Every pixel's light is spread over a disc of that diameter (kernels are pixel coverages of a disc, mixed so that
// their variance is the disc's c^2/16). Of what lands on a pixel,
//   - light from the pixel's own face or depth is averaged,
//   - light from nearer things lies over it, with their coverage: a blurred edge reaches over what is behind,
//   - light from farther things does not land on it: an object in focus keeps its edge. Where the pixel's own light
//     covers it only in part (the inner side of a blurred edge) the farther ones seen within its own disc fill the
//     rest.
// Not modelled: what such an edge hides is taken from beside it, and highlights brighter than the sensor's range.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/optics.h"
#include "sim/renderer.h"

namespace wasp::sim {

/// Diameter of the circle of confusion of a point at distance `z_m` > 0 [px].
float circle_of_confusion_px(float aperture_m, float fx_px, float focus_m, float z_m);

class Defocus {
 public:
  static constexpr float kMaxRadius_px = 8;  ///< circles are cut to twice this

  /// For frames of width_px x height_px.
  Defocus(const OpticsParams& optics, float fx_px, int width_px, int height_px);

  /// Blurs the frame's luminance. Allocates nothing. One thread at a time.
  void apply(CastFrame& frame);

 private:
  static constexpr int kMargin = 9, kStepsPerPixel = 8;
  static constexpr int kLevels = static_cast<int>(kMaxRadius_px) * kStepsPerPixel + 1;
  /// What has landed on each pixel: weight and light from its own layer and from nearer ones.
  struct Landed {
    std::vector<float> own, own_light, near, near_light;
  };
  /// (2 reach + 1)^2 weights, row-major; their sum is 1.
  struct Kernel {
    int reach = 0;
    std::vector<float> weights;
  };
  static std::vector<Kernel> make_kernels();
  void pad(const CastFrame& frame);
  void spread(std::ptrdiff_t at);
  [[nodiscard]] float merged(std::ptrdiff_t at) const;
  [[nodiscard]] std::ptrdiff_t padded(int u, int v) const { return (v + kMargin) * stride_ + u + kMargin; }

  OpticsParams optics_;
  float fx_px_;
  int width_px_, height_px_;
  std::ptrdiff_t stride_;
  std::vector<Kernel> kernels_;  ///< by radius in steps
  std::vector<float> light_, range_;
  std::vector<std::uint32_t> face_;
  std::vector<std::uint8_t> level_;  ///< radius in steps
  Landed landed_;
};

}  // namespace wasp::sim
