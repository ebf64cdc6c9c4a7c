// Natural-looking pictures made from seeds (1/f spectrum), known at every real-valued point, and how far a shift is
// off.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include "types/image_view.h"
#include "vision/kernels/image_shift.h"

namespace wasp::vision::test {

inline constexpr ImageShiftParams kQuickShift{.planning = FftPlanning::kEstimate};

/// A picture known at every real-valued point: plane waves, amplitude 1 / frequency, so that shifts are exact.
class Picture {
 public:
  explicit Picture(unsigned seed) : random_(seed) {
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (Wave& w : waves_) {
      const double frequency = 0.004 * std::pow(80.0, unit(random_)), angle = 2 * std::numbers::pi * unit(random_);
      w = {2 * std::numbers::pi * frequency * std::cos(angle), 2 * std::numbers::pi * frequency * std::sin(angle),
           2 * std::numbers::pi * unit(random_), 0.02 / (frequency + 0.01)};
    }
  }

  /// Window whose content is moved by (x, y), with white noise at `snr_db`;
  /// turned by `turn_rad` and grown by `zoom` about the window's middle.
  std::vector<std::uint8_t> window(int columns, int rows, double x, double y, double snr_db, double turn_rad = 0,
                                   double zoom = 1) {
    const double middle_u = 0.5 * (columns - 1), middle_v = 0.5 * (rows - 1);
    const double c = std::cos(turn_rad) / zoom, s = std::sin(turn_rad) / zoom;
    std::vector<double> values;
    double mean = 0, square = 0;
    for (int v = 0; v < rows; ++v)
      for (int u = 0; u < columns; ++u) {
        double sum = 0;
        const double du = u - x - middle_u, dv = v - y - middle_v;
        const double pu = middle_u + c * du + s * dv, pv = middle_v - s * du + c * dv;
        for (const Wave& w : waves_) sum += w.size * std::sin(w.x * pu + w.y * pv + w.phase);
        values.push_back(sum);
        mean += sum;
        square += sum * sum;
      }
    const double n = static_cast<double>(values.size());
    const double sigma = std::sqrt(square / n - mean * mean / n / n);
    std::normal_distribution<double> noise(0.0, std::pow(10.0, -snr_db / 20));
    std::vector<std::uint8_t> pixels;
    for (const double value : values)
      pixels.push_back(static_cast<std::uint8_t>(
          std::clamp(std::lround(128 + 35 * ((value - mean / n) / sigma + noise(random_))), 0L, 255L)));
    return pixels;
  }

 private:
  struct Wave {
    double x, y, phase, size;
  };
  std::mt19937 random_;
  std::array<Wave, 120> waves_;
};

inline GrayView view(const std::vector<std::uint8_t>& pixels, int columns) {
  return {pixels.data(), columns, static_cast<int>(pixels.size()) / columns, columns};
}

inline double error_of(const ImageShift& s, double x, double y) {
  return std::hypot(static_cast<double>(s.x_px) - x, static_cast<double>(s.y_px) - y);
}

}  // namespace wasp::vision::test
