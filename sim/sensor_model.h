// From ideal images to what a Kinect delivers.
//
// Depth: a structured-light camera measures disparity. Raw value r = (3.3309 - 1/z) / 0.0030711 (11 bits, the
// well-known linear-in-disparity calibration by Burrus, drivers/kinect_depth.h), so one step is 0.0030711 z^2 [m]. Gaussian noise
// of 0.36 steps before rounding gives, with the rounding, sigma = 1.42e-3 z^2 [m], the law measured by Khoshelham and
// Elberink (Sensors 12, 2012). Holes: where the projector, 7.5 cm to the right, is hidden by something nearer; where it
// grazes; outside 0.4 ... 7 m; and a few at random, more with distance.
//
// Intensity: gain, photon noise (variance in proportion to the signal) and read noise, rounded to 8 bits.
//
// Every number is a pure function of (seed, frame, pixel): the same frame comes out whoever renders it and when.
#pragma once

#include <cstdint>
#include <vector>

#include "drivers/kinect_depth.h"

namespace wasp::sim {

struct SensorParams {
  bool noise = true;                ///< false: no noise, no quantisation, no holes but those of the range
  float depth_noise_steps = 0.36f;  ///< Gaussian, in raw steps, >= 0
  float min_range_m = 0.4f, max_range_m = 7.f;
  float dropout = 0.002f;       ///< share of readings lost at random up close; grows as (z/7)^4 to ten times that
  float gain = 1.f;             ///< pixel value per luminance
  float read_noise = 1.2f;      ///< standard deviation, pixel values
  float photon_noise = 0.012f;  ///< variance per pixel value
};

class SensorModel {
 public:
  SensorModel(const SensorParams& params, int width_px, float fx_px, std::uint32_t seed);

  /// One row of depth, uint16 millimetres, 0 = no reading. `depth_m` holds `width_px` true depths, 0 = nothing hit.
  /// One thread at a time (keeps a row of scratch).
  void depth_row(std::uint32_t frame, int row, const float* depth_m, std::uint16_t* out_mm);
  /// One row of mono8.
  void gray_row(std::uint32_t frame, int row, const float* luminance, std::uint8_t* out) const;

 private:
  [[nodiscard]] std::uint32_t row_key(std::uint32_t frame, int row, std::uint32_t stream) const;
  void exact_row(const float* depth_m, std::uint16_t* out_mm) const;
  void mark_shadows(const float* depth_m);

  SensorParams params_;
  int width_px_;
  float projector_px_m_;  ///< f B: disparity [px] times depth [m]
  std::uint32_t seed_;
  drivers::KinectTable to_mm_;
  std::vector<std::int32_t> raw_;
  std::vector<std::uint8_t> seen_;  ///< 1 where the projector's light arrives
};

}  // namespace wasp::sim
