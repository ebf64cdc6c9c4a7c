// A folder of recorded frames as one list of entries in time order, whatever its layout. The layout is found from
// what the folder contains, never from its name; see drivers/recording_layouts.cpp for the table of layouts.
// Realtime-safe: no. Errors are std::runtime_error naming the file (and line); a bad entry among good ones is
// skipped, counted and reported in problems().
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/recording_motion.h"
#include "drivers/recording_problems.h"
#include "types/camera.h"
#include "types/time.h"

namespace wasp::drivers {

/// One instant: a depth frame, a grey frame, or both.
struct RecordingEntry {
  DurationNs offset_ns = 0;  ///< since the first entry; strictly rising
  std::uint32_t sequence = 0;
  std::filesystem::path depth_file, gray_file;  ///< empty when the entry has none
  TimeNs stamped_ns = 0;  ///< by the recorder, in the clock of motion(); a layout may know a better time for the offset

  [[nodiscard]] bool has_depth() const { return !depth_file.empty(); }
  [[nodiscard]] bool has_gray() const { return !gray_file.empty(); }
};

class Recording {
 public:
  /// Opens a folder. Throws when it is missing, of no known layout, or holds no usable frame.
  static Recording open(const std::filesystem::path& folder);

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] const std::string& layout() const { return layout_; }  ///< e.g. "7scenes", "tum"
  [[nodiscard]] const std::vector<RecordingEntry>& entries() const { return entries_; }
  [[nodiscard]] double nominal_rate_hz() const { return nominal_rate_hz_; }
  [[nodiscard]] const Intrinsics& intrinsics() const { return geometry_.intrinsics; }
  /// Camera tilt below the body's nose, where the recording says; otherwise unknown.
  [[nodiscard]] std::optional<Radians> pitch_down() const { return pitch_down_; }
  /// Intrinsics, mount and lever arm; an unknown mount counts as kAssumedPitchDown.
  [[nodiscard]] const CameraGeometry& geometry() const { return geometry_; }
  /// What was skipped and why: missing, truncated, out of order, of another size. Lines of a kind in a file beyond the
  /// first twenty are told as a number.
  [[nodiscard]] std::vector<std::string> problems() const { return problems_.lines(); }
  [[nodiscard]] const RecordingProblems& problem_counts() const { return problems_; }
  /// Inertial samples and poses beside the frames; empty streams where there are none.
  [[nodiscard]] const RecordingMotion& motion() const { return motion_; }
  /// Instant of the first entry in the clock of motion().
  [[nodiscard]] TimeNs begins_at_ns() const { return begins_at_ns_; }
  [[nodiscard]] TimeNs time_ns(const RecordingEntry& entry) const { return begins_at_ns_ + entry.offset_ns; }
  /// What was assumed where the recording is silent.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
  /// Dense true flow beside the frames (.flo).
  [[nodiscard]] const std::vector<std::filesystem::path>& true_flows() const { return true_flows_; }

  /// Pixel size shared by all depth (grey) files; 0 x 0 when there are none.
  struct Size {
    int width_px = 0, height_px = 0;
    [[nodiscard]] std::size_t pixels() const {
      return static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
    }
    friend bool operator==(const Size&, const Size&) = default;
  };
  [[nodiscard]] Size depth_size() const { return depth_size_; }
  [[nodiscard]] Size gray_size() const { return gray_size_; }

  /// Fills `pixels_mm` (exactly depth_size().pixels()) with millimetres, 0 = invalid. Throws std::runtime_error when
  /// the entry has no depth or the file is damaged, std::out_of_range for a bad index.
  void load_depth(std::size_t index, std::span<std::uint16_t> pixels_mm) const;
  /// Fills `pixels` (exactly gray_size().pixels()) with intensity; throws like load_depth.
  void load_gray(std::size_t index, std::span<std::uint8_t> pixels) const;

 private:
  friend struct RecordingBuilder;
  std::filesystem::path folder_;
  std::string layout_;
  std::vector<RecordingEntry> entries_;
  RecordingProblems problems_;
  RecordingMotion motion_;
  TimeNs begins_at_ns_ = 0;
  std::vector<std::string> notes_;
  std::vector<std::filesystem::path> true_flows_;
  CameraGeometry geometry_;
  std::optional<Radians> pitch_down_;
  double nominal_rate_hz_ = 30.0;
  double depth_units_per_m_ = 1000.0;
  Size depth_size_, gray_size_;
};

/// What an unknown mount counts as: hand-held and vehicle depth cameras that see a floor look somewhat down.
inline constexpr Radians kAssumedPitchDown{0.5236};

}  // namespace wasp::drivers
