// A V4L2 device that is not there, preloaded into a program: open, access, ioctl, mmap and close of its node are
// answered here by the script (scripted_camera.h), and poll works on a real descriptor. Properties:
//
//   node /dev/video2      card NAME       bus ADDRESS
//   format GREY 640 480 100 [50 ...]      one for each pixel format and size
//   deliver 320 240       what it sets whatever is asked for
//   stride 704            bytes a row; default: none to spare
//   open EACCES|EBUSY     every open fails so;   busy 1: frame memory is refused
//   stamp eof|soe|wild|wall               end of frame (default), start of exposure, absurd, wall clock
//   exposure 50           of V4L2_CID_EXPOSURE_ABSOLUTE, 100 us each; default: no such control
//   jpeg FILE             MJPG frames are this file
// Damaged frames: by turns the error flag, too few bytes, an error of DQBUF (EIO).
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdarg>
#include <cstring>
#include <deque>
#include <iterator>
#include <memory>

#include "tests/cameras/scripted_camera.h"

namespace {

using wasp::test::CameraScript;
using wasp::test::ScriptedCamera;

template <class F>
F real(const char* name) {
  return reinterpret_cast<F>(dlsym(RTLD_NEXT, name));
}

struct Format {
  std::uint32_t fourcc = 0;
  int width = 0, height = 0;
  std::vector<int> rates;
};

Format parse_format(const std::string& line) {
  std::istringstream words(line);
  std::string name;
  Format f;
  words >> name >> f.width >> f.height;
  name.resize(4, ' ');
  f.fourcc = v4l2_fourcc(name[0], name[1], name[2], name[3]);
  for (int rate = 0; words >> rate;) f.rates.push_back(rate);
  return f;
}

void put(__u8* to, std::size_t room, const std::string& text) {
  std::memset(to, 0, room);
  std::memcpy(to, text.data(), std::min(room - 1, text.size()));
}

struct Buffer {
  std::uint8_t* memory = nullptr;
  v4l2_buffer header{};
  bool eio = false;
};

class Device final : public ScriptedCamera {
 public:
  Device() : ScriptedCamera(CameraScript::load()), node(script.text("node", "/dev/video0")) {
    for (const auto& line : script.formats) formats.push_back(parse_format(line));
    std::ifstream file(script.text("jpeg"), std::ios::binary);
    jpeg.assign(std::istreambuf_iterator<char>(file), {});
    if (!formats.empty()) format = formats.front();
  }
  ~Device() override { stop(); }

  int open_node() {
    const std::string refusal = script.text("open");
    if (refusal == "EACCES") return errno = EACCES, -1;
    if (refusal == "EBUSY") return errno = EBUSY, -1;
    const std::lock_guard lock(mutex);
    if (!plugged()) return errno = ENOENT, -1;
    int pair[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0) return -1;
    fd = pair[0];
    peer = pair[1];
    gone = false;
    return fd;
  }
  void close_node() {
    stop();
    if (peer >= 0) real<int (*)(int)>("close")(peer);
    peer = fd = -1;
    release();
  }
  void release() {
    queued.clear();
    done.clear();
    for (auto& b : buffers) munmap(b.memory, size());
    buffers.clear();
  }

  [[nodiscard]] bool is_jpeg() const { return format.fourcc == V4L2_PIX_FMT_MJPEG; }
  [[nodiscard]] int stride() const {
    const int tight = format.width * (format.fourcc == V4L2_PIX_FMT_YUYV ? 2 : 1);
    return is_jpeg() ? 0 : script.number("stride", tight);
  }
  [[nodiscard]] std::size_t size() const {
    if (is_jpeg()) return std::max<std::size_t>(jpeg.size(), 4096);
    const auto plane = static_cast<std::size_t>(stride()) * static_cast<std::size_t>(format.height);
    return format.fourcc == V4L2_PIX_FMT_NV12 ? plane * 3 / 2 : plane;
  }

  int request(unsigned long what, void* argument);

  std::string node;
  std::vector<Format> formats;
  Format format;
  int rate = 0;
  int fd = -1, peer = -1;
  bool gone = false, anew = true;
  std::uint32_t first = 0;  ///< frame since the stream was started: the device counts from 0 each time
  int exposure_auto = 1;
  std::vector<char> jpeg;
  std::vector<Buffer> buffers;
  std::deque<std::size_t> queued, done;

 protected:
  bool idle() const override { return done.empty() && queued.size() == buffers.size(); }
  void emit(std::uint32_t n, bool damaged) override {
    if (queued.empty()) return;
    const std::size_t index = queued.front();
    queued.pop_front();
    Buffer& b = buffers[index];
    fill(b, n);
    if (anew) first = n;
    anew = false;
    b.header.sequence = n - first;
    b.header.flags = 0;
    b.eio = false;
    stamp(b.header);
    if (damaged) spoil(b);
    done.push_back(index);
  }
  void wake() override {
    const char one = 1;
    if (peer >= 0) (void)!send(peer, &one, 1, MSG_DONTWAIT | MSG_NOSIGNAL);
  }
  void vanish(const std::string& place) override {
    gone = true;
    if (!place.empty()) node = place;
    shutdown(peer, SHUT_RDWR);
  }

 private:
  void fill(Buffer& b, std::uint32_t n) {
    using wasp::test::scripted_pixel;
    b.header.bytesused = static_cast<__u32>(is_jpeg() ? jpeg.size() : size());
    if (is_jpeg()) {
      std::memcpy(b.memory, jpeg.data(), jpeg.size());
      return;
    }
    const int step = format.fourcc == V4L2_PIX_FMT_YUYV ? 2 : 1;
    std::memset(b.memory, 0x55, size());
    for (int y = 0; y < format.height; ++y)
      for (int x = 0; x < format.width; ++x) b.memory[y * stride() + x * step] = scripted_pixel(n, x, y);
  }
  void stamp(v4l2_buffer& b) const {
    const std::string kind = script.text("stamp", "eof");
    timespec now{};
    clock_gettime(kind == "wall" ? CLOCK_REALTIME : CLOCK_MONOTONIC, &now);
    b.flags |= kind == "wall" ? V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN : V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    if (kind == "soe") b.flags |= V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
    b.timestamp.tv_sec = now.tv_sec + (kind == "wild" ? 3600 : 0);
    b.timestamp.tv_usec = now.tv_nsec / 1000;
  }
  void spoil(Buffer& b) {
    switch (spoiled_++ % 3) {
      case 0:
        b.header.flags |= V4L2_BUF_FLAG_ERROR;
        return;
      case 1:
        b.header.bytesused /= 2;
        return;
      default:
        b.eio = true;
    }
  }
  int dequeue(v4l2_buffer& out);
  int enumerate_sizes(v4l2_frmsizeenum& s) const;
  int enumerate_rates(v4l2_frmivalenum& s) const;
  int set_format(v4l2_pix_format& p);
  int control(v4l2_control& c, bool set);
  int allocate(v4l2_requestbuffers& r);

  int spoiled_ = 0;
};

int fail(int error) {
  errno = error;
  return -1;
}

int Device::dequeue(v4l2_buffer& out) {
  if (done.empty()) return fail(EAGAIN);
  char byte;
  (void)!recv(fd, &byte, 1, MSG_DONTWAIT);
  const std::size_t index = done.front();
  done.pop_front();
  if (buffers[index].eio) {
    queued.push_back(index);
    return fail(EIO);
  }
  out = buffers[index].header;
  return 0;
}

int Device::enumerate_sizes(v4l2_frmsizeenum& s) const {
  __u32 seen = 0;
  for (const auto& f : formats)
    if (f.fourcc == s.pixel_format && seen++ == s.index) {
      s.type = V4L2_FRMSIZE_TYPE_DISCRETE;
      s.discrete = {static_cast<__u32>(f.width), static_cast<__u32>(f.height)};
      return 0;
    }
  return fail(EINVAL);
}

int Device::enumerate_rates(v4l2_frmivalenum& s) const {
  for (const auto& f : formats)
    if (f.fourcc == s.pixel_format && f.width == static_cast<int>(s.width) && f.height == static_cast<int>(s.height) &&
        s.index < f.rates.size()) {
      s.type = V4L2_FRMIVAL_TYPE_DISCRETE;
      s.discrete = {1, static_cast<__u32>(f.rates[s.index])};
      return 0;
    }
  return fail(EINVAL);
}

int Device::set_format(v4l2_pix_format& p) {
  for (const auto& f : formats)
    if (f.fourcc == p.pixelformat && f.width == static_cast<int>(p.width) && f.height == static_cast<int>(p.height))
      format = f;
  if (const std::string other = script.text("deliver"); !other.empty()) {
    std::istringstream words(other);
    words >> format.width >> format.height;
  }
  p.width = static_cast<__u32>(format.width);
  p.height = static_cast<__u32>(format.height);
  p.pixelformat = format.fourcc;
  p.bytesperline = static_cast<__u32>(stride());
  p.sizeimage = static_cast<__u32>(size());
  return 0;
}

int Device::control(v4l2_control& c, bool set) {
  const int exposure = script.number("exposure", 0);
  if (exposure == 0) return fail(EINVAL);
  if (c.id == V4L2_CID_EXPOSURE_AUTO) {
    if (set) exposure_auto = c.value;
    c.value = exposure_auto;
    return 0;
  }
  if (c.id != V4L2_CID_EXPOSURE_ABSOLUTE) return fail(EINVAL);
  if (set) script.properties["exposure"] = std::to_string(c.value);
  c.value = script.number("exposure", 0);
  return 0;
}

int Device::allocate(v4l2_requestbuffers& r) {
  if (script.number("busy", 0) != 0) return fail(EBUSY);
  if (r.memory != V4L2_MEMORY_MMAP) return fail(EINVAL);
  release();
  for (__u32 i = 0; i < r.count; ++i) {
    Buffer b;
    b.memory =
        static_cast<std::uint8_t*>(mmap(nullptr, size(), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
    b.header.index = i;
    b.header.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    b.header.memory = V4L2_MEMORY_MMAP;
    b.header.length = static_cast<__u32>(size());
    b.header.m.offset = i << 12;
    buffers.push_back(b);
  }
  return 0;
}

int Device::request(unsigned long what, void* argument) {
  if (what == VIDIOC_STREAMOFF) {
    stop();
    return 0;
  }
  if (what == VIDIOC_STREAMON) {
    anew = true;
    start();
    return 0;
  }
  const std::lock_guard lock(mutex);
  if (gone) return fail(ENODEV);
  switch (what) {
    case VIDIOC_QUERYCAP: {
      auto& c = *static_cast<v4l2_capability*>(argument);
      c = {};
      put(c.card, sizeof c.card, script.text("card", "Scripted Camera"));
      put(c.bus_info, sizeof c.bus_info, script.text("bus", "usb-standin-1"));
      c.device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
      c.capabilities = c.device_caps | V4L2_CAP_DEVICE_CAPS;
      return 0;
    }
    case VIDIOC_ENUM_FMT: {
      auto& d = *static_cast<v4l2_fmtdesc*>(argument);
      std::vector<std::uint32_t> seen;
      for (const auto& f : formats)
        if (std::find(seen.begin(), seen.end(), f.fourcc) == seen.end()) seen.push_back(f.fourcc);
      if (d.index >= seen.size()) return fail(EINVAL);
      d.pixelformat = seen[d.index];
      return 0;
    }
    case VIDIOC_ENUM_FRAMESIZES:
      return enumerate_sizes(*static_cast<v4l2_frmsizeenum*>(argument));
    case VIDIOC_ENUM_FRAMEINTERVALS:
      return enumerate_rates(*static_cast<v4l2_frmivalenum*>(argument));
    case VIDIOC_S_FMT:
      return set_format(static_cast<v4l2_format*>(argument)->fmt.pix);
    case VIDIOC_G_PARM:
    case VIDIOC_S_PARM: {
      auto& p = static_cast<v4l2_streamparm*>(argument)->parm.capture;
      p.capability = V4L2_CAP_TIMEPERFRAME;
      p.timeperframe = {1, static_cast<__u32>(format.rates.empty() ? 30 : format.rates.front())};
      return 0;
    }
    case VIDIOC_QUERYCTRL: {
      auto& q = *static_cast<v4l2_queryctrl*>(argument);
      v4l2_control c{q.id, 0};
      if (control(c, false) != 0) return -1;
      q.minimum = 0, q.maximum = 10'000, q.flags = 0;
      return 0;
    }
    case VIDIOC_G_CTRL:
      return control(*static_cast<v4l2_control*>(argument), false);
    case VIDIOC_S_CTRL:
      return control(*static_cast<v4l2_control*>(argument), true);
    case VIDIOC_REQBUFS:
      return allocate(*static_cast<v4l2_requestbuffers*>(argument));
    case VIDIOC_QUERYBUF: {
      auto& b = *static_cast<v4l2_buffer*>(argument);
      if (b.index >= buffers.size()) return fail(EINVAL);
      b = buffers[b.index].header;
      return 0;
    }
    case VIDIOC_QBUF: {
      const auto& b = *static_cast<v4l2_buffer*>(argument);
      if (b.index >= buffers.size()) return fail(EINVAL);
      queued.push_back(b.index);
      changed.notify_all();
      return 0;
    }
    case VIDIOC_DQBUF:
      return dequeue(*static_cast<v4l2_buffer*>(argument));
    default:
      return fail(ENOTTY);
  }
}

Device& device() {
  static auto* const the_device = new Device;  // outlives every thread of the program
  return *the_device;
}

bool is_ours(const char* path) { return path != nullptr && device().node == path; }

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  if (std::strncmp(path, "/dev/video", 10) == 0) return is_ours(path) ? device().open_node() : fail(ENOENT);
  va_list rest;
  va_start(rest, flags);
  const auto mode = va_arg(rest, mode_t);
  va_end(rest);
  return real<int (*)(const char*, int, mode_t)>("open")(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const auto mode = va_arg(rest, mode_t);
  va_end(rest);
  return std::strncmp(path, "/dev/video", 10) == 0
             ? open(path, flags, mode)
             : real<int (*)(const char*, int, mode_t)>("open64")(path, flags, mode);
}

int access(const char* path, int mode) noexcept {
  if (std::strncmp(path, "/dev/video", 10) != 0) return real<int (*)(const char*, int)>("access")(path, mode);
  const std::lock_guard lock(device().mutex);
  return is_ours(path) && device().plugged() ? 0 : fail(ENOENT);
}

int ioctl(int fd, unsigned long request, ...) noexcept {
  va_list rest;
  va_start(rest, request);
  void* argument = va_arg(rest, void*);
  va_end(rest);
  if (fd < 0 || fd != device().fd) return real<int (*)(int, unsigned long, void*)>("ioctl")(fd, request, argument);
  return device().request(request, argument);
}

void* mmap(void* address, std::size_t length, int protection, int flags, int fd, off_t offset) noexcept {
  if (fd >= 0 && fd == device().fd) {
    const auto index = static_cast<std::size_t>(offset >> 12);
    void* memory = device().buffers.at(index).memory;
    return mremap(memory, 0, length, MREMAP_MAYMOVE);  // a second mapping of the same shared pages
  }
  return real<void* (*)(void*, std::size_t, int, int, int, off_t)>("mmap")(address, length, protection, flags, fd,
                                                                           offset);
}

void* mmap64(void* address, std::size_t length, int protection, int flags, int fd, off_t offset) noexcept {
  return mmap(address, length, protection, flags, fd, offset);
}

int close(int fd) {
  if (fd >= 0 && fd == device().fd) device().close_node();
  return real<int (*)(int)>("close")(fd);
}
}
