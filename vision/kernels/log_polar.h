// The log-polar transform: rotation about the fovea becomes a shift of rows, scaling a shift of columns (exactly so for
// kappa = 0). rho = M log(r + kappa), phi = atan2(y - o_y, x - o_x) (5.4, 5.5); by default kappa = 1 and
// M = rho_max / log(r_max + 1), so that the extremes of the image meet the extremes of the map (D.14-D.16).
// The tables are made once, for one image size and one fovea; the transform itself is log_polar_remap.h.
#pragma once

#include <cstdint>
#include <vector>

#include "types/realtime.h"
#include "vision/kernels/log_polar_remap.h"

namespace wasp::vision {

/// How far out the map reaches: to the farthest corner (all of the image, part of the map outside it), or to the
/// nearest border (all of the map inside the image).
enum class LogPolarReach : std::uint8_t { kFarthestCorner, kNearestBorder };

struct LogPolarParams {
  int angles = 256;   ///< N_phi, rows of the map, 8 ... 4096; row 0 looks along +x, rows turn towards +y
  int radii = 256;    ///< N_rho, columns of the map, 8 ... 4096
  float kappa = 1.f;  ///< 0 ... 1; the map starts at r = 1 - kappa
  LogPolarReach reach = LogPolarReach::kNearestBorder;
};

/// The mapping between image points and map points; no memory of its own.
struct LogPolarGeometry {
  float fovea_x_px = 0, fovea_y_px = 0;
  float kappa = 1.f;
  float scale_M = 0;   ///< M [columns per unit of log r]
  float r_max_px = 0;  ///< radius of the last column
  int angles = 0, radii = 0;

  struct ImagePoint {
    float x_px, y_px;
  };
  struct MapPoint {
    float rho;  ///< column, 0 ... radii - 1 inside the map
    float phi;  ///< row, 0 <= phi < angles
  };
  /// (5.4). The fovea itself has phi = 0. Realtime-safe: yes.
  [[nodiscard]] MapPoint to_map(ImagePoint p) const WASP_REALTIME;
  /// (D.14). Realtime-safe: yes.
  [[nodiscard]] ImagePoint to_image(MapPoint p) const WASP_REALTIME;
  [[nodiscard]] float rho_of(float r_px) const
      WASP_REALTIME;  ///< M log(r + kappa); r is limited to the map's first column
  [[nodiscard]] float radius_of(float rho) const WASP_REALTIME;  ///< e^(rho / M) - kappa
  [[nodiscard]] float rad_per_row() const WASP_REALTIME;         ///< 2 pi / N_phi
  /// Scale s of the image from a shift of columns: e^(delta / M), exact for kappa = 0.
  [[nodiscard]] float scale_of(float delta_rho) const WASP_REALTIME;
};

/// Geometry for an image of this size with the fovea at (x, y), which is moved into the image, one pixel from its
/// border, when it lies outside: an expansion centre outside the image still gets the nearest usable map. A fovea that
/// is no number becomes the image centre. Realtime-safe: yes.
LogPolarGeometry log_polar_geometry(const LogPolarParams& params, int width_px, int height_px, float fovea_x_px,
                                    float fovea_y_px) WASP_REALTIME;

/// Tables for both directions. Copying copies the tables.
class LogPolarMap {
 public:
  LogPolarMap() = default;
  /// Makes the tables for images of exactly this width, height and stride. Throws std::invalid_argument for
  /// parameters out of range or an image larger than kRemapMaxSize. Realtime-safe: no.
  LogPolarMap(const LogPolarParams& params, int width_px, int height_px, int stride_px, float fovea_x_px,
              float fovea_y_px);

  [[nodiscard]] const LogPolarGeometry& geometry() const WASP_REALTIME { return geometry_; }
  /// Columns of row `angle` that lie inside the image: 0 ... n-1. Realtime-safe: yes.
  [[nodiscard]] int columns_inside(int angle) const WASP_REALTIME {
    return forward_.rows[static_cast<std::size_t>(angle)].end;
  }
  [[nodiscard]] const RemapTable& forward_table() const WASP_REALTIME { return forward_; }

  /// Image to map: `map` has angles x radii bytes, densely packed; outside the image it is 0. False (nothing written)
  /// for an image of another size or stride, null `map`, or an empty LogPolarMap. Realtime-safe: yes.
  bool transform(const GrayView& image, std::uint8_t* map) const WASP_REALTIME;
  /// Map to image: `image` has height rows of `stride` >= width. Beyond the map's reach it is 0. Realtime-safe: yes
  /// (not const: it keeps a copy of the map with its first row repeated at the end, where phi wraps).
  bool inverse(const std::uint8_t* map, std::uint8_t* image, int stride_px) WASP_REALTIME;

 private:
  void fill_forward();
  void fill_backward(int width_px, int height_px);

  LogPolarGeometry geometry_;
  RemapTable forward_, backward_;
  std::vector<std::uint8_t> wrapped_;
};

}  // namespace wasp::vision
