// Folders of recorded frames: an input is a few files with names that the layouts look for, of text or of small good
// images (images that are bad are image_fuzz's business). Promises: a folder opens, or is refused with an error that
// names it; what opened has entries in strict order of time, and every one of them loads or says why not.
#include <array>
#include <stdexcept>
#include <vector>

#include "drivers/image_file.h"
#include "drivers/recording.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/scratch_file.h"

namespace {

using namespace wasp;

constexpr std::array kNames = {"depth.txt",
                               "rgb.txt",
                               "camera.toml",
                               "gt_per_frame.csv",
                               "frame-000000.depth.png",
                               "frame-000007.depth.png",
                               "dep_prev.png",
                               "dep_curr.png",
                               "img_prev.png",
                               "depth_0.pgm",
                               "depth_4294967295.pgm",
                               "color_0.png",
                               "a_depth.png",
                               "a_rgb.png",
                               "test1.png",
                               "test002.png",
                               "test4294967295.png",
                               "1403636579763555584.png",
                               "9999999999999999999.png",
                               "0001403636579763555.png",
                               "image7.png",
                               "image8.png",
                               "frame-000000.color.png",
                               "frame10.png",
                               "frame11.png",
                               "FRONTAL_1235604664.906455.png",
                               "groundtruth.txt",
                               "accelerometer.txt",
                               "imu.csv",
                               "mocap_500hz_raw.csv",
                               "data.csv",
                               "sensor.yaml",
                               "frame-000000.pose.txt",
                               "frame-000007.pose.txt",
                               "flow10.flo"};

/// Those that hold text (or bytes); the others hold images.
bool is_text(std::size_t name) { return name < 4 || name >= 26; }

/// Depth, grey and oddly sized images, and one that is none, as they lie in a file.
const std::vector<std::vector<std::uint8_t>>& images() {
  static const auto kImages = [] {
    std::vector<std::vector<std::uint8_t>> files;
    fuzz::ScratchFile file(".seed.png");
    const std::vector<std::uint16_t> depth(12, 1500);
    const std::vector<std::uint8_t> gray(12, 99);
    const auto keep = [&](const auto& pixels, int width_px, int height_px) {
      drivers::save_png(file.path(), {pixels.data(), width_px, height_px, width_px});
      std::vector<std::uint8_t> bytes(std::filesystem::file_size(file.path()));
      const int fd = open(file.path().c_str(), O_RDONLY);
      fuzz::require(read(fd, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()), "a seed can be read");
      close(fd);
      files.push_back(bytes);
    };
    keep(depth, 4, 3), keep(gray, 4, 3), keep(depth, 2, 2), keep(gray, 3, 4);
    files.push_back({'P', '5', ' ', '2', ' ', '2', ' ', '9', '9', '9', '\n', 1, 2, 3, 4, 5, 6, 7, 8});
    files.push_back({0x89, 'P', 'N', 'G'});
    return files;
  }();
  return kImages;
}

void check(const drivers::Recording& recording) {
  fuzz::require(!recording.entries().empty(), "an open recording has entries");
  fuzz::require(recording.problems().empty() == (recording.problem_counts().total() == 0),
                "problems are told and counted");
  TimeNs before_ns = -1;
  for (const auto& sample : recording.motion().inertial.samples) {
    fuzz::require(sample.time_ns > before_ns, "inertial samples are in order of time");
    before_ns = sample.time_ns;
  }
  std::vector<std::uint16_t> depth(recording.depth_size().pixels());
  std::vector<std::uint8_t> gray(recording.gray_size().pixels());
  DurationNs last = -1;
  for (std::size_t i = 0; i < recording.entries().size(); ++i) {
    const drivers::RecordingEntry& entry = recording.entries()[i];
    fuzz::require(entry.offset_ns > last, "entries are in order of time");
    last = entry.offset_ns;
    try {
      if (entry.has_depth()) recording.load_depth(i, depth);
      if (entry.has_gray()) recording.load_gray(i, gray);
    } catch (const std::runtime_error& error) {
      fuzz::require_clear(error.what(), recording.folder().string());
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static fuzz::ScratchFolder folder;
  fuzz::FuzzInput in(data, size);
  folder.clear();
  for (int files = 0; !in.empty() && files < 6; ++files) {
    const auto name = in.take<std::uint8_t>(), what = in.take<std::uint8_t>();
    const bool text = is_text(name % kNames.size());
    folder.write(kNames[name % kNames.size()],
                 text ? in.take_bytes(what * 4u) : std::span<const std::uint8_t>(images()[what % images().size()]));
  }
  try {
    check(drivers::Recording::open(folder.path()));
  } catch (const std::runtime_error& error) {
    fuzz::require_clear(error.what(), folder.path().string());
  }
  return 0;
}
