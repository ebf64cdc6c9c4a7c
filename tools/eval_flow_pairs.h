// Pairs of frames with the flow between them, pixel by pixel: read from a folder with a ground-truth flow (flow<N>.flo
// with frames N and N + 1, or flow_noc_<name>_10.png as KITTI has it), or made by moving one image by a known warp.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "drivers/image_file.h"

namespace wasp::tools {

/// Flow by pixel, row-major [px]; known is 0 where there is none.
struct DenseFlow {
  int width_px = 0, height_px = 0;
  std::vector<float> u, v;
  std::vector<std::uint8_t> known;
};

struct FlowPair {
  std::string name;
  drivers::Image<std::uint8_t> first, second;
  DenseFlow truth;
};

/// All pairs of a folder; none where it has no flow file. Throws std::runtime_error naming the file for a damaged one,
/// and for frames that are missing. KITTI's 16-bit colour files need OpenCV at build time.
std::vector<FlowPair> read_flow_pairs(const std::filesystem::path& folder);

/// A still image by its name.
struct NamedImage {
  std::string name;
  drivers::Image<std::uint8_t> image;
};

/// The 8-bit PNG files of a folder, of those that differ in a trailing number alone the first. Throws
/// std::runtime_error where there is none.
std::vector<NamedImage> read_still_images(const std::filesystem::path& folder);

/// Index of the known pixel nearest to (u, v), at most 3 px away in each direction.
std::optional<std::size_t> nearest_known(const DenseFlow& flow, double u_px, double v_px);

/// Whole-image motion about the centre: x goes to centre + zoom R(turn) (x - centre) + shift; both frames get noise.
struct FlowWarp {
  const char* name;
  double shift_u, shift_v, zoom, turn_deg, noise_gray;
};
inline constexpr std::array kFlowWarps = {
    FlowWarp{"shift_0.5", 0.5, 0.3, 1, 0, 0}, FlowWarp{"shift_3", 2.7, -1.3, 1, 0, 0},
    FlowWarp{"shift_10", 9.4, 4.2, 1, 0, 0},  FlowWarp{"shift_20", 20.3, -12.6, 1, 0, 0},
    FlowWarp{"zoom_1.01", 0, 0, 1.01, 0, 0},  FlowWarp{"zoom_1.03", 0, 0, 1.03, 0, 0},
    FlowWarp{"zoom_0.96", 0, 0, 0.96, 0, 0},  FlowWarp{"turn_1", 0, 0, 1, 1, 0},
    FlowWarp{"turn_3", 0, 0, 1, 3, 0},        FlowWarp{"noise_3", 2.7, -1.3, 1, 0, 3},
    FlowWarp{"noise_8", 2.7, -1.3, 1, 0, 8},  FlowWarp{"noise_8_zoom_turn", 1.5, 0.7, 1.03, 1, 8},
};

/// The image as it is and moved (Catmull-Rom interpolation, seeded noise). Truth is known where the target is inside.
FlowPair make_flow_pair(const drivers::Image<std::uint8_t>& image, const FlowWarp& warp);

}  // namespace wasp::tools
