// libdc1394 with a camera that is not there, preloaded in the place of the library: every function that the driver
// calls, answered by the script (scripted_camera.h). Properties:
//
//   guid 00b09d0100aabbcc     model NAME
//   format MONO8 640 480 30 15           a fixed mode and its rates       format F7 752 480    Format 7, its sensor
//   absolute 0            shutter and gain without real units
//   shutter_us 4000       of the automatic exposure
//   packets 40            of a frame: 125 us each on the bus
//   bandwidth none        capture cannot be set up
//   stamp none            frames without a time stamp, as those of the USB back end
// clock_step makes the wall clock jump for the whole program.
#include <dc1394/dc1394.h>
#include <dlfcn.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ctime>
#include <deque>

#include "tests/cameras/scripted_camera.h"

namespace {

using wasp::test::CameraScript;
using wasp::test::ScriptedCamera;

std::atomic<long> wall_step_s{0};

struct Mode {
  dc1394video_mode_t mode = DC1394_VIDEO_MODE_640x480_MONO8;
  int width = 0, height = 0;
  std::vector<double> rates;
};

class Camera final : public ScriptedCamera {
 public:
  Camera()
      : ScriptedCamera(CameraScript::load()), guid(std::stoull(script.text("guid", "00b09d0100aabbcc"), nullptr, 16)) {
    for (const auto& line : script.formats) add_mode(line);
    model = script.text("model", "Scripted IIDC");
    camera.guid = guid;
    camera.vendor = vendor.data();
    camera.model = model.data();
  }
  ~Camera() override { stop(); }

  dc1394error_t set_up(std::uint32_t count) {
    if (script.text("bandwidth") == "none") return DC1394_NO_BANDWIDTH;
    if (!present()) return DC1394_FAILURE;
    int pair[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0) return DC1394_FAILURE;
    fd = pair[0];
    peer = pair[1];
    gone = false;
    images.assign(count,
                  std::vector<unsigned char>(static_cast<std::size_t>(stride()) * static_cast<std::size_t>(height)));
    frames.assign(count, {});
    damaged.assign(count, false);
    queued.clear();
    done.clear();
    for (std::uint32_t i = 0; i < count; ++i) {
      describe(i);
      queued.push_back(i);
    }
    return DC1394_SUCCESS;
  }
  void tear_down() {
    stop();
    for (int* f : {&fd, &peer}) {
      if (*f >= 0) close(*f);
      *f = -1;
    }
  }
  dc1394error_t dequeue(dc1394video_frame_t** out) {
    const std::lock_guard lock(mutex);
    *out = nullptr;
    if (gone) return DC1394_FAILURE;
    if (done.empty()) return DC1394_SUCCESS;
    char byte;
    (void)!recv(fd, &byte, 1, MSG_DONTWAIT);
    *out = &frames[done.front()];
    done.pop_front();
    return DC1394_SUCCESS;
  }
  dc1394error_t enqueue(const dc1394video_frame_t& frame) {
    const std::lock_guard lock(mutex);
    if (gone) return DC1394_FAILURE;
    queued.push_back(frame.id);
    changed.notify_all();
    return DC1394_SUCCESS;
  }
  bool present() {
    const std::lock_guard lock(mutex);
    return plugged();
  }
  [[nodiscard]] int stride() const { return width + 16; }  // padded, as vendors do

  std::uint64_t guid;
  std::string vendor = "Nobody", model;
  dc1394camera_t camera{};
  std::vector<Mode> modes;
  int width = 640, height = 480;
  dc1394framerate_t framerate = DC1394_FRAMERATE_30;
  std::uint32_t packet_bytes = 0, generation = 1;
  float shutter_s = 0, gain_db = 0;
  bool trigger = false;
  int fd = -1, peer = -1;
  bool gone = false;
  std::vector<std::vector<unsigned char>> images;
  std::vector<dc1394video_frame_t> frames;
  std::vector<bool> damaged;
  std::deque<std::size_t> queued, done;

 protected:
  bool idle() const override { return done.empty() && queued.size() == frames.size(); }
  void emit(std::uint32_t n, bool spoil) override {
    const std::size_t index = queued.front();
    queued.pop_front();
    unsigned char* const image = images[index].data();
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) image[y * stride() + x] = wasp::test::scripted_pixel(n, x, y);
    damaged[index] = spoil;
    timespec wall{}, mono{};
    clock_gettime(CLOCK_REALTIME, &wall);
    clock_gettime(CLOCK_MONOTONIC, &mono);
    const std::int64_t late_us = (mono.tv_sec * 1'000'000'000 + mono.tv_nsec - due_ns()) / 1000;
    const std::int64_t wall_us = wall.tv_sec * 1'000'000 + wall.tv_nsec / 1000;
    frames[index].timestamp = script.text("stamp") == "none" ? 0 : static_cast<std::uint64_t>(wall_us - late_us);
    done.push_back(index);
  }
  void wake() override {
    const char one = 1;
    if (peer >= 0) (void)!send(peer, &one, 1, MSG_DONTWAIT | MSG_NOSIGNAL);
  }
  void vanish(const std::string&) override {
    gone = true;
    shutdown(peer, SHUT_RDWR);
  }
  void reset_bus() override { ++generation; }
  void step_clock(int seconds) override { wall_step_s += seconds; }

 private:
  void add_mode(const std::string& line) {
    std::istringstream words(line);
    std::string kind;
    Mode m;
    words >> kind >> m.width >> m.height;
    for (double rate = 0; words >> rate;) m.rates.push_back(rate);
    m.mode = kind == "F7"     ? DC1394_VIDEO_MODE_FORMAT7_0
             : m.width == 640 ? DC1394_VIDEO_MODE_640x480_MONO8
                              : DC1394_VIDEO_MODE_1024x768_MONO8;
    modes.push_back(m);
  }
  void describe(std::uint32_t i) {
    dc1394video_frame_t& f = frames[i];
    f.image = images[i].data();
    f.size[0] = static_cast<std::uint32_t>(width);
    f.size[1] = static_cast<std::uint32_t>(height);
    f.stride = static_cast<std::uint32_t>(stride());
    f.color_coding = DC1394_COLOR_CODING_MONO8;
    f.image_bytes = f.stride * f.size[1];
    f.total_bytes = f.image_bytes;
    f.packets_per_frame = static_cast<std::uint32_t>(script.number("packets", 0));
    f.camera = &camera;
    f.id = i;
  }
};

Camera& the() {
  static auto* const camera = new Camera;  // outlives every thread of the program
  return *camera;
}

bool absolute() { return the().script.number("absolute", 1) != 0; }

const Mode* find_mode(dc1394video_mode_t mode) {
  for (const auto& m : the().modes)
    if (m.mode == mode) return &m;
  return nullptr;
}

dc1394framerate_t rate_code(double hz) {
  return static_cast<dc1394framerate_t>(DC1394_FRAMERATE_1_875 + std::lround(std::log2(hz / 1.875)));
}

}  // namespace

extern "C" {

int clock_gettime(clockid_t clock, timespec* t) noexcept {
  using Real = int (*)(clockid_t, timespec*);
  static const auto real = reinterpret_cast<Real>(dlsym(RTLD_NEXT, "clock_gettime"));
  const int result = real(clock, t);
  if (clock == CLOCK_REALTIME) t->tv_sec += wall_step_s;
  return result;
}

dc1394_t* dc1394_new() { return reinterpret_cast<dc1394_t*>(&the()); }
void dc1394_free(dc1394_t*) {}
dc1394error_t dc1394_log_register_handler(dc1394log_t, void (*)(dc1394log_t, const char*, void*), void*) {
  return DC1394_SUCCESS;
}
const char* dc1394_error_get_string(dc1394error_t error) {
  return error == DC1394_NO_BANDWIDTH ? "not enough bandwidth" : "failure";
}
dc1394error_t dc1394_camera_enumerate(dc1394_t*, dc1394camera_list_t** list) {
  *list = new dc1394camera_list_t{0, nullptr};
  if (the().present() && !the().modes.empty()) {
    (*list)->num = 1;
    (*list)->ids = new dc1394camera_id_t[1]{{0, the().guid}};
  }
  return DC1394_SUCCESS;
}
void dc1394_camera_free_list(dc1394camera_list_t* list) {
  delete[] list->ids;
  delete list;
}
dc1394camera_t* dc1394_camera_new(dc1394_t*, uint64_t guid) {
  return guid == the().guid && the().present() ? &the().camera : nullptr;
}
void dc1394_camera_free(dc1394camera_t*) {}
dc1394error_t dc1394_camera_get_node(dc1394camera_t*, uint32_t* node, uint32_t* generation) {
  const std::lock_guard lock(the().mutex);
  *node = 0;
  *generation = the().generation;
  return DC1394_SUCCESS;
}

dc1394error_t dc1394_video_get_supported_modes(dc1394camera_t*, dc1394video_modes_t* out) {
  out->num = 0;
  for (const auto& m : the().modes) out->modes[out->num++] = m.mode;
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_video_get_supported_framerates(dc1394camera_t*, dc1394video_mode_t mode, dc1394framerates_t* out) {
  const Mode* m = find_mode(mode);
  if (m == nullptr) return DC1394_INVALID_VIDEO_MODE;
  out->num = 0;
  for (const double rate : m->rates) out->framerates[out->num++] = rate_code(rate);
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_video_set_mode(dc1394camera_t*, dc1394video_mode_t mode) {
  const Mode* m = find_mode(mode);
  if (m == nullptr) return DC1394_INVALID_VIDEO_MODE;
  the().width = m->width;
  the().height = m->height;
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_video_set_framerate(dc1394camera_t*, dc1394framerate_t rate) {
  the().framerate = rate;
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_video_get_framerate(dc1394camera_t*, dc1394framerate_t* rate) {
  *rate = the().framerate;
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_video_set_iso_speed(dc1394camera_t*, dc1394speed_t) { return DC1394_SUCCESS; }
dc1394error_t dc1394_video_set_transmission(dc1394camera_t*, dc1394switch_t power) {
  power == DC1394_ON ? the().start() : the().stop();
  return DC1394_SUCCESS;
}

dc1394error_t dc1394_format7_get_color_codings(dc1394camera_t*, dc1394video_mode_t, dc1394color_codings_t* codings) {
  codings->num = 2;
  codings->codings[0] = DC1394_COLOR_CODING_RAW8;
  codings->codings[1] = DC1394_COLOR_CODING_MONO8;
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_format7_get_max_image_size(dc1394camera_t*, dc1394video_mode_t mode, uint32_t* w, uint32_t* h) {
  const Mode* m = find_mode(mode);
  if (m == nullptr) return DC1394_INVALID_VIDEO_MODE;
  *w = static_cast<uint32_t>(m->width);
  *h = static_cast<uint32_t>(m->height);
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_format7_get_unit_size(dc1394camera_t*, dc1394video_mode_t, uint32_t* w, uint32_t* h) {
  *w = *h = 4;
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_format7_get_unit_position(dc1394camera_t*, dc1394video_mode_t, uint32_t* x, uint32_t* y) {
  *x = *y = 2;
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_format7_set_roi(dc1394camera_t*, dc1394video_mode_t, dc1394color_coding_t, int32_t bytes,
                                     int32_t left, int32_t top, int32_t width, int32_t height) {
  if (left % 2 != 0 || top % 2 != 0) return DC1394_INVALID_ARGUMENT_VALUE;
  the().packet_bytes = bytes > 0 ? static_cast<uint32_t>(bytes) : 4096;
  the().width = width;
  the().height = height;
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_format7_get_packet_parameters(dc1394camera_t*, dc1394video_mode_t, uint32_t* unit,
                                                   uint32_t* most) {
  *unit = 4;
  *most = 4096;
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_format7_get_packets_per_frame(dc1394camera_t*, dc1394video_mode_t, uint32_t* packets) {
  const auto bytes = static_cast<uint32_t>(the().width * the().height);
  *packets = (bytes + the().packet_bytes - 1) / the().packet_bytes;
  return DC1394_SUCCESS;
}

dc1394error_t dc1394_feature_get_modes(dc1394camera_t*, dc1394feature_t, dc1394feature_modes_t* modes) {
  modes->num = 2;
  modes->modes[0] = DC1394_FEATURE_MODE_MANUAL;
  modes->modes[1] = DC1394_FEATURE_MODE_AUTO;
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_feature_set_mode(dc1394camera_t*, dc1394feature_t, dc1394feature_mode_t) { return DC1394_SUCCESS; }
dc1394error_t dc1394_feature_has_absolute_control(dc1394camera_t*, dc1394feature_t, dc1394bool_t* has) {
  *has = absolute() ? DC1394_TRUE : DC1394_FALSE;
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_feature_set_absolute_control(dc1394camera_t*, dc1394feature_t, dc1394switch_t) {
  return absolute() ? DC1394_SUCCESS : DC1394_FAILURE;
}
dc1394error_t dc1394_feature_get_absolute_boundaries(dc1394camera_t*, dc1394feature_t feature, float* low,
                                                     float* high) {
  *low = 0;
  *high = feature == DC1394_FEATURE_SHUTTER ? 0.05f : 24;
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_feature_set_absolute_value(dc1394camera_t*, dc1394feature_t feature, float value) {
  (feature == DC1394_FEATURE_SHUTTER ? the().shutter_s : the().gain_db) = value;
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_feature_get_absolute_value(dc1394camera_t*, dc1394feature_t feature, float* value) {
  const float automatic = static_cast<float>(the().script.number("shutter_us", 0)) * 1e-6f;
  *value = feature != DC1394_FEATURE_SHUTTER ? the().gain_db : the().shutter_s > 0 ? the().shutter_s : automatic;
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_feature_get_boundaries(dc1394camera_t*, dc1394feature_t, uint32_t* low, uint32_t* high) {
  *low = 16;
  *high = 64;
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_feature_set_value(dc1394camera_t*, dc1394feature_t, uint32_t value) {
  the().gain_db = static_cast<float>(value);
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_feature_get_value(dc1394camera_t*, dc1394feature_t, uint32_t* value) {
  *value = static_cast<uint32_t>(the().gain_db);
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_external_trigger_set_power(dc1394camera_t*, dc1394switch_t power) {
  the().trigger = power == DC1394_ON;
  return DC1394_SUCCESS;
}
dc1394error_t dc1394_external_trigger_set_mode(dc1394camera_t*, dc1394trigger_mode_t) { return DC1394_SUCCESS; }

dc1394error_t dc1394_capture_setup(dc1394camera_t*, uint32_t buffers, uint32_t) { return the().set_up(buffers); }
dc1394error_t dc1394_capture_stop(dc1394camera_t*) {
  the().tear_down();
  return DC1394_SUCCESS;
}
int dc1394_capture_get_fileno(dc1394camera_t*) { return the().fd; }
dc1394error_t dc1394_capture_dequeue(dc1394camera_t*, dc1394capture_policy_t policy, dc1394video_frame_t** frame) {
  if (policy != DC1394_CAPTURE_POLICY_POLL) std::abort();  // would wait in the library
  return the().dequeue(frame);
}
dc1394error_t dc1394_capture_enqueue(dc1394camera_t*, dc1394video_frame_t* frame) { return the().enqueue(*frame); }
dc1394bool_t dc1394_capture_is_frame_corrupt(dc1394camera_t*, dc1394video_frame_t* frame) {
  return the().damaged[frame->id] ? DC1394_TRUE : DC1394_FALSE;
}
}
