// A non-owning look at pixels: row-major, `stride` elements from one row to the next.
#pragma once

#include <cstddef>
#include <cstdint>

namespace wasp {

/// Shape: height rows x width columns, row 0 on top. `T` is uint8_t (mono8) or uint16_t (depth, millimetres, 0 =
/// invalid).
template <class T>
struct ImageView {
  const T* data = nullptr;
  int width_px = 0;
  int height_px = 0;
  int stride_px = 0;  ///< elements (not bytes) between rows, >= width_px

  [[nodiscard]] const T* row(int v) const noexcept { return data + static_cast<std::ptrdiff_t>(v) * stride_px; }
  /// False for null data, non-positive size, or a stride shorter than a row.
  [[nodiscard]] bool valid() const noexcept {
    return data != nullptr && width_px > 0 && height_px > 0 && stride_px >= width_px;
  }
};

using GrayView = ImageView<std::uint8_t>;
using DepthView = ImageView<std::uint16_t>;

}  // namespace wasp
