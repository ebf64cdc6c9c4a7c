#include "drivers/v4l2_buffers.h"

#include <poll.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "drivers/camera_driver.h"
#include "rt/clock.h"

namespace wasp::drivers {
namespace {

v4l2_buffer empty_buffer(__u32 index = 0) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

}  // namespace

void V4l2Buffers::map(__u32 index) {
  v4l2_buffer buffer = empty_buffer(index);
  device_.demand(VIDIOC_QUERYBUF, &buffer, "ask for its frame memory");
  void* address = mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, device_.fd(), buffer.m.offset);
  if (address == MAP_FAILED)
    throw CameraError(device_.identity().node, std::string("cannot map its frame memory: ") + std::strerror(errno));
  mappings_.push_back({address, buffer.length});
}

void V4l2Buffers::start(int count) {
  v4l2_requestbuffers request{};
  request.count = static_cast<__u32>(count);
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  device_.demand(VIDIOC_REQBUFS, &request, "get frame memory");
  if (request.count < 2) throw CameraError(device_.identity().node, "gives fewer than two frame buffers");
  for (__u32 i = 0; i < request.count; ++i) map(i);
  for (__u32 i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = empty_buffer(i);
    device_.demand(VIDIOC_QBUF, &buffer, "queue its frame memory");
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  device_.demand(VIDIOC_STREAMON, &type, "start it");
}

void V4l2Buffers::stop() noexcept {
  if (mappings_.empty()) return;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  device_.call(VIDIOC_STREAMOFF, &type);
  for (const Mapping& m : mappings_) munmap(m.address, m.bytes);
  mappings_.clear();
}

bool V4l2Buffers::wait(TimeNs deadline_ns) const noexcept {
  for (;;) {
    const timespec left = rt::to_timespec(std::max<DurationNs>(0, deadline_ns - rt::now()));
    pollfd waiter{device_.fd(), POLLIN, 0};
    const int ready = ppoll(&waiter, 1, &left, nullptr);
    if (ready > 0) return true;
    if (ready == 0) return false;
    if (errno != EINTR) return true;  // take() tells what is wrong
  }
}

V4l2Take V4l2Buffers::take(v4l2_buffer& buffer) const noexcept {
  buffer = empty_buffer();
  switch (device_.call(VIDIOC_DQBUF, &buffer)) {
    case 0:
      return buffer.index < mappings_.size() ? V4l2Take::kFrame : V4l2Take::kGone;
    case EAGAIN:
      return V4l2Take::kNone;
    case EIO:
      return V4l2Take::kDamaged;
    default:
      return V4l2Take::kGone;
  }
}

std::span<const std::uint8_t> V4l2Buffers::bytes(const v4l2_buffer& buffer) const noexcept {
  const Mapping& m = mappings_[buffer.index];
  return {static_cast<const std::uint8_t*>(m.address), std::min<std::size_t>(buffer.bytesused, m.bytes)};
}

}  // namespace wasp::drivers
