// One open /dev/videoN: its calls with the device and the reason named when they fail, what it is, what it offers.
#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "types/time.h"

namespace wasp::drivers {

/// Who a capture device is, wherever it is plugged in.
struct V4l2Identity {
  std::string node;    ///< "/dev/video0"
  std::string card;    ///< "UVC Camera (046d:0825)"
  std::string bus;     ///< "usb-0000:00:14.0-1"
  std::string serial;  ///< of the USB device; often empty

  /// "card, bus, serial n" without what is empty.
  [[nodiscard]] std::string text() const;
  /// The same camera: by serial number where there is one, else by bus address and card.
  [[nodiscard]] bool same_as(const V4l2Identity& other) const;
  /// `wanted` is this node, or part of its card, bus or serial number.
  [[nodiscard]] bool answers_to(std::string_view wanted) const;
};

/// A picture format at one size, with its frame rates.
struct V4l2Mode {
  std::uint32_t fourcc = 0;
  int width_px = 0, height_px = 0;
  std::vector<double> rates_hz;  ///< empty: the device does not say
};

std::string fourcc_text(std::uint32_t fourcc);

class V4l2Device {
 public:
  V4l2Device() = default;
  /// Opens, never waiting. Throws CameraError with the remedy; errno is kept in `last_error`.
  explicit V4l2Device(const std::string& node);
  ~V4l2Device() { close(); }
  V4l2Device(V4l2Device&& other) noexcept;
  V4l2Device& operator=(V4l2Device&& other) noexcept;
  void close() noexcept;

  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] bool is_open() const { return fd_ >= 0; }
  /// True if it captures pictures by streaming through one plane.
  [[nodiscard]] bool captures() const;
  [[nodiscard]] const V4l2Identity& identity() const { return identity_; }
  /// Every format and size; a stepwise range counts as its largest and, where it lies inside, `width` x `height`.
  [[nodiscard]] std::vector<V4l2Mode> modes(int width_px, int height_px) const;

  /// ioctl, again when interrupted; 0 or errno.
  int call(unsigned long request, void* argument) const noexcept;
  /// The same; throws CameraError "cannot <what>".
  void demand(unsigned long request, void* argument, const std::string& what) const;
  /// Value of a control; false if the device has none.
  bool control(std::uint32_t id, int& value) const noexcept;
  /// Sets a control as far as its range allows; false if the device has none or refuses.
  bool set_control(std::uint32_t id, int value) const noexcept;

 private:
  void look();
  [[nodiscard]] std::vector<double> rates(const V4l2Mode& mode) const;

  int fd_ = -1;
  std::uint32_t capabilities_ = 0;
  V4l2Identity identity_;
};

/// Every capture device there is, looked at and closed again; what cannot be opened stands in `problems`.
std::vector<V4l2Identity> present_v4l2_devices(std::vector<std::string>* problems = nullptr);

}  // namespace wasp::drivers
