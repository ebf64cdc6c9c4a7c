// Takes the layout's listing, drops what cannot be used (and says why), and fixes size, geometry and time zero.
#include "drivers/recording.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "drivers/image_file.h"
#include "drivers/recording_layouts.h"

namespace wasp::drivers {
namespace {

namespace fs = std::filesystem;

/// Throws unless the file is whole and has the size of its predecessors.
void check_file(const fs::path& file, Recording::Size& size) {
  const ImageInfo info = probe_image(file);
  const Recording::Size found{info.width_px, info.height_px};
  if (size.width_px == 0) size = found;
  if (!(found == size))
    throw std::runtime_error(file.string() + ": " + std::to_string(found.width_px) + "x" +
                             std::to_string(found.height_px) + " pixels, the frames before it have " +
                             std::to_string(size.width_px) + "x" + std::to_string(size.height_px));
}

/// The same lens seen with another pixel count.
Intrinsics scaled(Intrinsics k, Recording::Size size) {
  const float su = static_cast<float>(size.width_px) / static_cast<float>(k.width_px);
  const float sv = static_cast<float>(size.height_px) / static_cast<float>(k.height_px);
  k.fx_px *= su, k.fy_px *= sv;
  k.cx_px = (k.cx_px + 0.5f) * su - 0.5f, k.cy_px = (k.cy_px + 0.5f) * sv - 0.5f;
  k.width_px = size.width_px, k.height_px = size.height_px;
  return k;
}

template <class T>
void copy_pixels(const Image<T>& image, std::span<T> out, const fs::path& file) {
  if (image.pixels.size() != out.size())
    throw std::runtime_error(file.string() + ": " + std::to_string(image.pixels.size()) +
                             " pixels do not fit a buffer of " + std::to_string(out.size()));
  std::copy(image.pixels.begin(), image.pixels.end(), out.begin());
}

}  // namespace

struct RecordingBuilder {
  Recording recording;

  void add(const ListedFrame& frame, TimeNs& first_ns) {
    const fs::path& any = frame.depth_file.empty() ? frame.gray_file : frame.depth_file;
    auto& entries = recording.entries_;
    if (entries.empty()) first_ns = frame.time_ns;
    const DurationNs offset_ns = frame.time_ns - first_ns;
    if (!entries.empty() && offset_ns <= entries.back().offset_ns)
      throw std::runtime_error(any.string() + ": its time is not after the frame before it");
    if (!frame.depth_file.empty()) check_file(frame.depth_file, recording.depth_size_);
    if (!frame.gray_file.empty()) check_file(frame.gray_file, recording.gray_size_);
    entries.push_back({offset_ns, frame.sequence, frame.depth_file, frame.gray_file});
  }

  void add_all(const std::vector<ListedFrame>& frames) {
    TimeNs first_ns = 0;
    for (const ListedFrame& frame : frames) try {
        add(frame, first_ns);
      } catch (const std::exception& error) {
        recording.problems_.push_back(std::string(error.what()) + " (named in " + frame.origin + ")");
      }
  }

  void set_camera(const Listing& listing) {
    CameraGeometry& geometry = recording.geometry_;
    const Recording::Size size = recording.depth_size_.width_px > 0 ? recording.depth_size_ : recording.gray_size_;
    geometry.intrinsics = scaled(listing.intrinsics, size);
    geometry.lens_kind = listing.lens_kind;
    geometry.fisheye_k = listing.fisheye_k;
    geometry.R_body_cam = R_body_cam_from_pitch_down(listing.pitch_down.value_or(kAssumedPitchDown));
    geometry.position_body_m = listing.position_body_m;
    recording.pitch_down_ = listing.pitch_down;
    recording.nominal_rate_hz_ = listing.nominal_rate_hz;
    recording.depth_units_per_m_ = listing.depth_units_per_m;
  }
};

Recording Recording::open(const fs::path& folder) {
  Listing listing = list_recording(folder);
  RecordingBuilder builder;
  builder.recording.folder_ = folder;
  builder.recording.layout_ = listing.layout;
  builder.recording.problems_ = std::move(listing.problems);
  builder.add_all(listing.frames);
  if (builder.recording.entries_.empty())
    throw std::runtime_error(folder.string() + ": no usable frame" +
                             (builder.recording.problems_.empty() ? "" : "; first: " + builder.recording.problems_[0]));
  builder.set_camera(listing);
  return std::move(builder.recording);
}

void Recording::load_depth(std::size_t index, std::span<std::uint16_t> pixels_mm) const {
  const fs::path& file = entries_.at(index).depth_file;
  if (file.empty()) throw std::runtime_error(folder_.string() + ": entry " + std::to_string(index) + " has no depth");
  copy_pixels(load_gray16(file), pixels_mm, file);
  const double mm_per_unit = 1000.0 / depth_units_per_m_;
  for (std::uint16_t& d : pixels_mm) {
    const double mm = d == 65535 ? 0.0 : d * mm_per_unit + 0.5;
    d = static_cast<std::uint16_t>(mm < 65535.0 ? mm : 0.0);
  }
}

void Recording::load_gray(std::size_t index, std::span<std::uint8_t> pixels) const {
  const fs::path& file = entries_.at(index).gray_file;
  if (file.empty())
    throw std::runtime_error(folder_.string() + ": entry " + std::to_string(index) + " has no grey image");
  copy_pixels(load_gray8(file), pixels, file);
}

}  // namespace wasp::drivers
