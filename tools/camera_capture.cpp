#include "tools/camera_capture.h"

#include <algorithm>

#include <fmt/format.h>

#include "rt/clock.h"

namespace wasp::tools {

using drivers::CameraError;
using drivers::CameraState;
using drivers::FrameEvent;

void check_promise(const drivers::CameraFormat& format, const drivers::CameraRequest& request, bool depth) {
  const std::string who = format.node + " (" + format.name + ")";
  if (format.width_px != request.width_px || format.height_px != request.height_px)
    throw CameraError(who,
                      fmt::format("delivers {} x {}, but [camera] says {} x {}", format.width_px, format.height_px,
                                  request.width_px, request.height_px),
                      "set width_px and height_px, and the intrinsics of that size");
  constexpr double kRateSlack = 1.03;
  if (format.rate_hz > request.rate_hz * kRateSlack)
    throw CameraError(
        who, fmt::format("delivers {:.4g} Hz, but the flight plans for {:.4g}", format.rate_hz, request.rate_hz),
        fmt::format("set [camera] rate_hz = {:.4g}", format.rate_hz));
  if (depth && !format.depth) throw CameraError(who, "delivers no depth images");
}

CameraCapture::CameraCapture(std::string name, const drivers::CameraDriverRow& row,
                             const drivers::CameraRequest& request, CameraRings& rings, scheduling::EventQueue& events)
    : name_(std::move(name)), request_(request), rings_(rings), events_(events), driver_(row.make(request)) {
  const std::string_view driver = row.name;
  driver.copy(rings_.status().driver.data(), rings_.status().driver.size() - 1);
}

drivers::CameraFormat CameraCapture::open() {
  drivers::CameraStatus& status = rings_.status();
  status.state = static_cast<std::uint32_t>(CameraState::kStarting);
  drivers::CameraFormat format = driver_->open();
  try {
    check_promise(format, request_, rings_.slot().depth_mm != nullptr);
    rings_.opened();
    driver_->start(rings_);
  } catch (...) {
    driver_->close();
    throw;
  }
  status.name.fill(0);
  format.identity.copy(status.name.data(), status.name.size() - 1);
  status.state = static_cast<std::uint32_t>(CameraState::kStreaming);
  opened_at_ns_ = last_frame_ns_ = rt::now();
  return format;
}

/// Three frames late is late; short enough to be told to stop, long enough not to count a slow camera's pauses.
DurationNs CameraCapture::longest_wait() const {
  return std::clamp(from_seconds(3 / request_.rate_hz), 50 * kMillisecond, 500 * kMillisecond);
}

void CameraCapture::run(const std::atomic<bool>& stop) {
  while (!stop.load(std::memory_order_relaxed)) {
    if (lost_at_ns_ != kNever) {
      search(stop);
      continue;
    }
    const FrameEvent event = driver_->wait_frame(rt::now() + longest_wait());
    note(event, rt::now());
  }
  account_ = driver_->account();
  driver_->close();
}

void CameraCapture::note(FrameEvent event, TimeNs now_ns) {
  switch (event) {
    case FrameEvent::kFrame:
      last_frame_ns_ = now_ns;
      return;
    case FrameEvent::kCorrupt:
      rings_.note_corrupt();
      break;
    case FrameEvent::kTimeout:
      drivers::count(rings_.status().timeouts);
      break;
    case FrameEvent::kGone:
      return lose("gone");
  }
  const bool triggered = request_.settings.trigger != "off";  // silence is the trigger's then
  if (!triggered && now_ns - last_frame_ns_ > kPatience)
    lose(event == FrameEvent::kCorrupt ? "nothing but damaged frames" : "silent");
}

void CameraCapture::lose(const char* why) {
  rings_.status().state = static_cast<std::uint32_t>(CameraState::kGone);
  lost_at_ns_ = rt::now();
  said_.clear();
  events_.say(lost_at_ns_, name_ + ": " + why + ", looking for it");
  driver_->close();
}

bool CameraCapture::find_again() {
  try {
    const drivers::CameraFormat format = open();
    drivers::count(rings_.status().reopened);
    events_.say(rt::now(),
                fmt::format("{}: back after {:.1f} s at {}", name_, to_seconds(rt::now() - lost_at_ns_), format.node));
    lost_at_ns_ = kNever;
    return true;
  } catch (const std::exception& error) {
    rings_.status().state = static_cast<std::uint32_t>(CameraState::kGone);
    if (said_ != error.what()) events_.say(rt::now(), name_ + ": ", error.what());
    said_ = error.what();
    return false;
  }
}

void CameraCapture::search(const std::atomic<bool>& stop) {
  // One that goes as soon as it is open must not spin.
  if (lost_at_ns_ - opened_at_ns_ < kSecond) rt::sleep_until(rt::now() + kSearchPeriod);
  while (!stop.load(std::memory_order_relaxed) && !find_again()) rt::sleep_until(rt::now() + kSearchPeriod);
}

}  // namespace wasp::tools
