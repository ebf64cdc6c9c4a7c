// A real camera, whatever it hangs on. A driver opens one device, waits for its frames and writes or converts them
// straight into the memory of the ring slots that a sink lends; the sink publishes. The camera process drives it
// (tools/camera_capture.h): one capture thread a camera, which also counts, and finds the device again after a loss.
//
// A new driver is one class of this kind and one row in drivers/camera_table.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "types/time.h"

namespace wasp::drivers {

/// A camera that cannot be used: which, why, and what would change that.
class CameraError : public std::runtime_error {
 public:
  CameraError(const std::string& device, const std::string& why, const std::string& remedy = {})
      : std::runtime_error(device + ": " + why + (remedy.empty() ? "" : "; " + remedy)) {}
};

/// Keys of [camera] that only real cameras have; each driver's page in docs/cameras.md says which it obeys.
struct CameraSettings {
  std::string device;           ///< "" : the only one there is; else its path, or (part of) its stable identity
  std::string pixel_format;     ///< "" : the best the camera offers
  double exposure_us = 0;       ///< shutter; 0: automatic
  double gain = -1;             ///< in the camera's own unit; -1: automatic
  std::string trigger = "off";  ///< off | external
  int buffers = 4;              ///< exposures the device may hold before one is lost
  double readout_us = -1;       ///< from the end of the exposure to the device's time stamp; -1: the driver's estimate
  double delay_ms = 0;          ///< what `wasp calibrate delay` found: taken off every stamp before it is published
  std::string depth_mode = "raw";                 ///< kinect: raw | registered | mm
  std::string depth_model = "tangent";            ///< kinect, raw: two-gaussians | tangent | linear
  std::vector<double> depth_coefficients;         ///< of that model (drivers/kinect_depth.h); empty: the published ones
  std::array<float, 2> depth_range_m{0.4f, 7.f};  ///< kinect: nearer or farther counts as no reading
};

/// What the flight was promised.
struct CameraRequest {
  int width_px = 640, height_px = 480;
  double rate_hz = 30;
  CameraSettings settings;
};

/// What the opened device really delivers.
struct CameraFormat {
  int width_px = 0, height_px = 0;
  double rate_hz = 0;  ///< 0: the device does not say
  bool gray = true, depth = false;
  std::string pixels;    ///< on the device's side, e.g. "YUYV"
  std::string name;      ///< for people, e.g. "UVC Camera (046d:0825)"
  std::string identity;  ///< stable over replugging: bus address, serial number, GUID
  std::string node;      ///< where it is now, e.g. "/dev/video0"
  std::string settings;  ///< read back: "exposure 5000 us, gain 16, 30 Hz"
};

/// When an exposure was, by CLOCK_MONOTONIC, and its place in the device's own count.
struct FrameStamp {
  TimeNs exposed_at_ns = 0;    ///< its middle
  std::uint32_t sequence = 0;  ///< a gap is a frame that was lost on the way; begins anew with open()
  bool depth = true;           ///< false: this exposure came without its depth image, or it was published before
  bool gray = true;            ///< false: the depth image alone; its grey one may follow with the same stamp, or not
  bool estimated = false;      ///< the device gave no time that can be believed: that of arrival stands in
};

/// Memory of one exposure in the rings, rows close together.
struct FrameSlot {
  std::uint8_t* gray = nullptr;       ///< width_px * height_px bytes
  std::uint16_t* depth_mm = nullptr;  ///< width_px * height_px; nullptr: nobody wants depth
};

/// Where frames go. One thread.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  /// Memory of the next exposure: the driver's own, and each image the same, until it is published.
  virtual FrameSlot slot() = 0;
  /// Optional, when publish() follows within 50 us: wakes sleeping readers early.
  virtual void announce() = 0;
  /// The slot is complete: depth is published first, then the grey image of the same stamp.
  virtual void publish(const FrameStamp& stamp) = 0;
};

enum class FrameEvent : std::uint8_t {
  kFrame,    ///< one was published
  kTimeout,  ///< none came before the deadline
  kCorrupt,  ///< one came, but damaged: nothing was published
  kGone,     ///< the device is not there any more: close(), and open() until it succeeds
};

/// One device. One thread, apart from construction. Realtime-safe: no, but wait_frame neither allocates nor waits past
/// its deadline.
class CameraDriver {
 public:
  virtual ~CameraDriver() = default;
  CameraDriver() = default;
  CameraDriver(const CameraDriver&) = delete;
  CameraDriver& operator=(const CameraDriver&) = delete;

  /// Finds and configures the device: the one asked for, and after a first success that very one again, wherever it is
  /// plugged in. Throws CameraError, with nothing left open. A device that delivers another size than asked for is the
  /// caller's to refuse.
  CameraFormat open() {
    close();
    try {
      return configure();
    } catch (...) {
      close();
      throw;
    }
  }
  /// Frames flow from here on. The sink outlives close(). Throws CameraError.
  virtual void start(FrameSink& sink) = 0;
  /// Waits for one frame and publishes it. When several wait, old ones may be passed over for the newest.
  virtual FrameEvent wait_frame(TimeNs deadline_ns) = 0;
  /// Lets the device go. May be called at any time, twice too.
  virtual void close() noexcept = 0;
  /// What only this kind counts, since start(); for people. Empty: nothing.
  [[nodiscard]] virtual std::string account() const { return {}; }

 private:
  /// open(), from a closed device; what it left open when it throws is closed by the caller.
  virtual CameraFormat configure() = 0;
};

/// A camera that is plugged in.
struct FoundCamera {
  std::string device;                ///< what [camera] device may say
  std::string name, identity;        ///< as in CameraFormat
  std::vector<std::string> formats;  ///< one line each: "GREY 640x480 30 15 Hz"
  std::string problem;               ///< why it cannot be looked at, with the remedy; empty: none
};

/// One kind of camera.
struct CameraDriverRow {
  const char* name;  ///< [camera] driver
  const char* what;  ///< one line for people
  bool depth;        ///< delivers depth images as well
  std::unique_ptr<CameraDriver> (*make)(const CameraRequest&);
  std::vector<FoundCamera> (*list)();
};

/// Every kind this build has. (drivers/camera_table.cpp)
std::span<const CameraDriverRow> camera_drivers();
/// Throws std::runtime_error naming those this build has.
const CameraDriverRow& camera_driver(const std::string& name);

}  // namespace wasp::drivers
