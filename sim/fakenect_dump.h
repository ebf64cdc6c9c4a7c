// A Kinect's stream as libfreenect's `fakenect-record` would have written it, for `fakenect` to play to a program that
// takes it for the device: INDEX.txt, in order of arrival the names "r-TIME-TICKS.ppm" (RGB), "d-TIME-TICKS.pgm" (raw
// 11-bit depth, in the byte order of the machine though the header says otherwise) and "a-TIME-TICKS.dump"
// (accelerometer). TIME is when the image arrived, in seconds; TICKS the device's 60 MHz counter when its last packet
// left, which wraps.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <vector>

#include "drivers/kinect_depth.h"
#include "types/image_view.h"
#include "types/time.h"

namespace wasp::sim {

struct FakenectOptions {
  drivers::KinectDepthModel model = drivers::kBurrusLinear;  ///< millimetres become raw values by it
  std::uint32_t first_ticks = 0xF8000000;                    ///< of the first exposure; this one wraps after 2.2 s
  double first_arrival_s = 1'700'000'000;
  DurationNs depth_readout_ns = 30'250 * kMicrosecond;  ///< exposure to last packet: 242 of 125 us each
  DurationNs video_readout_ns = 20'250 * kMicrosecond;
  DurationNs bus_delay_ns = 2 * kMillisecond;
};

class FakenectDump {
 public:
  static constexpr int kWidth = 640, kHeight = 480;

  /// Makes the folder. Throws std::runtime_error where it cannot, or where a dump lies there already.
  FakenectDump(std::filesystem::path folder, const FakenectOptions& options = {});

  /// One exposure, later than the last. Either view may be empty: that image is missing then. Depth in millimetres,
  /// 0 = no reading. Throws std::runtime_error for other sizes and for what cannot be written.
  void add(TimeNs exposed_at_ns, const GrayView& gray, const DepthView& depth_mm);
  /// What the accelerometer reads at an exposure: specific force in camera axes (x right, y down, z forward) [m/s^2].
  void add_accel(TimeNs exposed_at_ns, const std::array<float, 3>& accel_cam_mps2);

  [[nodiscard]] std::uint64_t exposures() const { return exposures_; }

 private:
  std::ofstream open(char kind, TimeNs exposed_at_ns, DurationNs readout_ns, const char* extension);

  std::filesystem::path folder_;
  FakenectOptions options_;
  drivers::KinectTable table_;
  std::vector<std::uint16_t> raw_of_mm_;
  std::ofstream index_;
  TimeNs first_ns_ = kNever, last_ns_ = kNever;
  std::uint64_t exposures_ = 0;
  std::vector<std::uint8_t> rgb_;
  std::vector<std::uint16_t> raw_;
};

}  // namespace wasp::sim
