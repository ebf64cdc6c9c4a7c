// The text files beside recorded frames: "<seconds> <file>" indexes (TUM RGB-D and wasp's own) and camera.toml.
#pragma once

#include "drivers/recording_layouts.h"

namespace wasp::drivers {

/// Reads an index file: one "<seconds> <file>" a line, '#' starts a comment. Lines that cannot be read are added to
/// `problems` as "<file>:<line>: ...". `is_depth` says which of the two file fields is set.
std::vector<ListedFrame> read_index(const std::filesystem::path& index, bool is_depth,
                                    std::vector<std::string>& problems);

/// Joins depth and grey frames that were exposed at most `tolerance_ns` apart; both lists in time order.
std::vector<ListedFrame> pair_frames(const std::vector<ListedFrame>& depth, const std::vector<ListedFrame>& gray,
                                     DurationNs tolerance_ns);

/// Applies camera.toml to `listing`. Keys: width_px, height_px, fx_px, fy_px, cx_px, cy_px, k1, k2, p1, p2, k3, lens,
/// fisheye_k, pitch_down_deg, depth_units_per_m, rate_hz, position_body_m. Throws on syntax errors, unknown keys and
/// values out of range.
void read_camera_toml(const std::filesystem::path& file, Listing& listing);

/// The number a file name ends in before its extensions ("frame-000060.depth.png" -> 60), if it ends in one.
std::optional<std::uint32_t> trailing_number(const std::filesystem::path& file);

}  // namespace wasp::drivers
