// The layouts a recording folder may have, as one table: how to recognise it, how to list its frames.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "types/camera.h"
#include "types/time.h"

namespace wasp::drivers {

/// One file named by a recording, before any check. `origin` is where it was named, for messages ("depth.txt:7").
struct ListedFrame {
  TimeNs time_ns = 0;
  std::uint32_t sequence = 0;
  std::filesystem::path depth_file, gray_file;
  std::string origin;
};

/// What a layout says about a folder.
struct Listing {
  std::string layout{};
  std::vector<ListedFrame> frames{};    ///< in the order of the recording
  std::vector<std::string> problems{};  ///< lines that could not be read
  Intrinsics intrinsics{};              ///< for 640x480 unless the layout says otherwise
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
