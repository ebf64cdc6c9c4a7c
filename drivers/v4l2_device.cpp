#include "drivers/v4l2_device.h"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

#include "drivers/camera_driver.h"

namespace wasp::drivers {
namespace {

constexpr int kMostNodes = 64;

std::string remedy_of(int error) {
  switch (error) {
    case EACCES:
    case EPERM:
      return "add the user to the group that owns it: sudo usermod -aG video $USER, then log in anew";
    case EBUSY:
      return "another program uses it: `fuser -v` with its name says which";
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return "plug it in, or see what is there: wasp camera --list";
    default:
      return {};
  }
}

std::string field(const __u8* text, std::size_t size) {
  const auto* begin = reinterpret_cast<const char*>(text);
  return {begin, strnlen(begin, size)};
}

/// Serial number of the USB device behind a node; video nodes hang on an interface, one folder below it.
std::string serial_of(const std::string& node) {
  std::string serial;
  std::ifstream file("/sys/class/video4linux/" + node.substr(node.rfind('/') + 1) + "/device/../serial");
  std::getline(file, serial);
  return serial;
}

double rate_of(const v4l2_fract& period) {
  return period.numerator == 0 ? 0 : static_cast<double>(period.denominator) / period.numerator;
}

}  // namespace

std::string V4l2Identity::text() const {
  return card + (bus.empty() ? "" : ", " + bus) + (serial.empty() ? "" : ", serial " + serial);
}

bool V4l2Identity::same_as(const V4l2Identity& other) const {
  if (!serial.empty() || !other.serial.empty()) return serial == other.serial && card == other.card;
  return bus == other.bus && card == other.card;
}

bool V4l2Identity::answers_to(std::string_view wanted) const {
  if (wanted.starts_with("/dev/")) return node == wanted;
  return card.find(wanted) != std::string::npos || bus.find(wanted) != std::string::npos || serial == wanted;
}

std::string fourcc_text(std::uint32_t fourcc) {
  std::string text;
  for (int i = 0; i < 4; ++i) text += static_cast<char>(fourcc >> (8 * i) & 0x7f);
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

V4l2Device::V4l2Device(const std::string& node) : fd_(::open(node.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC)) {
  if (fd_ < 0) throw CameraError(node, std::strerror(errno), remedy_of(errno));
  identity_.node = node;
  look();
}

V4l2Device::V4l2Device(V4l2Device&& other) noexcept { *this = std::move(other); }

V4l2Device& V4l2Device::operator=(V4l2Device&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(capabilities_, other.capabilities_);
  std::swap(identity_, other.identity_);
  return *this;
}

void V4l2Device::close() noexcept {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

void V4l2Device::look() {
  v4l2_capability c{};
  if (const int error = call(VIDIOC_QUERYCAP, &c); error != 0) {
    close();
    throw CameraError(identity_.node, error == ENOTTY ? "is no video device" : std::strerror(error), remedy_of(error));
  }
  capabilities_ = (c.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? c.device_caps : c.capabilities;
  identity_.card = field(c.card, sizeof c.card);
  identity_.bus = field(c.bus_info, sizeof c.bus_info);
  identity_.serial = serial_of(identity_.node);
}

bool V4l2Device::captures() const {
  return (capabilities_ & V4L2_CAP_VIDEO_CAPTURE) != 0 && (capabilities_ & V4L2_CAP_STREAMING) != 0;
}

int V4l2Device::call(unsigned long request, void* argument) const noexcept {
  int result = 0;
  do result = ioctl(fd_, request, argument);
  while (result < 0 && errno == EINTR);
  return result < 0 ? errno : 0;
}

void V4l2Device::demand(unsigned long request, void* argument, const std::string& what) const {
  if (const int error = call(request, argument); error != 0)
    throw CameraError(identity_.node, "cannot " + what + ": " + std::strerror(error), remedy_of(error));
}

bool V4l2Device::control(std::uint32_t id, int& value) const noexcept {
  v4l2_control c{id, 0};
  if (call(VIDIOC_G_CTRL, &c) != 0) return false;
  value = c.value;
  return true;
}

bool V4l2Device::set_control(std::uint32_t id, int value) const noexcept {
  v4l2_queryctrl range{};
  range.id = id;
  if (call(VIDIOC_QUERYCTRL, &range) != 0 || (range.flags & V4L2_CTRL_FLAG_DISABLED) != 0) return false;
  v4l2_control c{id, std::clamp(value, range.minimum, range.maximum)};
  return call(VIDIOC_S_CTRL, &c) == 0;
}

std::vector<double> V4l2Device::rates(const V4l2Mode& mode) const {
  std::vector<double> found;
  v4l2_frmivalenum interval{};
  interval.pixel_format = mode.fourcc;
  interval.width = static_cast<__u32>(mode.width_px);
  interval.height = static_cast<__u32>(mode.height_px);
  for (; interval.index < 64 && call(VIDIOC_ENUM_FRAMEINTERVALS, &interval) == 0; ++interval.index) {
    const bool discrete = interval.type == V4L2_FRMIVAL_TYPE_DISCRETE;
    found.push_back(rate_of(discrete ? interval.discrete : interval.stepwise.min));
    if (!discrete) break;
  }
  return found;
}

std::vector<V4l2Mode> V4l2Device::modes(int width_px, int height_px) const {
  std::vector<V4l2Mode> found;
  const auto add = [&](std::uint32_t fourcc, __u32 width, __u32 height) {
    V4l2Mode mode{fourcc, static_cast<int>(width), static_cast<int>(height), {}};
    mode.rates_hz = rates(mode);
    found.push_back(std::move(mode));
  };
  v4l2_fmtdesc format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  for (; format.index < 64 && call(VIDIOC_ENUM_FMT, &format) == 0; ++format.index) {
    v4l2_frmsizeenum size{};
    size.pixel_format = format.pixelformat;
    for (; size.index < 64 && call(VIDIOC_ENUM_FRAMESIZES, &size) == 0; ++size.index) {
      if (size.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
        add(format.pixelformat, size.discrete.width, size.discrete.height);
        continue;
      }
      const auto& s = size.stepwise;
      const auto w = static_cast<__u32>(width_px), h = static_cast<__u32>(height_px);
      const auto inside = [](__u32 x, __u32 low, __u32 high, __u32 step) {
        return x >= low && x <= high && (step == 0 || (x - low) % step == 0);
      };
      if (inside(w, s.min_width, s.max_width, s.step_width) && inside(h, s.min_height, s.max_height, s.step_height))
        add(format.pixelformat, w, h);
      add(format.pixelformat, s.max_width, s.max_height);
      break;
    }
  }
  return found;
}

std::vector<V4l2Identity> present_v4l2_devices(std::vector<std::string>* problems) {
  std::vector<V4l2Identity> found;
  for (int n = 0; n < kMostNodes; ++n) {
    const std::string node = "/dev/video" + std::to_string(n);
    if (access(node.c_str(), F_OK) != 0) continue;
    try {
      const V4l2Device device(node);
      if (device.captures()) found.push_back(device.identity());
    } catch (const CameraError& error) {
      if (problems != nullptr) problems->push_back(error.what());
    }
  }
  return found;
}

}  // namespace wasp::drivers
