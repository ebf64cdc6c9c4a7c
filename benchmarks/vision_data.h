// Inputs of the vision benchmarks, all 640x480: made here (textured, flat, saturated, noise, checkerboard; depth scenes
// likewise) and, where the shared data folder lies beside the checkout, real ones.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "types/camera.h"
#include "types/image_view.h"

namespace wasp::bench {

inline constexpr int kVisionWidth = 640, kVisionHeight = 480;

template <class T>
struct VisionFrame {
  std::string name;
  bool real = false;
  std::vector<T> pixels;
  [[nodiscard]] ImageView<T> view() const { return {pixels.data(), kVisionWidth, kVisionHeight, kVisionWidth}; }
};
using GrayFrame = VisionFrame<std::uint8_t>;
using DepthFrame = VisionFrame<std::uint16_t>;

/// Two frames of one camera, a frame apart: indices into VisionData::gray.
struct GrayPair {
  int first, second;
};

struct VisionData {
  std::vector<GrayFrame> gray;
  std::vector<GrayPair> pairs;  ///< made: the same texture moved, noise and noise, flat and flat ...; real: successive
  std::vector<DepthFrame> depth;  ///< millimetres, 0 = invalid
  Intrinsics depth_intrinsics;    ///< of a first-generation Kinect: f 525, centre of the image
  std::string real_used;          ///< folders the real frames came from; empty if none were found

  template <class Frame>
  [[nodiscard]] static std::vector<std::string> names(const std::vector<Frame>& frames) {
    std::vector<std::string> all;
    for (const Frame& f : frames) all.push_back(f.name);
    return all;
  }
};

VisionData make_vision_data();

}  // namespace wasp::bench
