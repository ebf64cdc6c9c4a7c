// libdc1394's handles as objects, its errors as CameraError.
#pragma once

#include <dc1394/dc1394.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace wasp::drivers {

/// "00b09d0100aabbcc"
std::string guid_text(std::uint64_t guid);

/// The library's context. Its messages are not printed: what fails is said by who asked.
class Dc1394Bus {
 public:
  /// Throws CameraError if the kernel gives no access to the bus.
  Dc1394Bus();

  /// GUIDs of the cameras on the bus; the bus is looked at anew.
  [[nodiscard]] std::vector<std::uint64_t> guids() const;
  [[nodiscard]] dc1394_t* get() const { return bus_.get(); }

 private:
  struct Free {
    void operator()(dc1394_t* bus) const { dc1394_free(bus); }
  };
  std::unique_ptr<dc1394_t, Free> bus_;
};

/// One camera.
class Dc1394Device {
 public:
  /// Throws CameraError.
  Dc1394Device(const Dc1394Bus& bus, std::uint64_t guid);

  [[nodiscard]] dc1394camera_t* get() const { return camera_.get(); }
  [[nodiscard]] std::string name() const;      ///< vendor and model
  [[nodiscard]] std::string identity() const;  ///< "Point Grey Firefly MV, GUID 00b0..."
  /// Throws CameraError "cannot <what>" with the library's word for it.
  void demand(dc1394error_t error, const std::string& what) const;
  /// Counts bus resets; 0 if the library cannot say.
  [[nodiscard]] std::uint32_t generation() const;

 private:
  struct Free {
    void operator()(dc1394camera_t* camera) const { dc1394_camera_free(camera); }
  };
  std::unique_ptr<dc1394camera_t, Free> camera_;
};

/// Why no camera may be seen: "" or the device files that may not be opened, and the remedy.
std::string bus_problem();

}  // namespace wasp::drivers
