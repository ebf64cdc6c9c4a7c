#include "sim/fakenect_dump.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>

namespace wasp::sim {
namespace {

constexpr double kCountsPerG = 819, kGravity_mps2 = 9.80665;

/// freenect_raw_tilt_state as the library lays it out.
struct TiltState {
  std::int16_t x = 0, y = 0, z = 0;
  std::int8_t tilt_angle = 0, padding = 0;
  std::int32_t tilt_status = 0;
};
static_assert(sizeof(TiltState) == 12);

template <class T>
void check_size(const ImageView<T>& image) {
  if (image.width_px != FakenectDump::kWidth || image.height_px != FakenectDump::kHeight)
    throw std::runtime_error("a Kinect's images are 640 x 480, not " + std::to_string(image.width_px) + " x " +
                             std::to_string(image.height_px));
}

template <class T>
void write(std::ofstream& out, const T* data, std::size_t count, const std::filesystem::path& folder) {
  out.write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(count * sizeof(T)));
  out.flush();
  if (!out) throw std::runtime_error(folder.string() + ": cannot write (is the disk full?)");
}

}  // namespace

FakenectDump::FakenectDump(std::filesystem::path folder, const FakenectOptions& options)
    : folder_(std::move(folder)), options_(options), table_(drivers::make_kinect_table(options.model)) {
  std::filesystem::create_directories(folder_);
  if (std::filesystem::exists(folder_ / "INDEX.txt"))
    throw std::runtime_error(folder_.string() + ": a dump lies here already");
  index_.open(folder_ / "INDEX.txt");
  if (!index_) throw std::runtime_error(folder_.string() + ": cannot write");
  raw_of_mm_.resize(1 << 16);
  for (std::size_t mm = 0; mm < raw_of_mm_.size(); ++mm)
    raw_of_mm_[mm] = drivers::kinect_raw(table_, static_cast<int>(mm));
}

std::ofstream FakenectDump::open(char kind, TimeNs exposed_at_ns, DurationNs readout_ns, const char* extension) {
  const DurationNs stamped_ns = exposed_at_ns - first_ns_ + readout_ns;
  const double arrival_s = options_.first_arrival_s + to_seconds(stamped_ns + options_.bus_delay_ns);
  const auto ticks = static_cast<std::uint32_t>(options_.first_ticks + static_cast<std::uint64_t>(stamped_ns * 60 / 1000));
  std::array<char, 64> name{};
  std::snprintf(name.data(), name.size(), "%c-%.6f-%u.%s", kind, arrival_s, ticks, extension);
  index_ << name.data() << '\n' << std::flush;
  return std::ofstream(folder_ / name.data(), std::ios::binary);
}

void FakenectDump::add(TimeNs exposed_at_ns, const GrayView& gray, const DepthView& depth_mm) {
  if (first_ns_ == kNever) first_ns_ = exposed_at_ns;
  if (last_ns_ != kNever && exposed_at_ns <= last_ns_) throw std::runtime_error("exposures out of order");
  last_ns_ = exposed_at_ns;
  ++exposures_;
  if (gray.valid()) {
    check_size(gray);
    rgb_.clear();
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) rgb_.insert(rgb_.end(), 3, gray.row(v)[u]);
    std::ofstream out = open('r', exposed_at_ns, options_.video_readout_ns, "ppm");
    out << "P6 640 480 255\n";
    write(out, rgb_.data(), rgb_.size(), folder_);
  }
  if (depth_mm.valid()) {
    check_size(depth_mm);
    raw_.clear();
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) raw_.push_back(raw_of_mm_[depth_mm.row(v)[u]]);
    std::ofstream out = open('d', exposed_at_ns, options_.depth_readout_ns, "pgm");
    out << "P5 640 480 65535\n";
    write(out, raw_.data(), raw_.size(), folder_);
  }
}

void FakenectDump::add_accel(TimeNs exposed_at_ns, const std::array<float, 3>& accel_cam_mps2) {
  if (first_ns_ == kNever) first_ns_ = exposed_at_ns;
  const auto counts = [](float mps2) {
    const double value = static_cast<double>(mps2) / kGravity_mps2 * kCountsPerG;
    return static_cast<std::int16_t>(std::lround(std::clamp(value, -32768.0, 32767.0)));
  };
  TiltState state;  // its axes: right, up, back
  state.x = counts(accel_cam_mps2[0]), state.y = counts(-accel_cam_mps2[1]), state.z = counts(-accel_cam_mps2[2]);
  std::ofstream out = open('a', exposed_at_ns, 0, "dump");
  write(out, &state, 1, folder_);
}

}  // namespace wasp::sim
