#include "drivers/v4l2_camera.h"

#include <optional>

#include "drivers/exposure_time.h"
#include "drivers/jpeg_gray.h"
#include "drivers/v4l2_buffers.h"
#include "drivers/v4l2_device.h"
#include "drivers/v4l2_mode.h"
#include "drivers/v4l2_settings.h"
#include "rt/clock.h"

namespace wasp::drivers {
namespace {

constexpr int kMostErrors = 3;  ///< of DQBUF in a row; more, and the queue is broken until it is set up anew

/// The node to open: of the camera known from before, or the one asked for, or the only one.
V4l2Identity find_camera(const std::optional<V4l2Identity>& known, const std::string& wanted) {
  if (!known && wanted.starts_with("/dev/")) return {wanted, {}, {}, {}};
  std::vector<std::string> problems;
  std::vector<V4l2Identity> found;
  for (auto& camera : present_v4l2_devices(&problems))
    if (known ? camera.same_as(*known) : camera.answers_to(wanted)) found.push_back(std::move(camera));
  if (known && !found.empty()) return found.front();
  if (found.size() == 1) return found.front();
  const std::string name = known ? known->text() : wanted.empty() ? "v4l2 camera" : wanted;
  if (found.empty()) {
    std::string why = "not there";
    for (const auto& problem : problems) why += "; " + problem;
    throw CameraError(name, why, "plug it in; `wasp camera --list` shows what is there");
  }
  std::string several;
  for (const auto& camera : found) several += "\n  " + camera.node + "  " + camera.text();
  throw CameraError(name, "several cameras answer to that", "set [camera] device to one of these:" + several);
}

class V4l2Camera final : public CameraDriver {
 public:
  explicit V4l2Camera(const CameraRequest& request) : request_(request) {}
  ~V4l2Camera() override { close(); }

  void start(FrameSink& sink) override {
    sink_ = &sink;
    announce_ = [&sink] { sink.announce(); };
    buffers_.emplace(*device_);
    buffers_->start(request_.settings.buffers);
    errors_in_row_ = 0;
  }

  FrameEvent wait_frame(TimeNs deadline_ns) override {
    if (!buffers_) return FrameEvent::kGone;
    for (;;) {
      if (!buffers_->wait(deadline_ns)) return FrameEvent::kTimeout;
      v4l2_buffer buffer;
      switch (take_newest(buffer)) {
        case V4l2Take::kNone:
          if (rt::now() >= deadline_ns) return FrameEvent::kTimeout;
          rt::sleep_until(rt::now() + kMillisecond);  // woken for nothing: never spin
          continue;
        case V4l2Take::kDamaged:  // an error of the moment, or the queue's for good
          if (++errors_in_row_ > kMostErrors) return FrameEvent::kGone;
          rt::sleep_until(rt::now() + kMillisecond);
          return FrameEvent::kCorrupt;
        case V4l2Take::kGone:
          return FrameEvent::kGone;
        case V4l2Take::kFrame:
          break;
      }
      errors_in_row_ = 0;
      const bool good = deliver(buffer);
      buffers_->give_back(buffer);
      return good ? FrameEvent::kFrame : FrameEvent::kCorrupt;
    }
  }

  void close() noexcept override {
    buffers_.reset();
    device_.reset();
  }

 private:
  CameraFormat configure() override {
    device_.emplace(find_camera(identity_, request_.settings.device).node);
    const std::string& node = device_->identity().node;
    if (!device_->captures())
      throw CameraError(node, "captures no pictures through one plane", "see `wasp camera --list` for those that do");
    const V4l2Mode mode = choose_mode(device_->modes(request_.width_px, request_.height_px), request_, node);
    set_format(mode);
    const V4l2Settings settings = apply_settings(*device_, request_);
    exposure_ns_ = settings.exposure_ns;
    readout_ns_ = request_.settings.readout_us < 0
                      ? 0
                      : static_cast<DurationNs>(request_.settings.readout_us * static_cast<double>(kMicrosecond));
    identity_ = device_->identity();
    CameraFormat format;
    format.width_px = static_cast<int>(picture_.width);
    format.height_px = static_cast<int>(picture_.height);
    format.rate_hz = settings.rate_hz;
    format.pixels = pixels_->name;
    format.name = identity_->card;
    format.identity = identity_->text();
    format.node = node;
    format.settings = settings.text;
    return format;
  }

  void set_format(const V4l2Mode& mode) {
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    format.fmt.pix.width = static_cast<__u32>(mode.width_px);
    format.fmt.pix.height = static_cast<__u32>(mode.height_px);
    format.fmt.pix.pixelformat = mode.fourcc;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    device_->demand(VIDIOC_S_FMT, &format, "set " + mode_text(mode));
    picture_ = format.fmt.pix;
    pixels_ = find_pixels(picture_.pixelformat);
    if (pixels_ == nullptr)
      throw CameraError(device_->identity().node,
                        "gave " + fourcc_text(picture_.pixelformat) + " instead of " + mode_text(mode));
  }

  /// Older pictures that wait as well are passed over: a gap in the sequence tells.
  V4l2Take take_newest(v4l2_buffer& newest) {
    V4l2Take result = buffers_->take(newest);
    while (result == V4l2Take::kFrame) {
      v4l2_buffer later;
      if (buffers_->take(later) != V4l2Take::kFrame) break;
      buffers_->give_back(newest);
      newest = later;
    }
    return result;
  }

  bool deliver(const v4l2_buffer& buffer) {
    const TimeNs arrived_ns = rt::now();
    if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0 || !fill(buffers_->bytes(buffer))) return false;
    sink_->publish(stamp_of(buffer, arrived_ns));
    return true;
  }

  /// The picture into the slot; false if it is not whole.
  bool fill(std::span<const std::uint8_t> bytes) {
    const int width = static_cast<int>(picture_.width), height = static_cast<int>(picture_.height);
    std::uint8_t* gray = sink_->slot().gray;
    if (pixels_->jpeg) return jpeg_.decode(bytes, width, height, gray, announce_);
    const auto stride = static_cast<int>(picture_.bytesperline);
    if (bytes.size() < static_cast<std::size_t>(stride) * static_cast<std::size_t>(height)) return false;
    const PixelSource source{bytes.data(), width, height, stride, pixels_->layout};
    const int most = height - height / 4;  // what is left takes less than a reader's patience
    copy_gray_rows(source, 0, most, gray);
    sink_->announce();
    copy_gray_rows(source, most, height, gray);
    return true;
  }

  [[nodiscard]] FrameStamp stamp_of(const v4l2_buffer& buffer, TimeNs arrived_ns) const {
    FrameStamp stamp;
    stamp.sequence = buffer.sequence;
    const TimeNs told_ns = buffer.timestamp.tv_sec * kSecond + buffer.timestamp.tv_usec * kMicrosecond;
    const bool monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    const bool at_start = (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
    stamp.estimated = !monotonic || !believable_stamp(told_ns, arrived_ns);
    const StampSource source = at_start && !stamp.estimated ? StampSource::kStartOfExposure : StampSource::kEndOfFrame;
    stamp.exposed_at_ns =
        std::min(arrived_ns, mid_exposure(stamp.estimated ? arrived_ns : told_ns, source, exposure_ns_, readout_ns_));
    return stamp;
  }

  CameraRequest request_;
  std::optional<V4l2Identity> identity_;  ///< once it was open
  std::optional<V4l2Device> device_;
  std::optional<V4l2Buffers> buffers_;
  FrameSink* sink_ = nullptr;
  std::function<void()> announce_;
  v4l2_pix_format picture_{};
  const V4l2Pixels* pixels_ = nullptr;
  int errors_in_row_ = 0;
  DurationNs exposure_ns_ = 0, readout_ns_ = 0;
  JpegGray jpeg_;
};

}  // namespace

std::unique_ptr<CameraDriver> make_v4l2_camera(const CameraRequest& request) {
  return std::make_unique<V4l2Camera>(request);
}

std::vector<FoundCamera> list_v4l2_cameras() {
  std::vector<std::string> problems;
  std::vector<FoundCamera> found;
  for (const V4l2Identity& identity : present_v4l2_devices(&problems)) {
    FoundCamera camera{identity.node, identity.card, identity.text(), {}, {}};
    try {
      for (const auto& mode : V4l2Device(identity.node).modes(640, 480)) camera.formats.push_back(mode_text(mode));
    } catch (const CameraError& error) {
      camera.problem = error.what();
    }
    found.push_back(std::move(camera));
  }
  for (auto& problem : problems) found.push_back({problem.substr(0, problem.find(':')), {}, {}, {}, problem});
  return found;
}

}  // namespace wasp::drivers
