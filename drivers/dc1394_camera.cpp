#include "drivers/dc1394_camera.h"

#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <ctime>
#include <optional>

#include "drivers/dc1394_bus.h"
#include "drivers/dc1394_settings.h"
#include "drivers/exposure_time.h"
#include "drivers/pixel_rows.h"
#include "drivers/wall_clock_map.h"
#include "rt/clock.h"

namespace wasp::drivers {
namespace {

constexpr DurationNs kCycle = 125 * kMicrosecond;  // one packet of a frame in each

ClockPair clocks_now() {
  timespec wall{};
  clock_gettime(CLOCK_REALTIME, &wall);
  return {rt::now(), wall.tv_sec * kSecond + wall.tv_nsec};
}

/// The camera known from before, or the one asked for, or the only one.
std::uint64_t find_guid(const Dc1394Bus& bus, std::optional<std::uint64_t> known, const std::string& wanted) {
  std::vector<std::uint64_t> found;
  for (const std::uint64_t guid : bus.guids())
    if (known ? guid == *known : guid_text(guid).find(wanted) != std::string::npos) found.push_back(guid);
  if (found.size() == 1) return found.front();
  const std::string name = "dc1394 " + (known ? guid_text(*known) : wanted.empty() ? "camera" : wanted);
  if (found.empty()) {
    const std::string problem = bus_problem();
    throw CameraError(name, "not there", problem.empty() ? "plug it in; see `wasp camera --list`" : problem);
  }
  std::string several;
  for (const std::uint64_t guid : found) several += "\n  " + guid_text(guid);
  throw CameraError(name, "several cameras answer to that", "set [camera] device to one of these:" + several);
}

class Dc1394Camera final : public CameraDriver {
 public:
  explicit Dc1394Camera(const CameraRequest& request) : request_(request) {}
  ~Dc1394Camera() override { close(); }

  void start(FrameSink& sink) override {
    sink_ = &sink;
    device_->demand(dc1394_capture_setup(device_->get(), static_cast<std::uint32_t>(request_.settings.buffers),
                                         DC1394_CAPTURE_FLAGS_DEFAULT),
                    "set up its frame memory");
    capturing_ = true;
    device_->demand(dc1394_video_set_transmission(device_->get(), DC1394_ON), "start it");
    generation_ = device_->generation();
    sequence_ = 0;
    last_stamp_ns_ = kNever;
  }

  FrameEvent wait_frame(TimeNs deadline_ns) override {
    if (!capturing_) return FrameEvent::kGone;
    for (;;) {
      dc1394video_frame_t* frame = nullptr;
      if (!take_newest(frame)) return FrameEvent::kGone;
      if (frame != nullptr) return deliver(frame);
      switch (wait(deadline_ns)) {
        case Wait::kReady:
          continue;
        case Wait::kGone:
          return FrameEvent::kGone;
        case Wait::kTimeout:
          break;
      }
      // After a bus reset channel and bandwidth are no longer ours: the stream must be set up anew.
      return device_->generation() != generation_ ? FrameEvent::kGone : FrameEvent::kTimeout;
    }
  }

  void close() noexcept override {
    if (capturing_) {
      dc1394_video_set_transmission(device_->get(), DC1394_OFF);
      dc1394_capture_stop(device_->get());
    }
    capturing_ = false;
    device_.reset();
    bus_.reset();
  }

 private:
  enum class Wait { kReady, kTimeout, kGone };

  CameraFormat configure() override {
    bus_.emplace();
    device_.emplace(*bus_, find_guid(*bus_, guid_, request_.settings.device));
    mode_ = set_mode(*device_, request_);
    const Dc1394Features features = set_features(*device_, request_);
    exposure_ns_ = features.exposure_ns;
    guid_ = device_->get()->guid;
    CameraFormat format;
    format.width_px = mode_.width_px;
    format.height_px = mode_.height_px;
    format.rate_hz = mode_.rate_hz;
    format.pixels = mode_.pixels;
    format.name = device_->name();
    format.identity = device_->identity();
    format.node = guid_text(*guid_);
    format.settings = features.text + ", " + std::to_string(mode_.rate_hz).substr(0, 6) + " Hz" +
                      (request_.settings.trigger == "off" ? "" : ", trigger " + request_.settings.trigger);
    return format;
  }

  [[nodiscard]] Wait wait(TimeNs deadline_ns) const {
    const timespec left = rt::to_timespec(std::max<DurationNs>(0, deadline_ns - rt::now()));
    pollfd waiter{dc1394_capture_get_fileno(device_->get()), POLLIN, 0};
    const int ready = ppoll(&waiter, 1, &left, nullptr);
    if (ready == 0) return Wait::kTimeout;
    if (ready < 0) return errno == EINTR ? Wait::kReady : Wait::kGone;
    return (waiter.revents & POLLIN) != 0 ? Wait::kReady : Wait::kGone;
  }

  /// Takes what the DMA ring holds, without waiting, and gives all but the newest back; nullptr: nothing is there.
  /// False: the device is gone.
  bool take_newest(dc1394video_frame_t*& newest) {
    newest = nullptr;
    for (int i = 0; i < request_.settings.buffers; ++i) {
      dc1394video_frame_t* frame = nullptr;
      const dc1394error_t error = dc1394_capture_dequeue(device_->get(), DC1394_CAPTURE_POLICY_POLL, &frame);
      if (error != DC1394_SUCCESS && frame == nullptr) {
        if (newest != nullptr) dc1394_capture_enqueue(device_->get(), newest);
        return false;
      }
      if (frame == nullptr) break;
      if (newest != nullptr) dc1394_capture_enqueue(device_->get(), newest);
      newest = frame;
      ++taken_;
    }
    return true;
  }

  FrameEvent deliver(dc1394video_frame_t* frame) {
    const ClockPair arrived = clocks_now();
    const bool damaged = dc1394_capture_is_frame_corrupt(device_->get(), frame) == DC1394_TRUE || !whole(*frame);
    const FrameStamp stamp = stamp_of(*frame, arrived);
    if (!damaged) copy(*frame);
    const bool returned = dc1394_capture_enqueue(device_->get(), frame) == DC1394_SUCCESS;
    if (!damaged) sink_->publish(stamp);
    return damaged ? FrameEvent::kCorrupt : returned ? FrameEvent::kFrame : FrameEvent::kGone;
  }

  [[nodiscard]] bool whole(const dc1394video_frame_t& f) const {
    return f.image != nullptr && static_cast<int>(f.size[0]) == mode_.width_px &&
           static_cast<int>(f.size[1]) == mode_.height_px && f.stride >= f.size[0] &&
           f.total_bytes >= static_cast<std::uint64_t>(f.stride) * f.size[1];
  }

  void copy(const dc1394video_frame_t& f) {
    const PixelSource source{f.image, mode_.width_px, mode_.height_px, static_cast<int>(f.stride), {}};
    std::uint8_t* gray = sink_->slot().gray;
    const int most = mode_.height_px - mode_.height_px / 4;  // what is left takes less than a reader's patience
    copy_gray_rows(source, 0, most, gray);
    sink_->announce();
    copy_gray_rows(source, most, mode_.height_px, gray);
  }

  /// The stamp is taken when the last packet of a frame arrives; before it the bus carried the frame, a packet a cycle.
  FrameStamp stamp_of(const dc1394video_frame_t& f, const ClockPair& arrived) {
    FrameStamp stamp;
    const auto told_ns = f.timestamp == 0
                             ? std::nullopt
                             : clock_.to_monotonic(static_cast<std::int64_t>(f.timestamp) * kMicrosecond, arrived);
    stamp.estimated = !told_ns;
    const TimeNs end_ns = told_ns.value_or(arrived.monotonic_ns);
    const double asked_us = request_.settings.readout_us;
    const DurationNs readout_ns = asked_us < 0 ? static_cast<DurationNs>(f.packets_per_frame) * kCycle
                                               : static_cast<DurationNs>(asked_us * static_cast<double>(kMicrosecond));
    stamp.exposed_at_ns = mid_exposure(end_ns, StampSource::kEndOfFrame, exposure_ns_, readout_ns);
    stamp.sequence = sequence_ += frames_since_last(end_ns, stamp.estimated);
    taken_ = 0;
    last_stamp_ns_ = stamp.estimated ? kNever : end_ns;
    return stamp;
  }

  /// The bus numbers no frames: those taken since the last one, or more where the time between them says so.
  [[nodiscard]] std::uint32_t frames_since_last(TimeNs end_ns, bool estimated) const {
    if (estimated || last_stamp_ns_ == kNever || mode_.rate_hz <= 0 || request_.settings.trigger != "off")
      return taken_;
    const long periods = std::lround(to_seconds(end_ns - last_stamp_ns_) * mode_.rate_hz);
    return std::max(taken_, static_cast<std::uint32_t>(std::clamp(periods, 0l, 100'000l)));
  }

  CameraRequest request_;
  std::optional<std::uint64_t> guid_;  ///< once it was open
  std::optional<Dc1394Bus> bus_;
  std::optional<Dc1394Device> device_;
  Dc1394Mode mode_;
  FrameSink* sink_ = nullptr;
  bool capturing_ = false;
  std::uint32_t generation_ = 0, sequence_ = 0, taken_ = 0;
  DurationNs exposure_ns_ = 0;
  TimeNs last_stamp_ns_ = kNever;
  WallClockMap clock_;
};

}  // namespace

std::unique_ptr<CameraDriver> make_dc1394_camera(const CameraRequest& request) {
  return std::make_unique<Dc1394Camera>(request);
}

std::vector<FoundCamera> list_dc1394_cameras() {
  std::vector<FoundCamera> found;
  try {
    const Dc1394Bus bus;
    for (const std::uint64_t guid : bus.guids()) {
      FoundCamera camera{guid_text(guid), {}, guid_text(guid), {}, {}};
      try {
        const Dc1394Device device(bus, guid);
        camera.name = device.name();
        camera.identity = device.identity();
        camera.formats = mode_lines(device);
      } catch (const CameraError& error) {
        camera.problem = error.what();
      }
      found.push_back(std::move(camera));
    }
    if (const std::string problem = bus_problem(); found.empty() && !problem.empty())
      found.push_back({"dc1394", {}, {}, {}, problem});
  } catch (const CameraError&) {
    // no bus at all: no cameras
  }
  return found;
}

}  // namespace wasp::drivers
