// Takes the layout's listing, drops what cannot be used (and says why), and fixes size, geometry and time zero.
#include "drivers/recording.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "drivers/image_file.h"
#include "drivers/recording_folder.h"

namespace wasp::drivers {
namespace {

namespace fs = std::filesystem;

/// A file of an entry, once looked at.
struct Probed {
  std::optional<Recording::Size> size;  ///< nullopt: there is none, or it is no good
};

/// Looks at one image; a problem if it is not there or no good.
Probed probe(const fs::path& file, bool is_depth, const std::string& origin, RecordingProblems& problems) {
  if (file.empty()) return {};
  const std::string named = " (named in " + origin + ")";
  try {
    const ImageInfo info = probe_image(file);
    if (is_depth && (info.bits != 16 || info.colour))
      throw std::runtime_error(file.string() + ": expected a 16-bit grey image (depth)");
    return {Recording::Size{info.width_px, info.height_px}};
  } catch (const std::exception& error) {
    const ProblemKind kind = fs::exists(file) ? ProblemKind::kDamaged : ProblemKind::kMissing;
    problems.add(kind, file.parent_path(), error.what() + named);
    return {};
  }
}

/// The size that most have; of equally many, that of the first.
Recording::Size usual_size(const std::vector<Probed>& files) {
  Recording::Size best;
  std::size_t most = 0;
  std::vector<std::pair<Recording::Size, std::size_t>> counts;
  for (const Probed& p : files) {
    if (!p.size) continue;
    auto found = std::find_if(counts.begin(), counts.end(), [&](const auto& c) { return c.first == *p.size; });
    if (found == counts.end()) found = counts.insert(counts.end(), {*p.size, 0});
    ++found->second;
  }
  for (const auto& [size, count] : counts)
    if (count > most) best = size, most = count;
  return best;
}

/// False, and a problem, for an image of another size than most.
bool fits(const Probed& probed, Recording::Size usual, const fs::path& file, const std::string& origin,
          RecordingProblems& problems) {
  if (!probed.size) return false;
  if (*probed.size == usual) return true;
  const auto text = [](Recording::Size s) { return std::to_string(s.width_px) + "x" + std::to_string(s.height_px); };
  problems.add(ProblemKind::kOtherSize, file.parent_path(),
               file.string() + ": " + text(*probed.size) + " pixels, most of its kind have " + text(usual) +
                   " (named in " + origin + ")");
  return false;
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

namespace {

/// Depth and grey of some layouts are counted apart; a frame's number must rise from entry to entry.
void number_anew_if_needed(std::vector<ListedFrame>& frames) {
  const auto falls = [](const ListedFrame& a, const ListedFrame& b) { return b.sequence <= a.sequence; };
  if (std::adjacent_find(frames.begin(), frames.end(), falls) == frames.end()) return;
  for (std::size_t i = 0; i < frames.size(); ++i) frames[i].sequence = static_cast<std::uint32_t>(i);
}

}  // namespace

struct RecordingBuilder {
  Recording recording;

  /// Keeps of every frame what is whole and of the usual size, then of the frames those whose times rise.
  void add_all(std::vector<ListedFrame> frames) {
    std::vector<Probed> depth, gray;
    for (const ListedFrame& frame : frames) {
      depth.push_back(probe(frame.depth_file, true, frame.origin, recording.problems_));
      gray.push_back(probe(frame.gray_file, false, frame.origin, recording.problems_));
    }
    const Recording::Size depth_size = usual_size(depth), gray_size = usual_size(gray);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      ListedFrame& frame = frames[i];
      if (!fits(depth[i], depth_size, frame.depth_file, frame.origin, recording.problems_)) frame.depth_file.clear();
      if (!fits(gray[i], gray_size, frame.gray_file, frame.origin, recording.problems_)) frame.gray_file.clear();
    }
    std::erase_if(frames, [](const ListedFrame& frame) { return frame.any_file().empty(); });
    drop_unordered(frames, recording.problems_);
    number_anew_if_needed(frames);
    recording.depth_size_ = depth_size, recording.gray_size_ = gray_size;
    if (!frames.empty()) recording.begins_at_ns_ = frames.front().time_ns;
    for (ListedFrame& frame : frames)
      recording.entries_.push_back({frame.time_ns - recording.begins_at_ns_, frame.sequence,
                                    std::move(frame.depth_file), std::move(frame.gray_file),
                                    frame.stamped_ns.value_or(frame.time_ns)});
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
  builder.recording.motion_ = std::move(listing.motion);
  builder.recording.notes_ = std::move(listing.notes);
  builder.recording.true_flows_ = std::move(listing.true_flows);
  builder.add_all(std::move(listing.frames));
  if (builder.recording.entries_.empty()) {
    const auto problems = builder.recording.problems();
    throw std::runtime_error(folder.string() + ": no usable frame" +
                             (problems.empty() ? "" : "; first: " + problems[0]));
  }
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
