// The layouts a recording folder may have, as one table: how to recognise it, how to list its frames.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "drivers/recording_motion.h"
#include "drivers/recording_problems.h"
#include "types/camera.h"
#include "types/time.h"

namespace wasp::drivers {

/// One file named by a recording, before any check. `origin` is where it was named, for messages ("depth.txt:7").
struct ListedFrame {
  TimeNs time_ns = 0;
  std::uint32_t sequence = 0;
  std::filesystem::path depth_file, gray_file;
  std::string origin;
  /// The instant the recorder stamped it with, where `time_ns` is a better one; else the same.
  std::optional<TimeNs> stamped_ns{};

  [[nodiscard]] const std::filesystem::path& any_file() const { return depth_file.empty() ? gray_file : depth_file; }
};

/// What a layout says about a folder.
struct Listing {
  std::string layout{};
  std::vector<ListedFrame> frames{};  ///< in the order of the recording
  RecordingProblems problems{};       ///< with the listing; those with the images come on top
  RecordingMotion motion{};
  std::vector<std::filesystem::path> true_flows{};  ///< .flo files
  std::vector<std::string> notes{};  ///< what was assumed, and what lies there and is not read
  Intrinsics intrinsics{};           ///< for 640x480 unless the layout says otherwise
  LensKind lens_kind = LensKind::kPinhole;
  std::array<float, 4> fisheye_k{};
  std::optional<Radians> pitch_down{};
  Vec3 position_body_m = Vec3::Zero();
  double nominal_rate_hz = 30.0;
  double depth_units_per_m = 1000.0;
};

/// Lists `folder` by the first layout that recognises it. Throws std::runtime_error naming the folder.
Listing list_recording(const std::filesystem::path& folder);

}  // namespace wasp::drivers
