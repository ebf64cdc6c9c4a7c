#include "drivers/kinect_camera.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>
#include <utility>

#include "drivers/device_clock.h"
#include "drivers/exposure_pairs.h"
#include "drivers/kinect_depth.h"
#include "drivers/kinect_device.h"
#include "drivers/kinect_images.h"
#include "drivers/stamp_time.h"
#include "rt/clock.h"

namespace wasp::drivers {
namespace {

constexpr double kTicks_per_s = 60e6;
constexpr DurationNs kPeriodNs = kSecond / 30;
constexpr DurationNs kPacketNs = 125 * kMicrosecond;  // one a USB microframe

struct Choice {
  const char* name;
  int format;
  int packets;  ///< that an image takes; its stamp is the last one's
};
constexpr std::array kDepthChoices{Choice{"raw", FREENECT_DEPTH_11BIT, 242},
                                   Choice{"registered", FREENECT_DEPTH_REGISTERED, 242},
                                   Choice{"mm", FREENECT_DEPTH_MM, 242}};
constexpr std::array kVideoChoices{Choice{"rgb", FREENECT_VIDEO_RGB, 162}, Choice{"ir", FREENECT_VIDEO_IR_8BIT, 206}};

/// The first is what an empty name means.
template <std::size_t N>
const Choice& choose(const std::array<Choice, N>& choices, const std::string& name, const char* key) {
  std::string known;
  for (const Choice& choice : choices) {
    if (name.empty() || name == choice.name) return choice;
    known += std::string(known.empty() ? "\"" : ", \"") + choice.name + '"';
  }
  throw CameraError("kinect", std::string("[camera] ") + key + " \"" + name + "\" is none of its own: " + known);
}

/// The model of the settings. Throws CameraError where name, coefficients and range do not make one.
KinectDepthModel model_of(const CameraSettings& s) {
  KinectDepthModel model;
  if (!published_model(s.depth_model, model))
    throw CameraError("kinect", "[camera] depth_model \"" + s.depth_model + "\" is not known",
                      "two-gaussians, tangent or linear");
  const auto wanted = static_cast<std::size_t>(coefficient_count(model.kind));
  if (!s.depth_coefficients.empty()) {
    if (s.depth_coefficients.size() != wanted)
      throw CameraError("kinect", "[camera] depth_coefficients of \"" + s.depth_model + "\" are " +
                                      std::to_string(wanted) + ", not " + std::to_string(s.depth_coefficients.size()));
    std::copy(s.depth_coefficients.begin(), s.depth_coefficients.end(), model.coefficients.begin());
  }
  model.range = {s.depth_range_m[0], s.depth_range_m[1]};
  const KinectTable table = make_kinect_table(model);
  if (std::count(table.mm.begin(), table.mm.end(), 0) == kKinectRawValues)
    throw CameraError("kinect", "[camera] depth_coefficients give no depth within depth_range_m");
  return model;
}

class KinectCamera final : public CameraDriver {
 public:
  KinectCamera(const CameraRequest& request, const FreenectApi* library)
      : library_(library),
        settings_(request.settings),
        depth_(choose(kDepthChoices, settings_.depth_mode, "depth_mode")),
        video_(choose(kVideoChoices, settings_.pixel_format, "pixel_format")),
        table_(make_kinect_table(model_of(settings_))) {
    if (settings_.exposure_us > 0)
      throw CameraError("kinect", "libfreenect sets no exposure time", "set [camera] exposure_us = 0");
    if (settings_.trigger != "off") throw CameraError("kinect", "has no trigger", "set [camera] trigger = \"off\"");
    if (settings_.gain >= 0 && (video_.format != FREENECT_VIDEO_IR_8BIT || settings_.gain < 1 || settings_.gain > 50))
      throw CameraError("kinect", "has a gain for infrared only, 1 ... 50", "set [camera] gain = -1");
  }
  ~KinectCamera() override { close(); }

  void start(FrameSink& sink) override {
    sink_ = &sink;
    const FrameSlot slot = sink.slot();
    clock_ = DeviceClock(kTicks_per_s);
    stamps_ = StampTime(kTicks_per_s);
    pairs_ = ExposurePairs(kPeriodNs, slot.depth_mm != nullptr);
    last_sequence_ = 0;
    const TimeNs now_ns = rt::now();
    depth_stream_ = {slot.depth_mm != nullptr, now_ns, kNever};
    video_stream_ = {true, now_ns, kNever};
    streaming_ = true;
    freenect_device* device = device_->get();
    if (depth_stream_.on) {
      library_->set_depth_callback(
          device, [](freenect_device*, void*, std::uint32_t ticks) { serving->on_depth(ticks, rt::now()); });
      library_->set_depth_buffer(device, slot.depth_mm);
      if (library_->start_depth(device) < 0) device_->fail("cannot stream depth");
    }
    library_->set_video_callback(
        device, [](freenect_device*, void*, std::uint32_t ticks) { serving->on_video(ticks, rt::now()); });
    library_->set_video_buffer(device, video_pixels_.data());
    if (library_->start_video(device) < 0) device_->fail("cannot stream video");
  }

  FrameEvent wait_frame(TimeNs deadline_ns) override {
    if (!streaming_) return FrameEvent::kGone;
    came_ = FrameEvent::kTimeout;
    serving = this;
    for (;;) {
      const TimeNs now_ns = rt::now();
      if (pairs_.waiting() && now_ns >= patience_ends_ns_) release_waiting();
      if (came_ != FrameEvent::kTimeout) return came_;
      if (std::exchange(damaged_, false)) return FrameEvent::kCorrupt;  // if need be after the frame that came with it
      if (depth_stream_.stuck(now_ns) || video_stream_.stuck(now_ns)) return FrameEvent::kGone;
      const TimeNs until_ns = pairs_.waiting() ? std::min(deadline_ns, patience_ends_ns_) : deadline_ns;
      if (!device_->process(std::max<DurationNs>(0, until_ns - now_ns))) return FrameEvent::kGone;
      if (came_ == FrameEvent::kTimeout && !damaged_ && rt::now() >= deadline_ns) return FrameEvent::kTimeout;
    }
  }

  void close() noexcept override {
    if (device_ && streaming_) {
      library_->stop_depth(device_->get());
      library_->stop_video(device_->get());
    }
    streaming_ = false;
    device_.reset();
  }

  [[nodiscard]] std::string account() const override {
    const PairCounts& c = pairs_.counts();
    const double skew_ms = c.pairs == 0 ? 0 : 1e-6 * static_cast<double>(c.skew_sum_ns) / static_cast<double>(c.pairs);
    std::array<char, 192> text{};
    std::snprintf(text.data(), text.size(),
                  "%llu pairs, grey %+.1f ms from its depth; %llu depth and %llu grey images alone; clock %+.1f ppm",
                  static_cast<unsigned long long>(c.pairs), skew_ms, static_cast<unsigned long long>(c.lone_depth),
                  static_cast<unsigned long long>(c.lone_gray), 1e6 * clock_.drift());
    return text.data();
  }

 private:
  /// A stream that is silent for so long while the device is there hangs, as Kinects do: it is opened anew.
  static constexpr DurationNs kStuckNs = 2 * kSecond;

  struct Stream {
    bool on = false;
    TimeNs heard_at_ns = 0, last_place_ns = kNever;
    [[nodiscard]] bool stuck(TimeNs now_ns) const { return on && now_ns - heard_at_ns > kStuckNs; }
  };

  CameraFormat configure() override {
    if (library_ == nullptr) library_ = &freenect_library();
    device_.emplace(*library_, serial_.empty() ? settings_.device : serial_);
    const freenect_frame_mode depth = device_->set_depth(static_cast<freenect_depth_format>(depth_.format), depth_.name);
    const freenect_frame_mode video = device_->set_video(static_cast<freenect_video_format>(video_.format), video_.name);
    const bool infrared = video.video_format == FREENECT_VIDEO_IR_8BIT;
    if (depth.bytes != 2 * kKinectPixels || video.bytes != (infrared ? kKinectWidth * kInfraredRows : 3 * kKinectPixels))
      device_->fail("delivers images of another size than 640 x 480");
    video_pixels_.resize(static_cast<std::size_t>(video.bytes));
    if (settings_.gain >= 1 && library_->set_ir_brightness != nullptr)
      library_->set_ir_brightness(device_->get(), static_cast<std::uint16_t>(settings_.gain));
    serial_ = device_->serial();
    CameraFormat format;
    format.width_px = kKinectWidth;
    format.height_px = kKinectHeight;
    format.rate_hz = depth.framerate;
    format.depth = true;
    format.pixels = std::string(video_.name) + ", depth " + depth_.name;
    format.name = "Kinect";
    format.identity = serial_.empty() ? "kinect" : "kinect " + serial_;
    format.node = "usb";
    format.settings = std::string("depth model ") + settings_.depth_model;
    return format;
  }

  /// An exposure: what is published, and its place among the others by the device's own count alone, which no delay on
  /// the way can shift.
  struct Dated {
    FrameStamp stamp;
    TimeNs place_ns = 0;
  };

  /// When the image was exposed; none, counted as damaged, if packets of it were lost or it is not newer than the last.
  std::optional<Dated> date(std::uint32_t ticks, TimeNs now_ns, KinectStream which, const Choice& choice,
                            Stream& stream) {
    const auto packets = std::exchange(device_->log().packets[static_cast<std::size_t>(which)], {});
    stream.heard_at_ns = now_ns;
    const DurationNs readout_ns = settings_.readout_us >= 0
                                      ? static_cast<DurationNs>(settings_.readout_us * kMicrosecond)
                                      : choice.packets * kPacketNs;
    Dated dated;
    dated.place_ns = stamps_.at(ticks, now_ns) - readout_ns;
    dated.stamp.estimated = !clock_.add(ticks, now_ns);
    dated.stamp.exposed_at_ns = (dated.stamp.estimated ? now_ns : clock_.to_local(ticks)) - readout_ns;
    if (!packets.whole() || dated.place_ns <= stream.last_place_ns) {
      damaged_ = true;
      return std::nullopt;
    }
    stream.last_place_ns = dated.place_ns;
    return dated;
  }

  void on_depth(std::uint32_t ticks, TimeNs now_ns) {
    std::optional<Dated> dated = date(ticks, now_ns, KinectStream::kDepth, depth_, depth_stream_);
    if (!dated) return release_waiting();
    std::uint16_t* pixels = sink_->slot().depth_mm;
    sink_->announce();
    if (depth_.format == FREENECT_DEPTH_11BIT)
      kinect_depth(table_, {pixels, kKinectWidth, kKinectHeight, kKinectWidth}, pixels, kKinectWidth);
    else
      keep_range(pixels);
    const ExposureStamp place = pairs_.add_depth(dated->place_ns);
    if (!pairs_.waits_for_newest()) release_waiting();
    depth_stamp_ = dated->stamp;
    depth_stamp_.gray = false;
    publish(depth_stamp_, place);
    library_->set_depth_buffer(device_->get(), sink_->slot().depth_mm);
    release_waiting();
  }

  void on_video(std::uint32_t ticks, TimeNs now_ns) {
    std::optional<Dated> dated = date(ticks, now_ns, KinectStream::kVideo, video_, video_stream_);
    if (!dated) return;
    release_waiting();
    std::uint8_t* gray = sink_->slot().gray;
    if (video_.format == FREENECT_VIDEO_IR_8BIT)
      crop_infrared(video_pixels_.data(), gray);
    else
      rgb_to_gray(video_pixels_.data(), kKinectPixels, gray);
    gray_stamp_ = dated->stamp;
    gray_stamp_.depth = false;
    patience_ends_ns_ = now_ns + kPeriodNs;
    if (const auto place = pairs_.add_gray(dated->place_ns)) publish_gray(*place);
  }

  /// The grey image that waits in its slot for its depth.
  void release_waiting() {
    if (const auto place = pairs_.take_waiting()) publish_gray(*place);
  }

  /// With its depth image's time if it has one.
  void publish_gray(const ExposureStamp& place) {
    FrameStamp stamp = gray_stamp_;
    if (place.exposed_at_ns == depth_stream_.last_place_ns) {
      stamp.exposed_at_ns = depth_stamp_.exposed_at_ns;
      stamp.estimated = depth_stamp_.estimated;
    }
    publish(stamp, place);
  }

  void publish(FrameStamp stamp, const ExposureStamp& place) {
    stamp.sequence = last_sequence_ = std::max(last_sequence_, place.sequence);
    sink_->publish(stamp);
    came_ = FrameEvent::kFrame;
  }

  /// The library's own millimetres: 0 outside the range.
  void keep_range(std::uint16_t* mm) const {
    const auto least = static_cast<std::uint16_t>(1000 * settings_.depth_range_m[0]);
    const auto greatest = static_cast<std::uint16_t>(1000 * settings_.depth_range_m[1]);
    for (int i = 0; i < kKinectPixels; ++i) mm[i] = mm[i] >= least && mm[i] <= greatest ? mm[i] : std::uint16_t{0};
  }

  static thread_local KinectCamera* serving;  ///< whose wait_frame lets the library call back

  const FreenectApi* library_;
  CameraSettings settings_;
  Choice depth_, video_;
  KinectTable table_;
  std::optional<KinectDevice> device_;
  std::string serial_;  ///< of the Kinect that was opened first
  std::vector<std::uint8_t> video_pixels_;
  FrameSink* sink_ = nullptr;
  DeviceClock clock_{kTicks_per_s};
  StampTime stamps_{kTicks_per_s};
  ExposurePairs pairs_{kPeriodNs, true};
  Stream depth_stream_, video_stream_;
  FrameStamp depth_stamp_, gray_stamp_;  ///< of the newest images
  TimeNs patience_ends_ns_ = 0;
  std::uint32_t last_sequence_ = 0;
  bool streaming_ = false;
  FrameEvent came_ = FrameEvent::kTimeout;
  bool damaged_ = false;  ///< an image, not yet told
};

thread_local KinectCamera* KinectCamera::serving = nullptr;

}  // namespace

std::unique_ptr<CameraDriver> make_kinect_camera(const CameraRequest& request) {
  return std::make_unique<KinectCamera>(request, nullptr);
}

std::unique_ptr<CameraDriver> make_kinect_camera(const CameraRequest& request, const FreenectApi& library) {
  return std::make_unique<KinectCamera>(request, &library);
}

std::vector<FoundCamera> list_kinect_cameras() {
  std::vector<FoundCamera> found;
  try {
    const FreenectApi& api = freenect_library();
    freenect_context* context = nullptr;
    if (api.init(&context, nullptr) < 0) return {};
    api.set_log_level(context, FREENECT_LOG_FATAL);
    for (const std::string& serial : kinect_serials(api, context))
      found.push_back({serial, "Kinect", serial.empty() ? "kinect" : "kinect " + serial,
                       {"rgb 640x480 30 Hz, depth raw | registered | mm", "ir 640x480 30 Hz"}, {}});
    api.shutdown(context);
  } catch (const CameraError& error) {
    found.push_back({"", "Kinect", "kinect", {}, error.what()});
  }
  return found;
}

}  // namespace wasp::drivers
