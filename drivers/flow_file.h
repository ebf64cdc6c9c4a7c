// Dense optical flow on disk, Middlebury's .flo: the float 202021.25 ("PIEH"), width, height, then u and v of every pixel
// row by row, all little-endian; beyond 1e9 a value means "not known". Baker et al., IJCV 2011.
// Realtime-safe: no. Everything throws std::runtime_error naming the file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace wasp::drivers {

struct FlowFileInfo {
  int width_px = 0, height_px = 0;  ///< 1 ... kMaxImageSide
};

/// Pixels per frame, u right and v down, row-major.
struct FlowImage {
  int width_px = 0, height_px = 0;
  std::vector<float> u_px, v_px;
  std::vector<std::uint8_t> known;  ///< 1 where both are numbers that mean something
};

/// The header, and that the file is exactly as long as it says.
FlowFileInfo probe_flow(const std::filesystem::path& file);
FlowImage load_flow(const std::filesystem::path& file);

}  // namespace wasp::drivers
