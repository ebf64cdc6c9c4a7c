// The line to the autopilot and the USB devices.
#include <fcntl.h>
#include <fmt/format.h>
#include <linux/serial.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <charconv>
#include <filesystem>

#include "tools/doctor_checks.h"

namespace wasp::tools {
namespace {

constexpr unsigned kLowLatency = 1u << 13;  // ASYNC_LOW_LATENCY of linux/tty_flags.h

std::optional<unsigned> flags_from_sysfs(const SystemTree& tree, const std::string& name) {
  const auto text = tree.text("/sys/class/tty/" + name + "/flags");
  if (!text || !text->starts_with("0x")) return std::nullopt;
  unsigned flags = 0;
  const auto [end, error] = std::from_chars(text->data() + 2, text->data() + text->size(), flags, 16);
  return error == std::errc{} ? std::optional(flags) : std::nullopt;
}

/// Asks the driver. Opening raises the modem lines as the flight does itself.
std::optional<unsigned> flags_from_driver(const std::string& device) {
  const int fd = open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return std::nullopt;
  serial_struct serial{};
  const int got = ioctl(fd, TIOCGSERIAL, &serial);
  close(fd);
  return got == 0 ? std::optional(static_cast<unsigned>(serial.flags)) : std::nullopt;
}

}  // namespace

Check check_tty(const DoctorPlan& plan) {
  Check c{"serial line", State::kOk, "",
          "a converter that collects bytes for 16 ms makes every attitude that much older"};
  if (plan.tty.empty()) {
    c.measured = "the autopilot is behind a socket";
    return c;
  }
  const std::string name = std::filesystem::path(plan.tty).filename().string();
  if (!plan.tree.exists("/sys/class/tty/" + name) && !plan.tree.exists(plan.tty)) {
    c.state = State::kUnknown;
    c.measured =
        plan.tty + " is not there: connect the autopilot, or name its line with --config FILE ([autopilot] endpoint)";
    return c;
  }
  const std::string timer = "/sys/bus/usb-serial/devices/" + name + "/latency_timer";
  const auto timer_ms = plan.tree.number(timer);
  auto flags = flags_from_sysfs(plan.tree, name);
  if (!flags && plan.tree.real() && plan.flight_under_way.empty()) flags = flags_from_driver(plan.tty);
  const bool low = flags && (*flags & kLowLatency) != 0;
  c.measured =
      fmt::format("{}: low-latency flag {}", plan.tty, flags ? (low ? "set" : "not set") : "not known to its driver");
  c.figures = {{"device", plan.tty}, {"low_latency", flags ? nlohmann::json(low) : nlohmann::json(nullptr)}};
  if (timer_ms) {
    c.measured += fmt::format(", latency timer {} ms", *timer_ms);
    c.figures["latency_timer_ms"] = *timer_ms;
    if (*timer_ms > 1) c.commands.push_back(fmt::format("echo 1 | sudo tee {}", timer));
  } else if (flags && !low) {
    c.commands.push_back(fmt::format("sudo setserial {} low_latency", plan.tty));
  }
  if (!c.commands.empty()) c.state = State::kWarn;
  return c;
}

Check check_usb(const DoctorPlan& plan) {
  Check c{"USB autosuspend", State::kOk, "",
          "a camera or converter that fell asleep answers late, or reconnects in flight"};
  const std::string folder = "/sys/bus/usb/devices";
  int devices = 0;
  for (const auto& name : plan.tree.names(folder)) {
    const auto control = plan.tree.text(fmt::format("{}/{}/power/control", folder, name));
    if (!control || name.find(':') != std::string::npos) continue;  // an interface, not a device
    ++devices;
    if (*control != "auto") continue;
    c.measured += fmt::format("{}{} {}", c.measured.empty() ? "may sleep: " : ", ", name,
                              plan.tree.text(fmt::format("{}/{}/product", folder, name)).value_or(""));
    c.commands.push_back(fmt::format("echo on | sudo tee {}/{}/power/control", folder, name));
  }
  c.figures = {{"devices", devices}, {"may_sleep", c.commands.size()}};
  if (c.measured.empty()) c.measured = devices == 0 ? "no USB devices" : fmt::format("off for all {} devices", devices);
  if (!c.commands.empty()) c.state = State::kWarn;
  return c;
}

}  // namespace wasp::tools
