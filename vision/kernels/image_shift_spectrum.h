// Spectra of image_shift: windowing, cross power, whitening and the correlation peak, as SIMD functions (Highway picks
// the widest instruction set the processor has, once, at the first call). Realtime-safe: yes, all.
#pragma once

#include <complex>
#include <cstddef>

#include "types/realtime.h"

namespace wasp::vision::shift {

/// sum of wy[r] wx[c] image[r][c].
float weighted_sum(const float* image, int pitch, int rows, int columns, const float* wx,
                   const float* wy) WASP_REALTIME;

/// z[r][c] = wy[r] wx[c] ((a - mean_a) + j (b - mean_b)) in the top left rows x columns of z (z_rows x z_columns), 0
/// elsewhere.
void pack_pair(const float* a, const float* b, int pitch, int rows, int columns, float mean_a, float mean_b,
               const float* wx, const float* wy, std::complex<float>* z, int z_rows, int z_columns) WASP_REALTIME;

/// Rows -rows_v ... rows_v by columns 0 ... columns_u of a half spectrum, as separate planes, `pitch` floats a row.
struct Band {
  float *re = nullptr, *im = nullptr;
  int rows_v = 0, columns_u = 0, pitch = 0;
  [[nodiscard]] std::ptrdiff_t offset(int v) const WASP_REALTIME {
    return static_cast<std::ptrdiff_t>(v + rows_v) * pitch;
  }
  [[nodiscard]] int rows() const WASP_REALTIME { return 2 * rows_v + 1; }
};

/// Energies of the two spectra inside a band (times 4).
struct BandEnergy {
  double first = 0, second = 0;
};

/// H = F2 conj(F1) (3.13) (times 4) from the transform of f1 + j f2, inside the band. Needs rows_v < z_rows / 2 and
/// columns_u < z_columns / 2, columns_u + 16 < z_columns; the band's rows must be padded to kLanesMargin.
BandEnergy cross_power(const std::complex<float>* z, int z_rows, int z_columns, const Band& band) WASP_REALTIME;

/// Mean of |H| over the band's columns u >= u_from (all rows).
float mean_magnitude(const Band& band, int u_from) WASP_REALTIME;

/// G = H |H| wx[u] wy[v] / (|H|^2 + noise^2), same shapes; wy starts at row -rows_v; noise 0 is phase only.
/// Returns the sum of |G|.
float whiten(const Band& h, float noise, const float* wx, const float* wy, const Band& g) WASP_REALTIME;

/// Correlation and its derivatives at one shift: sums over the band of t = G ex[u] ey[v].
struct PeakSums {
  float c = 0, cx = 0, cy = 0, cxx = 0, cxy = 0, cyy = 0;
};

/// ex, ey: unit phasors as (cos, sin) arrays; ey starts at row -rows_v. Derivatives are by the phase step per bin.
PeakSums peak_sums(const Band& band, const float* ex_re, const float* ex_im, const float* ey_re,
                   const float* ey_im) WASP_REALTIME;

}  // namespace wasp::vision::shift
