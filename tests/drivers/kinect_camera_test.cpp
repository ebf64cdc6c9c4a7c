// The Kinect driver over a scripted libfreenect: what a device does that fakenect cannot do.
#include "drivers/kinect_camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <thread>
#include <utility>

#include "drivers/freenect_api.h"
#include "drivers/kinect_depth.h"
#include "drivers/kinect_images.h"
#include "rt/clock.h"

namespace wasp::drivers {
namespace {

/// The library and the device behind it. One at a time.
struct Script {
  enum class Kind { kDepth, kVideo, kLog, kGone };
  struct Event {
    Kind kind;
    std::uint32_t ticks = 0;
    int value = 0;     ///< all pixels
    const char* text;  ///< kLog
  };
  std::deque<Event> events;
  std::vector<std::string> serials{"A00366A08793039A"};
  bool refuse_open = false, depth_on = false, video_on = false, opened = false;
  std::string opened_serial;
  freenect_frame_mode depth_mode{}, video_mode{};
  void *depth_buffer = nullptr, *video_buffer = nullptr;
  std::vector<void*> depth_buffers;
  freenect_depth_cb depth_cb = nullptr;
  freenect_video_cb video_cb = nullptr;
  freenect_log_cb log_cb = nullptr;
  int ir_brightness = 0, contexts = 0;
  TimeNs first_at_ns = kNever;
  std::uint32_t first_ticks = 0;

  /// Images arrive when they are stamped, later ones not sooner.
  void pace(std::uint32_t ticks) {
    if (first_at_ns == kNever) first_at_ns = rt::now(), first_ticks = ticks;
    const auto ahead = static_cast<std::int32_t>(ticks - first_ticks);
    if (ahead > 0) rt::sleep_until(first_at_ns + ahead * std::int64_t{1000} / 60);
  }

  void depth(std::uint32_t ticks, int value) { events.push_back({Kind::kDepth, ticks, value, ""}); }
  void video(std::uint32_t ticks, int value) { events.push_back({Kind::kVideo, ticks, value, ""}); }
  void log(const char* text) { events.push_back({Kind::kLog, 0, 0, text}); }
  void gone() { events.push_back({Kind::kGone, 0, 0, ""}); }
};
Script* script = nullptr;
auto* const kDevice = reinterpret_cast<freenect_device*>(0x1234);
auto* const kContext = reinterpret_cast<freenect_context*>(0x5678);

freenect_frame_mode depth_mode_of(int i) {
  constexpr freenect_depth_format formats[] = {FREENECT_DEPTH_11BIT, FREENECT_DEPTH_REGISTERED, FREENECT_DEPTH_MM};
  freenect_frame_mode mode{};
  mode.resolution = FREENECT_RESOLUTION_MEDIUM;
  mode.depth_format = formats[i];
  mode.bytes = 640 * 480 * 2, mode.width = 640, mode.height = 480, mode.framerate = 30, mode.is_valid = 1;
  return mode;
}

freenect_frame_mode video_mode_of(int i) {
  freenect_frame_mode mode{};
  mode.resolution = FREENECT_RESOLUTION_MEDIUM;
  mode.video_format = i == 0 ? FREENECT_VIDEO_RGB : FREENECT_VIDEO_IR_8BIT;
  mode.width = 640, mode.height = i == 0 ? 480 : 488, mode.framerate = 30, mode.is_valid = 1;
  mode.bytes = i == 0 ? 640 * 480 * 3 : 640 * 488;
  return mode;
}

void fill(void* buffer, int bytes, const Script::Event& e) {
  if (e.kind == Script::Kind::kVideo) {
    std::memset(buffer, e.value, static_cast<std::size_t>(bytes));
    if (script->video_mode.video_format == FREENECT_VIDEO_IR_8BIT)  // rows tell themselves apart
      for (int row = 0; row < 488; ++row) static_cast<std::uint8_t*>(buffer)[row * 640] = static_cast<std::uint8_t>(row);
    return;
  }
  auto* pixels = static_cast<std::uint16_t*>(buffer);
  std::fill(pixels, pixels + 640 * 480, static_cast<std::uint16_t>(e.value));
}

int process(freenect_context*, timeval* timeout) {
  if (script->events.empty()) {
    std::this_thread::sleep_for(std::chrono::microseconds(
        std::min<long>(2000, timeout->tv_sec * 1000000 + timeout->tv_usec)));
    return 0;
  }
  const Script::Event e = script->events.front();
  script->events.pop_front();
  if (e.kind == Script::Kind::kDepth || e.kind == Script::Kind::kVideo) script->pace(e.ticks);
  switch (e.kind) {
    case Script::Kind::kGone:
      return -4;
    case Script::Kind::kLog:
      script->log_cb(kContext, FREENECT_LOG_SPEW, e.text);
      break;
    case Script::Kind::kDepth:
      if (!script->depth_on) break;
      fill(script->depth_buffer, script->depth_mode.bytes, e);
      script->depth_cb(kDevice, script->depth_buffer, e.ticks);
      break;
    case Script::Kind::kVideo:
      fill(script->video_buffer, script->video_mode.bytes, e);
      script->video_cb(kDevice, script->video_buffer, e.ticks);
      break;
  }
  return 0;
}

FreenectApi scripted() {
  FreenectApi api;
  api.init = [](freenect_context** c, freenect_usb_context*) { return *c = kContext, ++script->contexts, 0; };
  api.shutdown = [](freenect_context*) { return --script->contexts, 0; };
  api.set_log_level = [](freenect_context*, freenect_loglevel) {};
  api.set_log_callback = [](freenect_context*, freenect_log_cb cb) { script->log_cb = cb; };
  api.select_subdevices = [](freenect_context*, freenect_device_flags) {};
  api.num_devices = [](freenect_context*) { return static_cast<int>(script->serials.size()); };
  api.open_device = [](freenect_context*, freenect_device**, int) { return -1; };
  api.open_device_by_camera_serial = [](freenect_context* c, freenect_device** d, const char* serial) {
    const bool there = std::count(script->serials.begin(), script->serials.end(), serial) > 0;
    if (!there || script->refuse_open) {
      script->log_cb(c, FREENECT_LOG_ERROR, "Could not open camera: LIBUSB_ERROR_ACCESS\n");
      return -1;
    }
    *d = kDevice;
    script->opened = true;
    script->opened_serial = serial;
    return 0;
  };
  api.close_device = [](freenect_device*) { return script->opened = false, 0; };
  api.set_depth_callback = [](freenect_device*, freenect_depth_cb cb) { script->depth_cb = cb; };
  api.set_video_callback = [](freenect_device*, freenect_video_cb cb) { script->video_cb = cb; };
  api.set_depth_buffer = [](freenect_device*, void* b) {
    script->depth_buffers.push_back(b);
    return script->depth_buffer = b, 0;
  };
  api.set_video_buffer = [](freenect_device*, void* b) { return script->video_buffer = b, 0; };
  api.get_depth_mode_count = [] { return 3; };
  api.get_depth_mode = depth_mode_of;
  api.get_video_mode_count = [] { return 2; };
  api.get_video_mode = video_mode_of;
  api.set_depth_mode = [](freenect_device*, freenect_frame_mode m) { return script->depth_mode = m, 0; };
  api.set_video_mode = [](freenect_device*, freenect_frame_mode m) { return script->video_mode = m, 0; };
  api.start_depth = [](freenect_device*) { return script->depth_on = true, 0; };
  api.start_video = [](freenect_device*) { return script->video_on = true, 0; };
  api.stop_depth = [](freenect_device*) { return script->depth_on = false, 0; };
  api.stop_video = [](freenect_device*) { return script->video_on = false, 0; };
  api.process_events_timeout = process;
  api.list_device_attributes = [](freenect_context*, freenect_device_attributes** list) {
    *list = nullptr;
    for (const auto& serial : script->serials) *list = new freenect_device_attributes{*list, serial.c_str()};
    return static_cast<int>(script->serials.size());
  };
  api.free_device_attributes = [](freenect_device_attributes* list) {
    while (list != nullptr) delete std::exchange(list, list->next);
  };
  api.set_ir_brightness = [](freenect_device*, std::uint16_t b) { return script->ir_brightness = b, 0; };
  return api;
}

/// Slots in memory; keeps what was published.
struct Sink final : FrameSink {
  struct Out {
    FrameStamp stamp;
    int gray = -1, depth_mm = -1;  ///< of the pixel in the middle
    std::vector<std::uint8_t> gray_rows;
  };
  bool wants_depth = true;
  std::array<std::vector<std::uint8_t>, 2> gray{std::vector<std::uint8_t>(kKinectPixels),
                                                std::vector<std::uint8_t>(kKinectPixels)};
  std::array<std::vector<std::uint16_t>, 2> depth{std::vector<std::uint16_t>(kKinectPixels),
                                                  std::vector<std::uint16_t>(kKinectPixels)};
  std::size_t gray_at = 0, depth_at = 0;
  std::vector<Out> out;

  FrameSlot slot() override { return {gray[gray_at].data(), wants_depth ? depth[depth_at].data() : nullptr}; }
  void announce() override {}
  void publish(const FrameStamp& stamp) override {
    Out one{stamp, -1, -1, {}};
    constexpr std::size_t kMiddle = 240 * 640 + 320;
    if (stamp.depth && wants_depth) one.depth_mm = depth[depth_at][kMiddle], depth_at ^= 1;
    if (stamp.gray) {
      one.gray = gray[gray_at][kMiddle];
      one.gray_rows = {gray[gray_at][0], gray[gray_at][479 * 640]};
      gray_at ^= 1;
    }
    out.push_back(one);
  }
};

struct KinectCamera : testing::Test {
  Script the_script;
  FreenectApi api = scripted();
  Sink sink;
  CameraRequest request;
  std::unique_ptr<CameraDriver> camera;

  KinectCamera() { script = &the_script; }
  ~KinectCamera() override {
    camera.reset();
    script = nullptr;
  }
  void begin() {
    camera = make_kinect_camera(request, api);
    camera->open();
    camera->start(sink);
  }
  /// Works the script off; every event that was not a time-out.
  std::vector<FrameEvent> play() {
    std::vector<FrameEvent> events;
    while (!script->events.empty() || events.empty() || events.back() != FrameEvent::kTimeout)
      events.push_back(camera->wait_frame(rt::now() + 60 * kMillisecond));
    events.pop_back();
    return events;
  }
};

constexpr std::uint32_t kFrameTicks = 2'000'000;

TEST_F(KinectCamera, RawDepthGoesThroughTheLibraryIntoTheSlotAndOutInMillimetres) {
  begin();
  for (std::uint32_t i = 0; i < 4; ++i) {
    script->depth(1000 + i * kFrameTicks, 700 + static_cast<int>(i));
    script->video(1000 + i * kFrameTicks + 100'000, 50 + static_cast<int>(i));
  }
  script->depth(1000 + 4 * kFrameTicks, 2047);
  play();
  const KinectTable table = make_kinect_table(kMagnenatTangent);
  ASSERT_EQ(sink.out.size(), 9u);
  for (std::size_t i = 0; i < 4; ++i) {
    const Sink::Out &depth = sink.out[2 * i], &gray = sink.out[2 * i + 1];
    EXPECT_TRUE(depth.stamp.depth && !depth.stamp.gray && gray.stamp.gray && !gray.stamp.depth);
    EXPECT_EQ(depth.depth_mm, table.mm[700 + i]);
    EXPECT_EQ(gray.gray, 50 + static_cast<int>(i));
    EXPECT_EQ(depth.stamp.sequence, i);
    EXPECT_EQ(gray.stamp.sequence, i);
    EXPECT_EQ(gray.stamp.exposed_at_ns, depth.stamp.exposed_at_ns);
  }
  EXPECT_EQ(sink.out[8].depth_mm, 0);
  for (void* buffer : script->depth_buffers)
    EXPECT_TRUE(buffer == sink.depth[0].data() || buffer == sink.depth[1].data()) << "not the ring's memory";
  EXPECT_NE(camera->account().find("4 pairs"), std::string::npos) << camera->account();
}

TEST_F(KinectCamera, RegisteredMillimetresAreLeftAloneWithinTheRange) {
  request.settings.depth_mode = "registered";
  begin();
  EXPECT_EQ(script->depth_mode.depth_format, FREENECT_DEPTH_REGISTERED);
  std::uint32_t ticks = 0;
  for (const int mm : {1234, 399, 7001, 0, 400, 7000}) script->depth(ticks += kFrameTicks, mm);
  play();
  std::vector<int> got;
  for (const auto& one : sink.out) got.push_back(one.depth_mm);
  EXPECT_EQ(got, (std::vector<int>{1234, 0, 0, 0, 400, 7000}));
}

TEST_F(KinectCamera, InfraredIsCroppedToTheRowsOfTheDepthImage) {
  request.settings.pixel_format = "ir";
  request.settings.gain = 20;
  begin();
  EXPECT_EQ(script->ir_brightness, 20);
  script->depth(0, 800);
  script->video(1000, 77);
  play();
  ASSERT_EQ(sink.out.size(), 2u);
  EXPECT_EQ(sink.out[1].gray, 77);
  EXPECT_EQ(sink.out[1].gray_rows, (std::vector<std::uint8_t>{4, static_cast<std::uint8_t>(483)}));
}

TEST_F(KinectCamera, AGrayImageBeforeItsDepthWaitsForIt) {
  begin();
  for (std::uint32_t i = 0; i < 3; ++i) {
    // Readout differs by 80 packets of 125 us: a grey image exposed with its depth is stamped 600,000 ticks earlier.
    script->video(5'000'000 + i * kFrameTicks - 600'000, 60 + static_cast<int>(i));
    script->depth(5'000'000 + i * kFrameTicks, 700);
  }
  play();
  ASSERT_EQ(sink.out.size(), 6u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_TRUE(sink.out[2 * i].stamp.depth);
    EXPECT_EQ(sink.out[2 * i + 1].gray, 60 + static_cast<int>(i));
    EXPECT_EQ(sink.out[2 * i + 1].stamp.sequence, sink.out[2 * i].stamp.sequence);
  }
}

TEST_F(KinectCamera, ImagesAloneArePublishedAloneAndCounted) {
  begin();
  script->depth(0, 700);
  script->video(1000, 1);
  script->video(kFrameTicks, 2);      // its depth image is lost
  script->depth(2 * kFrameTicks, 701);  // its grey image is lost
  script->depth(3 * kFrameTicks, 702);
  script->video(3 * kFrameTicks, 3);
  play();
  std::vector<std::uint32_t> depth, gray;
  for (const auto& one : sink.out) (one.stamp.depth ? depth : gray).push_back(one.stamp.sequence);
  EXPECT_EQ(depth, (std::vector<std::uint32_t>{0, 2, 3}));
  EXPECT_EQ(gray, (std::vector<std::uint32_t>{0, 1, 3}));
  EXPECT_NE(camera->account().find("1 depth and 1 grey images alone"), std::string::npos) << camera->account();
}

TEST_F(KinectCamera, AnImageWithLostPacketsIsNotPublished) {
  begin();
  script->log("Got depth frame of size 422400/422400, 242/242 packets arrived, TS 00000000\n");
  script->depth(0, 700);
  script->log("Got depth frame of size 422400/422400, 239/242 packets arrived, TS 001e8480\n");
  script->depth(kFrameTicks, 701);
  script->log("Got video frame of size 307200/307200, 161/162 packets arrived, TS 001e8480\n");
  script->video(kFrameTicks, 9);
  script->depth(2 * kFrameTicks, 702);
  const std::vector<FrameEvent> events = play();
  EXPECT_EQ(std::count(events.begin(), events.end(), FrameEvent::kCorrupt), 2);
  ASSERT_EQ(sink.out.size(), 2u);
  EXPECT_EQ(sink.out[0].stamp.sequence, 0u);
  EXPECT_EQ(sink.out[1].stamp.sequence, 2u) << "a gap where the damaged one was";
}

TEST_F(KinectCamera, AnImageStampedNoLaterThanTheLastIsDamaged) {
  begin();
  script->depth(4 * kFrameTicks, 700);
  script->depth(4 * kFrameTicks, 700);
  script->depth(3 * kFrameTicks, 700);
  script->depth(5 * kFrameTicks, 701);
  const std::vector<FrameEvent> events = play();
  EXPECT_EQ(std::count(events.begin(), events.end(), FrameEvent::kCorrupt), 2);
  EXPECT_EQ(sink.out.size(), 2u);
}

TEST_F(KinectCamera, StampsWrapWithoutATrace) {
  begin();
  std::uint32_t ticks = UINT32_MAX - 3 * kFrameTicks;
  for (int i = 0; i < 8; ++i) {
    script->depth(ticks += kFrameTicks, 700);
    camera->wait_frame(rt::now() + kSecond);
  }
  ASSERT_EQ(sink.out.size(), 8u);
  for (std::size_t i = 1; i < 8; ++i) {
    EXPECT_EQ(sink.out[i].stamp.sequence, i);
    EXPECT_GT(sink.out[i].stamp.exposed_at_ns, sink.out[i - 1].stamp.exposed_at_ns);
    EXPECT_FALSE(sink.out[i].stamp.estimated);
  }
}

TEST_F(KinectCamera, ReadoutIsTakenOffTheStamp) {
  request.settings.readout_us = 10'000;
  begin();
  script->depth(0, 700);
  const TimeNs before_ns = rt::now();
  play();
  ASSERT_FALSE(sink.out.empty());
  EXPECT_GE(sink.out[0].stamp.exposed_at_ns, before_ns - 10 * kMillisecond);
  EXPECT_LE(sink.out[0].stamp.exposed_at_ns, rt::now() - 10 * kMillisecond);
}

TEST_F(KinectCamera, ComesBackByItsSerialNumberOnly) {
  begin();
  script->depth(0, 700);
  play();
  script->gone();
  EXPECT_EQ(camera->wait_frame(rt::now() + kSecond), FrameEvent::kGone);
  camera->close();
  EXPECT_FALSE(script->opened);
  EXPECT_EQ(script->contexts, 0);
  script->serials = {"B00000000000000B"};  // another Kinect in its place
  EXPECT_THROW(camera->open(), CameraError);
  EXPECT_EQ(script->contexts, 0) << "a failed open leaves nothing open";
  script->serials = {"B00000000000000B", "A00366A08793039A"};
  EXPECT_EQ(camera->open().identity, "kinect A00366A08793039A");
  camera->start(sink);
  script->depth(77, 705);
  play();
  EXPECT_EQ(sink.out.back().stamp.sequence, 0u) << "the count begins anew";
}

TEST_F(KinectCamera, SaysWhyItCannotBeUsed) {
  const auto reason = [this](auto&& change) {
    request = {};
    change();
    try {
      make_kinect_camera(request, api)->open();
    } catch (const CameraError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  const auto says = [](const std::string& text, const char* what) { return text.find(what) != std::string::npos; };
  EXPECT_PRED2(says, reason([this] { request.settings.depth_mode = "12bit"; }), "depth_mode \"12bit\"");
  EXPECT_PRED2(says, reason([this] { request.settings.pixel_format = "YUYV"; }), "pixel_format \"YUYV\"");
  EXPECT_PRED2(says, reason([this] { request.settings.exposure_us = 5000; }), "exposure");
  EXPECT_PRED2(says, reason([this] { request.settings.gain = 3; }), "gain");
  EXPECT_PRED2(says, reason([this] { request.settings.depth_coefficients = {1, 2}; }), "are 3, not 2");
  EXPECT_PRED2(says, reason([this] { request.settings.depth_model = "cubic"; }), "not known");
  EXPECT_PRED2(says, reason([this] { request.settings.depth_coefficients = {0, 2842.5, -0.1}; }), "no depth within");
  EXPECT_PRED2(says, reason([this] { request.settings.device = "C"; }), "LIBUSB_ERROR_ACCESS");
  EXPECT_PRED2(says, reason([] { script->serials = {"A", "B"}; }), "several Kinects");
  EXPECT_PRED2(says, reason([] { script->serials = {}; }), "no Kinect is plugged in");
}

TEST_F(KinectCamera, WithoutADepthRingOnlyVideoRuns) {
  sink.wants_depth = false;
  begin();
  EXPECT_FALSE(script->depth_on);
  for (std::uint32_t i = 0; i < 3; ++i) script->video(i * kFrameTicks, 40 + static_cast<int>(i));
  play();
  ASSERT_EQ(sink.out.size(), 3u);
  EXPECT_EQ(sink.out[2].gray, 42);
}

TEST(KinectImages, GreyStaysGreyAndColourIsWeighed) {
  std::vector<std::uint8_t> rgb, want;
  for (int v = 0; v < 256; ++v) {
    rgb.insert(rgb.end(), 3, static_cast<std::uint8_t>(v));
    want.push_back(static_cast<std::uint8_t>(v));
  }
  for (const auto& c : {std::array<int, 3>{255, 0, 0}, {0, 255, 0}, {0, 0, 255}, {10, 200, 90}}) {
    for (const int x : c) rgb.push_back(static_cast<std::uint8_t>(x));
    want.push_back(static_cast<std::uint8_t>(std::lround(0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2])));
  }
  std::vector<std::uint8_t> gray(want.size());
  rgb_to_gray(rgb.data(), static_cast<int>(gray.size()), gray.data());
  for (std::size_t i = 0; i < want.size(); ++i) EXPECT_NEAR(gray[i], want[i], i < 256 ? 0 : 1) << i;
}

}  // namespace
}  // namespace wasp::drivers
