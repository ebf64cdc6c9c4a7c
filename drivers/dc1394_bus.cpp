#include "drivers/dc1394_bus.h"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>

#include "drivers/camera_driver.h"

namespace wasp::drivers {
namespace {

constexpr int kMostNodes = 32;

std::string text_of(const char* text) { return text == nullptr ? std::string() : std::string(text); }

std::string remedy_of(dc1394error_t error) {
  switch (error) {
    case DC1394_NO_BANDWIDTH:
      return "another camera takes the bus: a lower rate_hz, or a bus of its own";
    case DC1394_NO_ISO_CHANNEL:
      return "no free channel on the bus: unplug other cameras";
    case DC1394_CAPTURE_IS_RUNNING:
      return "another program uses it";
    default:
      return {};
  }
}

}  // namespace

std::string guid_text(std::uint64_t guid) {
  std::array<char, 20> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(guid));
  return text.data();
}

std::string bus_problem() {
  for (int n = 0; n < kMostNodes; ++n) {
    const std::string node = "/dev/fw" + std::to_string(n);
    if (access(node.c_str(), F_OK) == 0 && access(node.c_str(), R_OK | W_OK) != 0)
      return node +
             " may not be opened: add the user to the group that owns it (sudo usermod -aG video $USER, and a "
             "udev rule that gives /dev/fw* to it), then log in anew";
  }
  return {};
}

Dc1394Bus::Dc1394Bus() : bus_(dc1394_new()) {
  if (!bus_) throw CameraError("dc1394", "no IEEE 1394 bus", "load the kernel's firewire_ohci, or plug in the adapter");
  for (const auto level : {DC1394_LOG_ERROR, DC1394_LOG_WARNING, DC1394_LOG_DEBUG})
    dc1394_log_register_handler(level, nullptr, nullptr);
}

std::vector<std::uint64_t> Dc1394Bus::guids() const {
  std::vector<std::uint64_t> found;
  dc1394camera_list_t* list = nullptr;
  if (dc1394_camera_enumerate(bus_.get(), &list) != DC1394_SUCCESS || list == nullptr) return found;
  for (std::uint32_t i = 0; i < list->num; ++i) found.push_back(list->ids[i].guid);
  dc1394_camera_free_list(list);
  return found;
}

Dc1394Device::Dc1394Device(const Dc1394Bus& bus, std::uint64_t guid) : camera_(dc1394_camera_new(bus.get(), guid)) {
  if (!camera_)
    throw CameraError("dc1394 " + guid_text(guid), "cannot be opened", "plug it in; see `wasp camera --list`");
}

std::string Dc1394Device::name() const { return text_of(camera_->vendor) + " " + text_of(camera_->model); }
std::string Dc1394Device::identity() const { return name() + ", GUID " + guid_text(camera_->guid); }

void Dc1394Device::demand(dc1394error_t error, const std::string& what) const {
  if (error != DC1394_SUCCESS)
    throw CameraError("dc1394 " + guid_text(camera_->guid),
                      "cannot " + what + ": " + text_of(dc1394_error_get_string(error)), remedy_of(error));
}

std::uint32_t Dc1394Device::generation() const {
  std::uint32_t node = 0, generation = 0;
  return dc1394_camera_get_node(camera_.get(), &node, &generation) == DC1394_SUCCESS ? generation : 0;
}

}  // namespace wasp::drivers
