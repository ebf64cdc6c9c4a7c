// The frame memory of a streaming V4L2 device, mapped into this process: queued, waited for, given back.
#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/v4l2_device.h"
#include "types/time.h"

namespace wasp::drivers {

/// What came out of the device's queue.
enum class V4l2Take : std::uint8_t {
  kFrame,    ///< `buffer` is filled
  kNone,     ///< none is ready
  kDamaged,  ///< an error of the device that may pass; no buffer came
  kGone,     ///< the device is not there any more, or will give nothing until it is opened anew
};

class V4l2Buffers {
 public:
  explicit V4l2Buffers(const V4l2Device& device) : device_(device) {}
  ~V4l2Buffers() { stop(); }
  V4l2Buffers(const V4l2Buffers&) = delete;
  V4l2Buffers& operator=(const V4l2Buffers&) = delete;

  /// Maps `count` buffers, queues them and lets the device run. Throws CameraError.
  void start(int count);
  void stop() noexcept;
  /// Sleeps until a buffer may be ready or the deadline; false on time-out.
  bool wait(TimeNs deadline_ns) const noexcept;
  /// Takes the oldest filled buffer; it must be given back.
  V4l2Take take(v4l2_buffer& buffer) const noexcept;
  void give_back(v4l2_buffer& buffer) const noexcept { device_.call(VIDIOC_QBUF, &buffer); }
  /// The bytes the device filled.
  [[nodiscard]] std::span<const std::uint8_t> bytes(const v4l2_buffer& buffer) const noexcept;

 private:
  struct Mapping {
    void* address;
    std::size_t bytes;
  };
  void map(__u32 index);

  const V4l2Device& device_;
  std::vector<Mapping> mappings_;
};

}  // namespace wasp::drivers
