// One opened Kinect of libfreenect: found by its serial number, its log read for lost packets and reasons.
#pragma once

#include <array>
#include <string>

#include "drivers/camera_driver.h"
#include "drivers/freenect_api.h"

namespace wasp::drivers {

enum class KinectStream : std::uint8_t { kDepth = 0, kVideo = 1 };

/// What the library says while it works. Its log has no place for a caller's pointer: one listens a thread.
struct KinectLog {
  struct Packets {
    int arrived = 0, expected = 0;
    [[nodiscard]] bool whole() const { return arrived >= expected; }
  };
  std::array<Packets, 2> packets;  ///< of the newest image of each KinectStream; 0 of 0 where the library does not say
  std::string last_error;

  void hear(freenect_loglevel level, const char* text);
};

class KinectDevice {
 public:
  /// Opens the Kinect with this serial number, or the only one. Throws CameraError with the library's own reason.
  KinectDevice(const FreenectApi& api, const std::string& serial);
  ~KinectDevice();
  KinectDevice(const KinectDevice&) = delete;
  KinectDevice& operator=(const KinectDevice&) = delete;

  [[nodiscard]] const std::string& serial() const { return serial_; }  ///< empty: the library does not say
  [[nodiscard]] freenect_device* get() const { return device_; }
  [[nodiscard]] KinectLog& log() { return log_; }

  /// The 640 x 480 (x 488) mode of a format, which the stream is set to. Throws CameraError if there is none.
  freenect_frame_mode set_depth(freenect_depth_format format, const char* name);
  freenect_frame_mode set_video(freenect_video_format format, const char* name);
  /// Lets the library work until `timeout_ns` at most, callbacks included; false: the device is gone.
  bool process(DurationNs timeout_ns);

  [[noreturn]] void fail(const std::string& why, const std::string& remedy = {}) const;

 private:
  void open(const std::string& serial);
  void shut() noexcept;

  const FreenectApi& api_;
  KinectLog log_;
  freenect_context* context_ = nullptr;
  freenect_device* device_ = nullptr;
  std::string serial_;
};

/// Serial numbers of what is plugged in; one empty string a device where the library does not say.
std::vector<std::string> kinect_serials(const FreenectApi& api, freenect_context* context);

}  // namespace wasp::drivers
