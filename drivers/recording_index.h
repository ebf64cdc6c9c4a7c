// The text files beside recorded frames: "<seconds> <file>" indexes (TUM RGB-D and wasp's own) and camera.toml.
#pragma once

#include <functional>
#include <string_view>

#include "drivers/recording_layouts.h"

namespace wasp::drivers {

/// Reads an index file: one "<seconds> <file>" a line, '#' starts a comment. `is_depth` says which of the two file
/// fields is set. Lines that cannot be read are problems; so are those whose time does not rise, and they are left out.
/// `comment`, if given, gets the comments.
std::vector<ListedFrame> read_index(const std::filesystem::path& index, bool is_depth, RecordingProblems& problems,
                                    const std::function<void(std::string_view)>& comment = {});

/// Joins depth and grey frames where each is the nearest to the other in time and they are at most `tolerance_ns`
/// apart, as TUM's associate.py does; all others stand alone. Both lists rise in time, and so does the result.
std::vector<ListedFrame> pair_frames(const std::vector<ListedFrame>& depth, const std::vector<ListedFrame>& gray,
                                     DurationNs tolerance_ns);

/// Applies camera.toml to `listing`. Keys: width_px, height_px, fx_px, fy_px, cx_px, cy_px, k1, k2, p1, p2, k3, lens,
/// fisheye_k, pitch_down_deg, depth_units_per_m, rate_hz, position_body_m. Throws on syntax errors, unknown keys and
/// values out of range.
void read_camera_toml(const std::filesystem::path& file, Listing& listing);

}  // namespace wasp::drivers
