#include "scheduling/frame_faults.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace wasp::scheduling {
namespace {

template <class T>
Pixels<T> pixels_of(std::byte* frame, std::uint64_t bytes, PixelFormat format) WASP_REALTIME {
  FrameHeader h;
  if (bytes < kFramePixelOffset) return {};
  std::memcpy(&h, frame, sizeof h);
  const bool fits = h.format == format && h.width_px > 0 && h.height_px > 0 && h.width_px <= 16384 &&
                    h.height_px <= 16384 && h.stride_bytes >= h.width_px * sizeof(T) &&
                    h.stride_bytes % sizeof(T) == 0 &&
                    static_cast<std::uint64_t>(h.stride_bytes) * h.height_px <= bytes - kFramePixelOffset;
  if (!fits) return {};
  return {reinterpret_cast<T*>(frame + kFramePixelOffset), static_cast<int>(h.width_px), static_cast<int>(h.height_px),
          static_cast<int>(h.stride_bytes / sizeof(T))};
}

/// Calls `change` for each pixel, which gives its new value.
template <class T, class Change>
void each_pixel(const Pixels<T>& image, Change&& change) WASP_REALTIME {
  for (int v = 0; v < image.height_px; ++v) {
    T* row = image.row(v);
    for (int u = 0; u < image.width_px; ++u) row[u] = change(row[u]);
  }
}

std::uint8_t to_gray(float level) WASP_REALTIME { return static_cast<std::uint8_t>(std::clamp(level, 0.f, 255.f)); }
/// Never a hole.
std::uint16_t to_depth(float depth_mm) WASP_REALTIME {
  return static_cast<std::uint16_t>(std::clamp(depth_mm, 1.f, 65535.f));
}

/// Near enough normal: the sum of four uniform bytes, mean 0, standard deviation 1. Two of them a draw.
class Noise {
 public:
  explicit Noise(FaultRandom& random) WASP_REALTIME : random_(random) {}
  float next() WASP_REALTIME {
    constexpr float kMean = 510.f, kSigma = 147.8006f;  // sqrt(4 (256^2 - 1) / 12)
    if (left_ == 0) bits_ = random_.next(), left_ = 2;
    const auto sum = static_cast<float>((bits_ & 255) + (bits_ >> 8 & 255) + (bits_ >> 16 & 255) + (bits_ >> 24 & 255));
    bits_ >>= 32;
    --left_;
    return (sum - kMean) / kSigma;
  }

 private:
  FaultRandom& random_;
  std::uint64_t bits_ = 0;
  int left_ = 0;
};

int rows_of(const GrayPixels& image, float share) WASP_REALTIME {
  return std::clamp(static_cast<int>(share * static_cast<float>(image.height_px) + 0.5f), 0, image.height_px);
}

/// Running mean along one row, out of `from` into `to`.
void blur_row(const std::uint8_t* from, std::uint8_t* to, int width, int radius) WASP_REALTIME {
  std::uint32_t sum = 0;
  int count = 0;
  for (int u = 0; u < std::min(radius, width); ++u) sum += from[u], ++count;
  for (int u = 0; u < width; ++u) {
    if (u + radius < width) sum += from[u + radius], ++count;
    to[u] = static_cast<std::uint8_t>(sum / static_cast<std::uint32_t>(count));
    if (u - radius >= 0) sum -= from[u - radius], --count;
  }
}

}  // namespace

GrayPixels gray_pixels(std::byte* frame, std::uint64_t bytes) WASP_REALTIME {
  return pixels_of<std::uint8_t>(frame, bytes, PixelFormat::kMono8);
}
DepthPixels depth_pixels(std::byte* frame, std::uint64_t bytes) WASP_REALTIME {
  return pixels_of<std::uint16_t>(frame, bytes, PixelFormat::kDepth16Mm);
}

void fill_gray(const GrayPixels& image, float level) WASP_REALTIME {
  each_pixel(image, [value = to_gray(level)](std::uint8_t) WASP_REALTIME { return value; });
}

void blur_gray(const GrayPixels& image, int radius_px, std::span<std::uint8_t> scratch,
               std::span<std::uint32_t> columns) WASP_REALTIME {
  const int w = image.width_px, h = image.height_px;
  if (scratch.size() < static_cast<std::size_t>(w) * static_cast<std::size_t>(h) ||
      columns.size() < static_cast<std::size_t>(w) || radius_px < 1)
    return;
  const auto line = [&](int v) WASP_REALTIME { return scratch.data() + static_cast<std::ptrdiff_t>(v) * w; };
  for (int v = 0; v < h; ++v) blur_row(image.row(v), line(v), w, radius_px);
  std::fill_n(columns.data(), w, 0u);
  std::uint32_t count = 0;
  const auto move = [&](int v, bool in) WASP_REALTIME {
    const std::uint8_t* row = line(v);
    for (int u = 0; u < w; ++u) columns[static_cast<std::size_t>(u)] += in ? row[u] : 0u - row[u];
    count += in ? 1u : 0u - 1u;
  };
  for (int v = 0; v < std::min(radius_px, h); ++v) move(v, true);
  for (int v = 0; v < h; ++v) {
    if (v + radius_px < h) move(v + radius_px, true);
    std::uint8_t* row = image.row(v);
    for (int u = 0; u < w; ++u) row[u] = static_cast<std::uint8_t>(columns[static_cast<std::size_t>(u)] / count);
    if (v - radius_px >= 0) move(v - radius_px, false);
  }
}

void add_noise(const GrayPixels& image, float sigma, FaultRandom& random) WASP_REALTIME {
  Noise noise(random);
  each_pixel(image, [&](std::uint8_t x)
                        WASP_REALTIME { return to_gray(static_cast<float>(x) + sigma * noise.next() + 0.5f); });
}

void kill_band(const GrayPixels& image, float share) WASP_REALTIME {
  const int rows = rows_of(image, share), first = (image.height_px - rows) / 2;
  for (int v = first; v < first + rows; ++v) std::fill_n(image.row(v), image.width_px, std::uint8_t{0});
}

void tear(const GrayPixels& image, const GrayPixels& before, float share) WASP_REALTIME {
  if (before.width_px != image.width_px || before.height_px != image.height_px) return;
  for (int v = rows_of(image, share); v < image.height_px; ++v)
    std::copy_n(before.row(v), image.width_px, image.row(v));
}

void multiply(const GrayPixels& image, float gain) WASP_REALTIME {
  each_pixel(image, [gain](std::uint8_t x) WASP_REALTIME { return to_gray(gain * static_cast<float>(x)); });
}

void make_holes(const DepthPixels& image, float share, FaultRandom& random) WASP_REALTIME {
  constexpr int kBlock = 8;
  for (int v0 = 0; v0 < image.height_px; v0 += kBlock)
    for (int u0 = 0; u0 < image.width_px; u0 += kBlock) {
      if (!random.chance(share)) continue;
      const int width = std::min(kBlock, image.width_px - u0);
      for (int v = v0; v < std::min(v0 + kBlock, image.height_px); ++v)
        std::fill_n(image.row(v) + u0, width, std::uint16_t{0});
    }
}

void add_bias(const DepthPixels& image, float bias_mm) WASP_REALTIME {
  each_pixel(image, [bias_mm](std::uint16_t z)
                        WASP_REALTIME { return z == 0 ? z : to_depth(static_cast<float>(z) + bias_mm); });
}

void quantise(const DepthPixels& image, float step_mm) WASP_REALTIME {
  each_pixel(image, [step_mm](std::uint16_t z) WASP_REALTIME {
    return z == 0 ? z : to_depth(step_mm * std::floor(static_cast<float>(z) / step_mm + 0.5f));
  });
}

void add_noise(const DepthPixels& image, float sigma_mm, FaultRandom& random) WASP_REALTIME {
  Noise noise(random);
  each_pixel(image, [&](std::uint16_t z) WASP_REALTIME {
    return z == 0 ? z : to_depth(static_cast<float>(z) + sigma_mm * noise.next() + 0.5f);
  });
}

void fill_depth(const DepthPixels& image, float depth_mm, bool holes_too) WASP_REALTIME {
  each_pixel(image, [value = to_depth(depth_mm), holes_too](std::uint16_t z)
                        WASP_REALTIME { return z == 0 && !holes_too ? z : value; });
}

}  // namespace wasp::scheduling
