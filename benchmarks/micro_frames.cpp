// wasp bench micro, frames: what it costs a behaviour to know that an image is a new one, for the images of a VGA
// camera, in the cache and fetched from memory.
#include <benchmark/benchmark.h>

#include <random>
#include <vector>

#include "scheduling/image_hash.h"

namespace wasp::bench {
namespace {

/// `images` in turn: with one it stays in the cache, with many each comes from memory.
template <class T>
void hash_vga(benchmark::State& state, std::size_t images) {
  constexpr int kWidth = 640, kHeight = 480;
  constexpr std::size_t kPixels = kWidth * kHeight;
  std::vector<T> pixels(images * kPixels);
  std::mt19937 random(1);
  for (T& p : pixels) p = static_cast<T>(random());
  std::size_t n = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        scheduling::image_hash(ImageView<T>{pixels.data() + n * kPixels, kWidth, kHeight, kWidth}));
    n = (n + 1) % images;
  }
}

void image_hash_gray_cached(benchmark::State& state) { hash_vga<std::uint8_t>(state, 1); }
void image_hash_gray_from_memory(benchmark::State& state) { hash_vga<std::uint8_t>(state, 512); }
void image_hash_depth_from_memory(benchmark::State& state) { hash_vga<std::uint16_t>(state, 256); }
BENCHMARK(image_hash_gray_cached);
BENCHMARK(image_hash_gray_from_memory);
BENCHMARK(image_hash_depth_from_memory);

}  // namespace
}  // namespace wasp::bench
