// Still images on disk: PNG (through libpng) and binary PGM. Grey only, because that is all a behaviour looks at:
// 8 bit for intensity, 16 bit for depth. Colour is reduced to grey while loading.
// Realtime-safe: no. Everything here throws std::runtime_error naming the file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "types/image_view.h"

namespace wasp::drivers {

/// An owned image, row-major without padding.
template <class T>
struct Image {
  int width_px = 0, height_px = 0;
  std::vector<T> pixels;  ///< width_px * height_px

  [[nodiscard]] ImageView<T> view() const noexcept { return {pixels.data(), width_px, height_px, width_px}; }
};

/// What a file's header says.
struct ImageInfo {
  int width_px = 0, height_px = 0;  ///< 1 ... kMaxImageSide
  int bits = 8;                     ///< per sample: 8 or 16 (fewer count as 8)
  bool colour = false;
};
inline constexpr int kMaxImageSide = 16384;

/// Header only, plus the cheap test that the file is whole (PNG: end chunk; PGM: size). Throws std::runtime_error.
ImageInfo probe_image(const std::filesystem::path& file);

/// 8-bit intensity from PNG (grey, palette, RGB, 16 bit reduced) or PGM with maxval <= 255.
Image<std::uint8_t> load_gray8(const std::filesystem::path& file);

/// 16-bit samples as stored, from a 16-bit grey PNG or a PGM with maxval > 255 (big endian on disk, native here).
Image<std::uint16_t> load_gray16(const std::filesystem::path& file);

/// Writes a grey PNG. `compression_level` 0 (none) ... 9 (smallest); 1 is what a recorder can keep up with.
void save_png(const std::filesystem::path& file, const GrayView& image, int compression_level = 1);
void save_png(const std::filesystem::path& file, const DepthView& image, int compression_level = 1);

}  // namespace wasp::drivers
