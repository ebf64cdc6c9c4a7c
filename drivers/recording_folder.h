// What the layouts share: names in a folder, numbers in names, and the small building blocks of a listing.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "drivers/recording_layouts.h"

namespace wasp::drivers {

using Names = std::vector<std::string>;  ///< of the regular files in a folder, sorted

Names file_names(const std::filesystem::path& folder);
bool contains(const Names& names, const std::string& name);
/// Sub-folders, sorted.
Names folder_names(const std::filesystem::path& folder);

/// Files matching prefix + digits + suffix, by number. `prefix` may be empty.
std::map<std::uint32_t, std::string> numbered(const Names& names, const std::string& prefix, const std::string& suffix);
/// The number a file name ends in before its extensions ("frame-000060.depth.png" -> 60), if it ends in one.
std::optional<std::uint32_t> trailing_number(const std::filesystem::path& file);

Intrinsics pinhole(int width_px, int height_px, float fx_px, float fy_px, float cx_px, float cy_px);
/// Size and centre of an image; its focal length stays what it was. A file that is no good changes nothing.
void assume_centred(const std::filesystem::path& file, Listing& listing);

/// `index` periods after zero.
TimeNs at_rate(std::uint32_t index, double rate_hz);

/// Leaves out frames whose time does not rise, and says which by their `origin`.
void drop_unordered(std::vector<ListedFrame>& frames, RecordingProblems& problems);

/// Images (.png) that lie in `folder` and that no frame names: told and counted.
void tell_unlisted(const std::filesystem::path& folder, const std::vector<ListedFrame>& frames,
                   RecordingProblems& problems);

// The layouts with a file of their own; recording_layouts.cpp has the table.
std::optional<Listing> list_tum(const std::filesystem::path& folder, const Names& names);
std::optional<Listing> list_7scenes(const std::filesystem::path& folder, const Names& names);
std::optional<Listing> list_asl(const std::filesystem::path& folder, const Names& names);
std::optional<Listing> list_rawseeds(const std::filesystem::path& folder, const Names& names);
std::optional<Listing> list_hover(const std::filesystem::path& folder, const Names& names);
std::optional<Listing> list_hover_clips(const std::filesystem::path& folder, const Names& names);

}  // namespace wasp::drivers
