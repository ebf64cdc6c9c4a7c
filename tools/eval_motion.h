// What the evaluations of motion kernels share: the grey frames of a sequence, tables of numbers beside them, and the
// flow grid over a window of two frames.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "drivers/recording.h"
#include "types/image_view.h"
#include "vision/kernels/flow_grid.h"

namespace wasp::tools {

/// A grey frame in memory and its number.
struct MotionFrame {
  long number = 0;
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> pixels;
  [[nodiscard]] GrayView view() const { return {pixels.data(), width_px, height_px, width_px}; }
};

/// The largest set of 8-bit PNGs in the folder that share name prefix and size, by rising number. Throws
/// std::runtime_error when there are fewer than two.
std::vector<MotionFrame> read_sequence(const std::filesystem::path& folder);

/// Rows of numbers by the first column, columns by name; empty when there is no such file. Throws std::runtime_error
/// with file and line for a damaged one.
using NumberTable = std::map<long, std::map<std::string, double>>;
NumberTable read_numbers(const std::filesystem::path& file);

/// A rectangle of an image.
struct Window {
  int x = 0, y = 0, width = 0, height = 0;
  [[nodiscard]] GrayView of(const GrayView& image) const { return {image.row(y) + x, width, height, image.stride_px}; }
};

/// The flow grid over windows of one size; cells come out in pixels of the whole image.
class WindowFlow {
 public:
  /// Throws std::invalid_argument for a window too small for the grid.
  WindowFlow(int width_px, int height_px, const vision::FlowGridParams& params = {});
  /// Both windows are `window`, which must have the size of the constructor and lie inside both images.
  const vision::FlowField& track(const MotionFrame& first, const MotionFrame& second, const Window& window);

 private:
  vision::FlowGrid grid_;
  vision::FlowField field_;
};

}  // namespace wasp::tools
