// An array of Reichardt correlators (thesis 2.1.3.2, figure 2.10): photoreceptors on a regular lattice see the image
// blurred over their pitch; each signal has its mean removed by a slow low-pass; two neighbours are correlated, one of
// them delayed by a first-order low-pass, and the mirror image is subtracted: R = L(a) b - a L(b). Summed over a cell
// this is positive for motion to the right (from a to b) and, in the vertical array, downwards.
//
// It is no velocity: for a pattern of wavelength l moving at v, R ~ I^2 sin(2 pi b / l) w / (1 + w^2), w = 2 pi v tau /
// l, so it grows with contrast, peaks at a temporal frequency 1/(2 pi tau), and is negative for wavelengths under 2 b.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "types/image_view.h"
#include "types/realtime.h"
#include "vision/kernels/flow_field.h"

namespace wasp::vision {

struct EmdParams {
  int columns = 12, rows = 9;  ///< cells of the output, as in FlowField
  int pitch_px = 8;            ///< between photoreceptors, 2 ... 64; each averages pitch x pitch pixels
  float delay_frames = 1.f;    ///< time constant of the delay, > 0
  float mean_frames = 20.f;    ///< time constant of the mean's removal, > delay_frames
};

/// Response of a cell, averaged over its correlators [grey^2].
struct EmdCell {
  float right = 0, down = 0;
  float contrast = 0;  ///< mean square of the signals, mean removed [grey^2]: right / contrast is free of contrast
};

struct EmdField {
  bool valid = false;  ///< false until two frames were seen, and for a bad frame
  int columns = 0, rows = 0;
  std::array<EmdCell, FlowField::kMaxColumns * FlowField::kMaxRows> cells{};
};

/// Vertical correlators that fire, by row of the lattice: correlator row r looks at the border of lattice rows r and
/// r + 1, image row (r + 1) * pitch - 0.5. An edge detector that needs motion (thesis 8.1.3), as a row histogram.
struct EmdRows {
  static constexpr int kMax = 512;
  int rows = 0;  ///< correlator rows; 0 until two frames were seen
  int pitch_px = 0;
  int columns = 0;         ///< correlators in a row
  float threshold = 0;     ///< |response| from which one fires [grey^2]
  std::int64_t total = 0;  ///< how many fire
  std::array<std::int32_t, kMax> count{};
};

class EmdGrid {
 public:
  /// Takes all memory. Throws std::invalid_argument for parameters out of range, or when a cell would hold fewer than
  /// 2 x 2 photoreceptors.
  EmdGrid(int width_px, int height_px, const EmdParams& params);

  /// The next frame, mono8 of the constructor's size; frames must come at a constant rate. A bad view leaves the state
  /// alone and gives an invalid field. Time depends on sizes only. Realtime-safe: yes.
  void step(const GrayView& image, EmdField& out) WASP_REALTIME;

  /// Which vertical correlators fire after the frames so far: |response| at least its RMS over the lattice, the
  /// threshold of (7.33) carried over, and at least `min_response` [grey^2]. No rows when the lattice is higher than
  /// EmdRows::kMax. Realtime-safe: yes.
  void fire(float min_response, EmdRows& out) const WASP_REALTIME;

  /// Forgets all frames. Realtime-safe: yes.
  void reset() WASP_REALTIME { frames_ = 0; }

 private:
  struct Receptor {
    float mean = 0, signal = 0, delayed = 0;
  };
  [[nodiscard]] const Receptor& at(int column, int row) const WASP_REALTIME {
    return receptors_[static_cast<std::size_t>(row * across_ + column)];
  }
  [[nodiscard]] float down(int column, int row) const WASP_REALTIME {
    const Receptor &a = at(column, row), &below = at(column, row + 1);
    return a.delayed * below.signal - a.signal * below.delayed;
  }
  void see(const GrayView& image) WASP_REALTIME;
  void correlate(EmdField& out) const WASP_REALTIME;

  EmdParams params_;
  int width_px_, height_px_, across_, down_;
  int frames_ = 0;
  float delay_gain_, mean_gain_;
  std::vector<Receptor> receptors_;
};

}  // namespace wasp::vision
