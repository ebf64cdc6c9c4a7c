// Resampling by a precomputed table, bilinear, in fixed point: a 32-bit source offset and two 7-bit fractions a pixel
// (cv::remap keeps 5). Pixels are fetched two at a time by plain loads, which were faster than vector gathers where
// measured; the blend runs in 16-bit lanes (Highway, instruction set chosen at run time).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "types/image_view.h"
#include "types/realtime.h"

namespace wasp::vision {

inline constexpr int kRemapFractionBits = 7;
inline constexpr int kRemapNearPixels = 16000;  ///< of the window: 32 kB on the stack while remapping
inline constexpr int kRemapMaxSize = 8192;      ///< of any width, height or stride

/// Where each output pixel comes from. Output rows are covered from `begin` to `end`; the rest is outside the source
/// and becomes 0.
struct RemapTable {
  struct Row {
    std::int32_t begin = 0, end = 0;
  };
  int width_px = 0, height_px = 0;                                      ///< of the output
  int source_width_px = 0, source_height_px = 0, source_stride_px = 0;  ///< of the input
  std::vector<std::uint32_t> offsets;    ///< of the upper left neighbour, row-major as the output
  std::vector<std::uint16_t> fractions;  ///< right (low byte) and down (high byte) of it, 0 ... 127
  std::vector<Row> rows;

  std::vector<Row> source_rows;  ///< what is read of each row of the source

  /// The first `columns` of every row come from a small window of the source about one point (a log-polar map has most
  /// of its columns near the fovea). There the window's rows are interleaved first, (pixel, pixel below), so that one
  /// load fetches all four neighbours.
  struct Near {
    int x_px = 0, y_px = 0, width_px = 0, height_px = 0;  ///< window
    int columns = 0;                                      ///< 0: none
    std::vector<std::uint16_t> offsets;                   ///< of the upper left neighbour in the window, row-major
  } near;

  /// Sizes an empty table (nothing covered). Throws std::invalid_argument for sizes below 2 x 2 or above
  /// kRemapMaxSize. Realtime-safe: no.
  void reset(int out_width_px, int out_height_px, int source_width, int source_height, int source_stride);
  /// Sets one output pixel to the source point (x, y), which is clamped to the source. Realtime-safe: no.
  void set(int column, int row, double x_px, double y_px);
  /// To be called once all pixels are set: finds what is read of the source, and the near columns, if there are any.
  /// Realtime-safe: no.
  void finish();
  /// Whether `source` is what the table was made for.
  [[nodiscard]] bool fits(const GrayView& source) const WASP_REALTIME;

 private:
  struct Corner {
    int x_px, y_px;
  };
  [[nodiscard]] Corner upper_left(std::size_t row, int column) const;
  void find_source_rows();
  void find_near();
};

/// Fills `out` (height_px rows of width_px, `out_stride` apart) from `source`. False, and nothing written, when the
/// source does not fit the table or `out` is null or its stride too short. Time depends on the covered area only.
/// Realtime-safe: yes.
bool remap(const RemapTable& table, const GrayView& source, std::uint8_t* out, int out_stride) WASP_REALTIME;

/// The same arithmetic without vectors, for tests: equal to the bit. Realtime-safe: yes.
bool remap_scalar(const RemapTable& table, const GrayView& source, std::uint8_t* out, int out_stride) WASP_REALTIME;

/// Name of the instruction set remap() runs with here ("AVX3_ZEN4", "NEON", ...).
const char* remap_target() WASP_REALTIME;

}  // namespace wasp::vision
